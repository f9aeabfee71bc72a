//! How a reward is computed, and what it is computed from.

use super::Objective;
use crate::base::error::Result;
use crate::flock::World;
use crate::parallel::Progress;

/// How a reward is computed.
#[derive(Clone, Copy)]
pub(crate) enum Term<const D: usize> {
    /// The reward of every agent for a step.
    Team(fn(&Moment<'_, D>) -> f64),
    /// Adds the reward of each agent for a step.
    Individual(fn(&Moment<'_, D>, &mut [f64])),
    /// Adds the reward of each agent for an action, which the flock repeats once per agent.
    Counterfactual(fn(&Action<'_, D>, &mut [f64], &Progress) -> Result<()>),
}

impl<const D: usize> Term<D> {
    /// Adds the rewards of a step to `rewards`: one entry for the flock, or one per agent. Returns the team's reward,
    /// 0 for other terms.
    pub(crate) fn add_step(&self, moment: &Moment<'_, D>, rewards: &mut [f64]) -> f64 {
        match self {
            Self::Team(reward) => {
                let team = reward(moment);
                for reward in rewards {
                    *reward += team;
                }
                team
            }
            Self::Individual(add) => {
                add(moment, rewards);
                0.0
            }
            Self::Counterfactual(_) => 0.0,
        }
    }
}

/// A step that was just made. Distances are in m, 0 for agents that were caught.
#[derive(Debug)]
pub(crate) struct Moment<'a, const D: usize> {
    pub(crate) world: &'a World<D>,
    /// In m.
    pub(crate) max_range: f64,
    /// The objective's value now.
    pub(crate) value: f64,
    /// Its running minimum before and after the step, and at the start of the episode.
    pub(crate) minimum_before: f64,
    pub(crate) minimum: f64,
    pub(crate) minimum_at_start: f64,
    /// Every agent's distance before and after the step; empty for team terms.
    pub(crate) distances_before: &'a [f64],
    pub(crate) distances: &'a [f64],
    /// The same when the running minimum fell last before this step, or at the start.
    pub(crate) distances_at_minimum: &'a [f64],
    pub(crate) is_last: bool,
}

/// An action that was just held.
#[derive(Debug)]
pub(crate) struct Action<'a, const D: usize> {
    /// The flock before it.
    pub(crate) before: &'a World<D>,
    pub(crate) objective: Objective,
    /// Every agent's range in m.
    pub(crate) ranges: &'a [f64],
    /// Steps for which they were held, or until no agent was left.
    pub(crate) num_steps: usize,
    /// The objective's value after it.
    pub(crate) value: f64,
}

/// Adds the differences of `now` and `before`.
pub(super) fn add_changes(now: &[f64], before: &[f64], rewards: &mut [f64]) {
    for ((reward, now), before) in rewards.iter_mut().zip(now).zip(before) {
        *reward += now - before;
    }
}
