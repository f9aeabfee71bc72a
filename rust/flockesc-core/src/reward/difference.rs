//! Difference rewards (Wolpert and Tumer, "Optimal payoff functions for members of collectives", 2002): the
//! contribution of one agent's range to the objective.

use super::term::ActionContext;
use crate::base::error::Result;
use crate::neighbor::Ranges;
use crate::parallel::Progress;

/// Adds G - G_-i to the reward of every agent i that was not caught. G is the objective's value after the
/// action, and G_-i is the value after the same action with a range of 0 for agent i.
///
/// # Errors
/// [`crate::Error::Interrupted`] if `progress` was cancelled.
pub(super) fn add<const D: usize>(
    action: &ActionContext<'_, D>,
    rewards: &mut [f64],
    progress: &Progress,
) -> Result<()> {
    let mut others = action.ranges.to_vec();
    for &id in action.before.agents().ids() {
        let id = id as usize;
        // With a range of 0 in the action itself, the difference is 0.
        if action.ranges[id] > 0.0 {
            others[id] = 0.0;
            let mut world = action.before.clone();
            for _ in 0..action.num_steps {
                if world.agents().len() == 0 {
                    break;
                }
                progress.check()?;
                world.step(Ranges::PerAgent(&others))?;
            }
            rewards[id] += action.value - action.objective.value_of(&world);
            others[id] = action.ranges[id];
        }
    }
    Ok(())
}
