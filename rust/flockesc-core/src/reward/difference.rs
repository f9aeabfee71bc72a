//! Difference rewards (Wolpert and Tumer, "Optimal payoff functions for members of collectives", 2002): the
//! contribution of one agent's range to the objective.

use super::Objective;
use crate::base::error::Result;
use crate::flock::World;
use crate::neighbor::Ranges;
use crate::parallel::Progress;

/// An action, before it and after it.
#[derive(Debug)]
pub(crate) struct ActionContext<'a, const D: usize> {
    /// The flock before the action.
    pub(crate) before: &'a World<D>,
    pub(crate) objective: Objective,
    /// Range of every agent in m.
    pub(crate) ranges: &'a [f64],
    /// Number of steps of the action. It ends earlier if all agents are caught.
    pub(crate) num_steps: usize,
    /// The objective's value after the action.
    pub(crate) value: f64,
}

impl<const D: usize> ActionContext<'_, D> {
    /// Adds G - G_-i to the reward of every agent i that was not caught. G is the objective's value after the
    /// action, and G_-i is the value after the same action with a range of 0 for agent i.
    ///
    /// # Errors
    /// [`crate::Error::Interrupted`] if `progress` was cancelled.
    pub(crate) fn add_differences(&self, rewards: &mut [f64], progress: &Progress) -> Result<()> {
        let mut others = self.ranges.to_vec();
        for &id in self.before.agents().ids() {
            let id = id as usize;
            // With a range of 0 in the action itself, the difference is 0.
            if self.ranges[id] > 0.0 {
                others[id] = 0.0;
                let mut world = self.before.clone();
                for _ in 0..self.num_steps {
                    if world.agents().len() == 0 {
                        break;
                    }
                    progress.check()?;
                    world.step(Ranges::PerAgent(&others))?;
                }
                rewards[id] += self.value - self.objective.value_of(&world);
                others[id] = self.ranges[id];
            }
        }
        Ok(())
    }
}
