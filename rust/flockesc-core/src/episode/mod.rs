//! Episodes: a flock from t = 0 to the horizon, with actions, rewards and observations.

mod batch;
mod options;
mod outcomes;
mod rollout;
mod slot;

use std::sync::{Arc, OnceLock};

pub use batch::{AtEnd, Batch, Observed, SlotReset};
pub use options::EpisodeConfig;
pub use outcomes::{Metrics, Running};
pub use rollout::EpisodeOutcome;

use crate::base::error::Result;
use crate::flock::{FlockConfig, InitialState, Summary, World, WorldState};
use crate::neighbor::Ranges;
use crate::observation::{Extras, Scene, View};
use crate::parallel::Progress;
use crate::reward::ActionContext;
use outcomes::Outcomes;

/// An episode of one flock.
#[derive(Debug, Clone)]
pub struct Episode<const D: usize> {
    config: Arc<EpisodeConfig>,
    world: World<D>,
    outcomes: Outcomes,
    /// Computed when it is needed first after an action.
    summary: OnceLock<Summary<D>>,
    /// Team reward of the last action; 0 for individual rewards.
    team_reward: f64,
}

/// The serialized form of an [`Episode`].
pub(crate) type EpisodeState<const D: usize> = (WorldState<D>, Outcomes);

impl<const D: usize> Episode<D> {
    /// Creates the episode at t = 0. `scenario` and `start` are as in [`World::new`].
    pub fn new(
        scenario: Arc<FlockConfig>,
        config: Arc<EpisodeConfig>,
        start: &InitialState,
    ) -> Self {
        let world = World::new(scenario, start);
        let outcomes = Outcomes::new(&world, &config);
        Self::of(config, world, outcomes)
    }

    fn of(config: Arc<EpisodeConfig>, world: World<D>, outcomes: Outcomes) -> Self {
        Self {
            config,
            world,
            outcomes,
            summary: OnceLock::new(),
            team_reward: 0.0,
        }
    }

    pub(crate) fn save(&self) -> EpisodeState<D> {
        (self.world.save(), self.outcomes.clone())
    }

    /// Restores an episode that was started with `seed` in a drawn scenario.
    pub(crate) fn restore(
        (world, outcomes): EpisodeState<D>,
        scenario: Arc<FlockConfig>,
        config: &Arc<EpisodeConfig>,
        seed: u64,
    ) -> Self {
        let world = World::restore(world, scenario, seed);
        Self::of(config.clone(), world, outcomes)
    }

    /// Applies one action for `steps_per_action` steps or until the end of the episode, and writes the
    /// rewards.
    ///
    /// `ranges` in m and `rewards` have one entry, or one per agent. Agents that were caught before the
    /// action get 0. `predator_actions` has D entries per learned predator; if it is empty, learned predators
    /// fly straight on.
    ///
    /// # Errors
    /// [`crate::Error::Interrupted`] if `progress` was cancelled. Only part of the action was then applied,
    /// and the episode is unusable.
    pub fn advance(
        &mut self,
        ranges: &[f64],
        predator_actions: &[f64],
        rewards: &mut [f64],
        progress: &Progress,
    ) -> Result<()> {
        self.summary.take();
        self.world.set_predator_actions(predator_actions);
        self.outcomes.ranges.copy_from_slice(ranges);
        let caught_before = self.world.caught().len();
        let repeats_action = self.config.reward.repeats_actions();
        let before = repeats_action.then(|| self.world.clone());
        let left = self.world.config().num_steps - self.outcomes.step;
        let num_steps = self.config.steps_per_action.min(left);
        let cost = self.config.range_cost;
        let mean = || Ranges::from(ranges).mean(self.world.agents().ids());
        let team_cost = if cost > 0.0 { cost * mean() } else { 0.0 };
        rewards.fill(0.0);
        self.team_reward = 0.0;
        for _ in 0..num_steps {
            if self.outcomes.is_end(&self.world) {
                break;
            }
            progress.check()?;
            self.world.step(ranges.into())?;
            self.team_reward += self.outcomes.record(&self.world, &self.config, rewards);
        }
        if let Some(before) = before {
            let action = ActionContext {
                before: &before,
                objective: self.config.objective,
                ranges,
                num_steps,
                value: self.objective().now,
            };
            action.add_differences(rewards, progress)?;
        }
        if self.config.reward.is_individual() {
            for (reward, range) in rewards.iter_mut().zip(ranges) {
                *reward -= cost * range;
            }
        } else {
            self.team_reward -= team_cost;
            rewards.fill(self.team_reward);
        }
        if self.config.view.is_per_agent() {
            for agent in self.world.caught().take(caught_before) {
                rewards[agent] = 0.0;
            }
        }
        Ok(())
    }

    /// Returns the number of pairs in the neighbor graph that the next action freezes.
    ///
    /// # Errors
    /// [`crate::Error::Memory`] for the graph.
    pub(crate) fn pairs_to_freeze(&self, ranges: &[f64]) -> Result<usize> {
        self.world.pairs_to_freeze(ranges.into())
    }

    /// Writes the observation: one row for the flock, or one per agent.
    ///
    /// # Errors
    /// [`crate::Error::Interrupted`] if `progress` was cancelled.
    pub fn observe(&self, out: &mut [f32], progress: &Progress) -> Result<()> {
        self.observe_as(&self.config, out, progress)
    }

    /// Writes the observation that `config` describes, of an episode with one range per agent.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn observe_as(
        &self,
        config: &EpisodeConfig,
        out: &mut [f32],
        progress: &Progress,
    ) -> Result<()> {
        let mut scene = self.scene_as(config);
        // The row of the flock has the mean range. The mean of equal numbers can differ from them by rounding.
        let are_equal = || scene.ranges.windows(2).all(|pair| pair[0] == pair[1]);
        if !config.view.is_per_agent() && are_equal() {
            scene.ranges = &scene.ranges[..1];
        }
        scene.observe(config.view, out, progress)
    }

    /// Writes the row of the flock without optional entries, also if there is one row per agent.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn observe_flock(&self, out: &mut [f32], progress: &Progress) -> Result<()> {
        let scene = Scene {
            extras: Extras::default(),
            ..self.scene()
        };
        scene.observe(View::Flock, out, progress)
    }

    /// Writes the observations of the learned predators, one row per predator.
    pub fn observe_predators(&self, out: &mut [f32]) {
        self.scene().observe_predators(out);
    }

    fn scene(&self) -> Scene<'_, D> {
        self.scene_as(&self.config)
    }

    fn scene_as<'a>(&'a self, config: &'a EpisodeConfig) -> Scene<'a, D> {
        Scene {
            world: &self.world,
            summary: &self.summary,
            objective: config.objective,
            minimum: self.outcomes.objectives[config.objective as usize].minimum,
            ranges: &self.outcomes.ranges,
            max_range: config.max_range,
            sensing_range: config.predator_sensing_range,
            extras: config.extras(),
            step: self.outcomes.step,
        }
    }

    /// Returns the team reward of the last action; 0 for individual rewards.
    pub(crate) fn team_reward(&self) -> f64 {
        self.team_reward
    }

    /// Returns whether the episode has reached its horizon or the limit of actions, or all agents were caught.
    pub fn has_ended(&self) -> bool {
        self.outcomes.is_end(&self.world) || self.has_reached_limit()
    }

    /// Returns whether the episode has reached the limit of actions, even if all agents were caught in the last one.
    pub fn has_reached_limit(&self) -> bool {
        let num_actions = self.outcomes.step.div_ceil(self.config.steps_per_action);
        let limit = self.config.max_actions;
        limit.is_some_and(|limit| num_actions >= limit)
    }

    /// Returns the number of model steps so far.
    pub fn step_count(&self) -> usize {
        self.outcomes.step
    }

    /// Returns the flock.
    pub fn world(&self) -> &World<D> {
        &self.world
    }

    /// Returns the options.
    pub fn config(&self) -> &EpisodeConfig {
        &self.config
    }

    /// Returns the value of the objective.
    pub fn objective(&self) -> Running {
        self.outcomes.objectives[self.config.objective as usize]
    }

    /// Returns the metrics.
    pub fn metrics(&self) -> Metrics {
        Metrics {
            objectives: self.outcomes.objectives,
            polarization: self.polarization(),
            load: self.world.load,
        }
    }

    /// Returns the norm of the mean heading, in [0, 1].
    pub fn polarization(&self) -> f64 {
        self.scene().summary().polarization
    }

    /// Returns the ranges in m of the last action: one entry, or one per agent.
    pub fn ranges(&self) -> &[f64] {
        &self.outcomes.ranges
    }

    /// Returns the number of weakly connected components under the ranges of the last action.
    pub fn num_components(&self) -> usize {
        self.world.num_components(self.ranges().into())
    }
}
