//! What the agents of one group are like, column by column.

use crate::agents::{Column, GROUP, PerAgent};
use crate::flock::scenario::FlockConfig;

pub(super) struct Traits {
    /// dt / m in s/kg.
    pub(super) gain: Column<f64>,
    /// v0 in m/s.
    pub(super) speed: Column<f64>,
    /// a v0, the norm of the consensus force.
    pub(super) alignment: Column<f64>,
    /// s.
    pub(super) repulsion: Column<f64>,
    /// Whether some of this differs between agents.
    is_mixed: bool,
}

impl Traits {
    /// Of a group in which every agent is like the first one of the flock.
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

    /// Goes on to the group of these agents.
    #[inline(always)]
    pub(super) fn follow(&mut self, config: &FlockConfig, names: &[u32]) {
        if !self.is_mixed {
            return;
        }
        config.mass.gather(names, &mut self.gain);
        config.speed.gather(names, &mut self.speed);
        config.alignment_strength.gather(names, &mut self.alignment);
        config.repulsion_strength.gather(names, &mut self.repulsion);
        for lane in 0..names.len() {
            self.gain[lane] = config.time_step / self.gain[lane];
            self.alignment[lane] *= self.speed[lane];
        }
    }
}
