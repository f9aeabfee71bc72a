//! Rewards equal to the predator distance.

use super::term::StepContext;

/// Returns the objective's value divided by T.
pub(super) fn team<const D: usize>(step: &StepContext<'_, D>) -> f64 {
    step.value * share(step)
}

/// Adds d_i divided by T.
pub(super) fn individual<const D: usize>(step: &StepContext<'_, D>, rewards: &mut [f64]) {
    let share = share(step);
    for (reward, distance) in rewards.iter_mut().zip(step.distances) {
        *reward += distance * share;
    }
}

/// Returns 1 / T, where T is the number of steps of an episode.
fn share<const D: usize>(step: &StepContext<'_, D>) -> f64 {
    (step.world.config().num_steps as f64).recip()
}
