//! The distance to the predators itself.

use super::term::Moment;

/// The objective's value over T.
pub(super) fn team<const D: usize>(moment: &Moment<'_, D>) -> f64 {
    moment.value * share(moment)
}

/// Adds d_i over T.
pub(super) fn individual<const D: usize>(moment: &Moment<'_, D>, rewards: &mut [f64]) {
    let share = share(moment);
    for (reward, distance) in rewards.iter_mut().zip(moment.distances) {
        *reward += distance * share;
    }
}

/// One step's share of the episode.
fn share<const D: usize>(moment: &Moment<'_, D>) -> f64 {
    (moment.world.config().num_steps as f64).recip()
}
