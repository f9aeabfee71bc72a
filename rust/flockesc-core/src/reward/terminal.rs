//! The whole return on the last step.

use super::term::Moment;

/// J - m_0 on the last step, 0 before.
pub(super) fn team<const D: usize>(moment: &Moment<'_, D>) -> f64 {
    if moment.is_last {
        moment.minimum - moment.minimum_at_start
    } else {
        0.0
    }
}
