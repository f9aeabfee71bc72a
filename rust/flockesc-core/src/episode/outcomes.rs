//! `Outcomes`: what an episode has brought so far, and `Metrics`, its summary.

use serde::{Deserialize, Serialize};

use super::options::EpisodeConfig;
use crate::base::load::Load;
use crate::flock::World;
use crate::reward::{Objective, StepContext};

/// A value over an episode: a predator distance in m, or the fraction of the agents that were not caught.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Running {
    /// Value at t = 0.
    pub start: f64,
    /// Current value.
    pub now: f64,
    /// Smallest value so far. At the horizon it is the objective J.
    pub minimum: f64,
}

/// Metrics of one episode, as the environments' `info` reports them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metrics {
    /// The values of all objectives, in the order of [`Objective`].
    pub objectives: [Running; Objective::COUNT],
    /// Norm of the mean heading.
    pub polarization: f64,
    /// What the ranges cost so far.
    pub load: Load,
}

/// What an episode has brought so far.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Outcomes {
    /// Number of model steps.
    pub(super) step: usize,
    /// d_i in m after the current and the previous step. Empty unless rewards are individual.
    distances: Vec<f64>,
    distances_before: Vec<f64>,
    /// d_i in m at the last fall of the objective's running minimum, or at t = 0. Empty unless rewards are
    /// individual.
    distances_at_minimum: Vec<f64>,
    /// The values of all objectives, in the order of [`Objective`].
    pub(super) objectives: [Running; Objective::COUNT],
    /// Ranges in m of the last action, one or n; 0 before the first action.
    pub(super) ranges: Vec<f64>,
}

impl Outcomes {
    /// Creates the outcomes at t = 0.
    pub(super) fn new<const D: usize>(world: &World<D>, config: &EpisodeConfig) -> Self {
        let mut distances = Vec::new();
        if config.reward.is_individual() {
            world.write_distances(&mut distances);
        }
        Self {
            step: 0,
            distances_before: distances.clone(),
            distances_at_minimum: distances.clone(),
            distances,
            objectives: Objective::values_of(world).map(|value| Running {
                start: value,
                now: value,
                minimum: value,
            }),
            ranges: vec![0.0; config.view.rows(world.config())],
        }
    }

    /// Records a step, after which the flock is `world`. Adds individual rewards of the step to `rewards`, and returns
    /// the reward of the team.
    pub(super) fn record<const D: usize>(
        &mut self,
        world: &World<D>,
        config: &EpisodeConfig,
        rewards: &mut [f64],
    ) -> f64 {
        self.step += 1;
        if config.reward.is_individual() {
            std::mem::swap(&mut self.distances_before, &mut self.distances);
            world.write_distances(&mut self.distances);
        }
        let minimum_before = self.objectives[config.objective as usize].minimum;
        for (running, value) in self.objectives.iter_mut().zip(Objective::values_of(world)) {
            running.now = value;
            running.minimum = running.minimum.min(value);
        }
        let objective = self.objectives[config.objective as usize];
        let context = StepContext {
            world,
            value: objective.now,
            minimum_before,
            minimum: objective.minimum,
            minimum_at_start: objective.start,
            distances_before: &self.distances_before,
            distances: &self.distances,
            distances_at_minimum: &self.distances_at_minimum,
            is_last: self.is_end(world),
        };
        // NOTE: Rewards are added, because an action has several steps; the caller has set them to 0.
        let team = config.reward.of_team(&context);
        config.reward.add_individual(&context, rewards);
        // After the rewards, which compare with the distances of the fall before.
        if objective.minimum < minimum_before {
            self.distances_at_minimum.clone_from(&self.distances);
        }
        team
    }

    /// Returns whether the episode has reached its horizon or all agents were caught.
    pub(super) fn is_end<const D: usize>(&self, world: &World<D>) -> bool {
        self.step >= world.config().num_steps || world.agents().len() == 0
    }
}
