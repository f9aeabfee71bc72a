//! `Term`: the function of a reward, and its inputs.

use super::Objective;
use crate::base::error::Result;
use crate::flock::World;
use crate::parallel::Progress;

/// The function that computes a reward.
#[derive(Clone, Copy)]
pub(crate) enum Term<const D: usize> {
    /// Returns the common reward of all agents for a step.
    Team(fn(&StepContext<'_, D>) -> f64),
    /// Adds the reward of each agent for a step.
    Individual(fn(&StepContext<'_, D>, &mut [f64])),
    /// Adds the reward of each agent for an action, by repeating the action once per agent.
    Counterfactual(fn(&ActionContext<'_, D>, &mut [f64], &Progress) -> Result<()>),
}

impl<const D: usize> Term<D> {
    /// Adds the rewards of a step to `rewards`, which has one entry or one per agent. Returns the team's
    /// reward, or 0 for other terms.
    pub(crate) fn add_step(&self, step: &StepContext<'_, D>, rewards: &mut [f64]) -> f64 {
        match self {
            Self::Team(reward) => {
                let team = reward(step);
                for reward in rewards {
                    *reward += team;
                }
                team
            }
            Self::Individual(add) => {
                add(step, rewards);
                0.0
            }
            Self::Counterfactual(_) => 0.0,
        }
    }
}

/// The input of a reward for a step. Distances are in m, and 0 for caught agents.
#[derive(Debug)]
pub(crate) struct StepContext<'a, const D: usize> {
    pub(crate) world: &'a World<D>,
    /// Largest range of an action in m.
    pub(crate) max_range: f64,
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

/// The input of a reward for an action.
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

/// Adds `now` - `before` to `rewards`, entry by entry.
pub(super) fn add_changes(now: &[f64], before: &[f64], rewards: &mut [f64]) {
    for ((reward, now), before) in rewards.iter_mut().zip(now).zip(before) {
        *reward += now - before;
    }
}
