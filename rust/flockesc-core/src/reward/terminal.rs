//! The terminal reward: the whole return in the last step.

use super::term::StepContext;

/// Returns J - m_0 in the last step, 0 before.
pub(super) fn team<const D: usize>(step: &StepContext<'_, D>) -> f64 {
    if step.is_last {
        step.minimum - step.minimum_at_start
    } else {
        0.0
    }
}
