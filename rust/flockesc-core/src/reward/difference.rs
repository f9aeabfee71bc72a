//! Difference rewards (Wolpert and Tumer, "Optimal payoff functions for members of collectives", 2002): what the flock
//! gains by what one agent hears.

use super::objective::Objective;
use crate::base::error::Result;
use crate::flock::World;
use crate::neighbor::Ranges;
use crate::parallel::Progress;

/// Adds to every agent i in the flock `value` - G_-i: the objective's value after the action of these ranges, which
/// was held for so many steps or until nobody was left, and the same had agent i alone had a range of 0.
///
/// # Errors
/// [`crate::Error::Interrupted`] if `progress` was cancelled.
pub(crate) fn add<const D: usize>(
    before: &World<D>,
    objective: Objective,
    (ranges, num_steps): (&[f64], usize),
    value: f64,
    rewards: &mut [f64],
    progress: &Progress,
) -> Result<()> {
    let mut others = ranges.to_vec();
    for &name in before.agents().names() {
        let name = name as usize;
        // Whoever hears nobody as it is gives no other flock.
        if ranges[name] > 0.0 {
            others[name] = 0.0;
            let mut world = before.clone();
            for _ in 0..num_steps {
                if world.agents().len() == 0 {
                    break;
                }
                progress.check()?;
                world.step(Ranges::PerAgent(&others));
            }
            rewards[name] += value - value_of(objective, &world);
            others[name] = ranges[name];
        }
    }
    Ok(())
}

fn value_of<const D: usize>(objective: Objective, world: &World<D>) -> f64 {
    match objective {
        Objective::Mean => world.predator_distance().mean,
        Objective::Minimum => world.predator_distance().minimum,
        Objective::Survival => world.fraction_surviving(),
    }
}
