//! Per-agent parameters of one group, column by column.

use super::parameters::Parameters;
use crate::agents::{Column, GROUP, PerAgent};

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
    pub(super) fn of_first(parameters: &Parameters<'_>) -> Self {
        let fields = [
            parameters.mass,
            parameters.speed,
            parameters.alignment_strength,
            parameters.repulsion_strength,
        ];
        let speed = parameters.speed.of(0);
        Self {
            gain: [parameters.time_step / parameters.mass.of(0); GROUP],
            speed: [speed; GROUP],
            alignment: [parameters.alignment_strength.of(0) * speed; GROUP],
            repulsion: [parameters.repulsion_strength.of(0); GROUP],
            is_mixed: fields
                .iter()
                .any(|field| matches!(field, PerAgent::Each(_))),
        }
    }

    /// Loads the parameters of the agents with these `ids`, if parameters differ between agents.
    #[inline(always)]
    pub(super) fn load(&mut self, parameters: &Parameters<'_>, ids: &[u32]) {
        if !self.is_mixed {
            return;
        }
        parameters.mass.gather(ids, &mut self.gain);
        parameters.speed.gather(ids, &mut self.speed);
        parameters
            .alignment_strength
            .gather(ids, &mut self.alignment);
        parameters
            .repulsion_strength
            .gather(ids, &mut self.repulsion);
        for lane in 0..ids.len() {
            self.gain[lane] = parameters.time_step / self.gain[lane];
            self.alignment[lane] *= self.speed[lane];
        }
    }
}
