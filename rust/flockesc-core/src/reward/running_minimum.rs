//! The change of the objective's running minimum.

use super::term::{Moment, add_changes};

/// m_t - m_(t-1).
pub(super) fn team<const D: usize>(moment: &Moment<'_, D>) -> f64 {
    moment.minimum - moment.minimum_before
}

/// Adds d_i minus d_i at the minimum's last fall, in a step in which it falls.
pub(super) fn individual<const D: usize>(moment: &Moment<'_, D>, rewards: &mut [f64]) {
    if moment.minimum < moment.minimum_before {
        add_changes(moment.distances, moment.distances_at_minimum, rewards);
    }
}
