//! The inputs of rewards: `StepContext` for a step, `ActionContext` for a whole action.

use super::Objective;
use crate::base::error::Result;
use crate::flock::World;
use crate::neighbor::Ranges;
use crate::parallel::Progress;

/// The input of a reward for a step. Distances are in m, and 0 for caught agents.
#[derive(Debug)]
pub(crate) struct StepContext<'a, const D: usize> {
    pub(crate) world: &'a World<D>,
    /// The objective's value after the step.
    pub(crate) value: f64,
    /// The objective's running minimum before the step, after the step and at t = 0.
    pub(crate) minimum_before: f64,
    pub(crate) minimum: f64,
    pub(crate) minimum_at_start: f64,
    /// d_i before and after the step; empty for team terms.
    pub(crate) distances_before: &'a [f64],
    pub(crate) distances: &'a [f64],
    /// d_i at the last fall of the running minimum before this step, or at t = 0; empty for team terms.
    pub(crate) distances_at_minimum: &'a [f64],
    pub(crate) is_last: bool,
}

impl<const D: usize> StepContext<'_, D> {
    /// Returns 1 / T, where T is the number of steps of an episode.
    pub(super) fn share(&self) -> f64 {
        (self.world.config().num_steps as f64).recip()
    }

    /// Adds the changes of d_i since `before` to `rewards`.
    pub(super) fn add_changes(&self, before: &[f64], rewards: &mut [f64]) {
        for ((reward, now), before) in rewards.iter_mut().zip(self.distances).zip(before) {
            *reward += now - before;
        }
    }
}

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
