//! Per-agent parameters of one group, column by column.

use crate::agents::{Column, GROUP, PerAgent};
use crate::flock::scenario::FlockConfig;

/// Per-agent parameters of one group.
pub(super) struct ParameterColumns {
    /// dt / m in s/kg.
    pub(super) gain: Column<f64>,
    /// v0 in m/s.
    pub(super) speed: Column<f64>,
    /// a v0, the norm of the consensus force.
    pub(super) alignment: Column<f64>,
    /// s, the norm of the escape force.
    pub(super) repulsion: Column<f64>,
    /// Whether any parameter differs between agents.
    is_mixed: bool,
}

impl ParameterColumns {
    /// Fills all lanes with the parameters of agent 0.
    #[inline(always)]
    pub(super) fn of_first(config: &FlockConfig) -> Self {
        let fields = [
            &config.mass,
            &config.speed,
            &config.alignment_strength,
            &config.repulsion_strength,
        ];
        let speed = config.speed.of(0);
        Self {
            gain: [config.time_step / config.mass.of(0); GROUP],
            speed: [speed; GROUP],
            alignment: [config.alignment_strength.of(0) * speed; GROUP],
            repulsion: [config.repulsion_strength.of(0); GROUP],
            is_mixed: fields
                .iter()
                .any(|field| matches!(field, PerAgent::Each(_))),
        }
    }

    /// Loads the parameters of the agents with these `ids`, if parameters differ between agents.
    #[inline(always)]
    pub(super) fn load(&mut self, config: &FlockConfig, ids: &[u32]) {
        if !self.is_mixed {
            return;
        }
        config.mass.gather(ids, &mut self.gain);
        config.speed.gather(ids, &mut self.speed);
        config.alignment_strength.gather(ids, &mut self.alignment);
        config.repulsion_strength.gather(ids, &mut self.repulsion);
        for lane in 0..ids.len() {
            self.gain[lane] = config.time_step / self.gain[lane];
            self.alignment[lane] *= self.speed[lane];
        }
    }
}
