//! Difference rewards (Wolpert and Tumer, "Optimal payoff functions for members of collectives", 2002): what the flock
//! gains because one agent hears its neighbors.

use super::term::Action;
use crate::base::error::Result;
use crate::neighbor::Ranges;
use crate::parallel::Progress;

/// Adds for every agent i in the flock G - G_-i: the objective's value after the action, minus the value had agent i
/// alone had a range of 0.
///
/// # Errors
/// [`crate::Error::Interrupted`] if `progress` was cancelled.
pub(super) fn add<const D: usize>(
    action: &Action<'_, D>,
    rewards: &mut [f64],
    progress: &Progress,
) -> Result<()> {
    let mut others = action.ranges.to_vec();
    for &id in action.before.agents().ids() {
        let id = id as usize;
        // Without neighbors, an agent makes no difference.
        if action.ranges[id] > 0.0 {
            others[id] = 0.0;
            let mut world = action.before.clone();
            for _ in 0..action.num_steps {
                if world.agents().len() == 0 {
                    break;
                }
                progress.check()?;
                world.step(Ranges::PerAgent(&others));
            }
            rewards[id] += action.value - action.objective.value_of(&world);
            others[id] = action.ranges[id];
        }
    }
    Ok(())
}
