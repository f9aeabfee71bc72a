//! Rewards equal to the change of the objective's running minimum.

use super::term::{StepContext, add_changes};

/// Returns m_t - m_(t-1).
pub(super) fn team<const D: usize>(step: &StepContext<'_, D>) -> f64 {
    step.minimum - step.minimum_before
}

/// If the minimum falls in this step, adds d_i minus d_i at the previous fall.
pub(super) fn individual<const D: usize>(step: &StepContext<'_, D>, rewards: &mut [f64]) {
    if step.minimum < step.minimum_before {
        add_changes(step.distances, step.distances_at_minimum, rewards);
    }
}
