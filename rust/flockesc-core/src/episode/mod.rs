//! Episodes: a flock from t = 0 to the horizon, with actions, rewards and observations.

mod batch;
mod metrics;
mod options;
mod rollout;
mod running;
mod slot;
mod state;

use std::sync::{Arc, OnceLock};

pub use batch::{AtEnd, Batch, SlotReset};
pub use metrics::Metrics;
pub use options::EpisodeConfig;
pub use rollout::EpisodeOutcome;
pub use running::Running;
pub(crate) use state::EpisodeState;

use crate::base::error::Result;
use crate::flock::{FlockConfig, InitialState, Summary, World};
use crate::neighbor::Ranges;
use crate::observation::{Extras, Scene, View};
use crate::parallel::Progress;
use crate::reward::{ActionContext, Objective, StepContext, Term};

/// An episode of one flock.
#[derive(Debug, Clone)]
pub struct Episode<const D: usize> {
    config: Arc<EpisodeConfig>,
    world: World<D>,
    step: usize,
    /// d_i in m after the current and the previous step. Empty unless rewards are individual.
    agent_distances: Vec<f64>,
    agent_distances_before: Vec<f64>,
    /// d_i in m at the last fall of the objective's running minimum, or at t = 0. Empty unless rewards are
    /// individual.
    agent_distances_at_minimum: Vec<f64>,
    /// The values of all objectives, in the order of [`Objective`].
    objectives: [Running; Objective::COUNT],
    /// Computed when it is needed first after an action.
    summary: OnceLock<Summary<D>>,
    /// Ranges in m of the last action, one or n; 0 before the first action.
    ranges: Vec<f64>,
    /// Team reward of the last action; 0 for individual rewards.
    team_reward: f64,
}

impl<const D: usize> Episode<D> {
    /// Creates the episode at t = 0. `start` must pass [`InitialState::check`].
    #[must_use]
    pub fn new(
        scenario: Arc<FlockConfig>,
        config: Arc<EpisodeConfig>,
        start: &InitialState,
    ) -> Self {
        let ranges = vec![0.0; rows(&config, &scenario)];
        let world = World::new(scenario, start);
        let mut agent_distances = Vec::new();
        if config.reward.is_individual() {
            world.write_distances(&mut agent_distances);
        }
        Self {
            objectives: Objective::values_of(&world).map(Running::new),
            summary: OnceLock::new(),
            config,
            world,
            step: 0,
            agent_distances_before: agent_distances.clone(),
            agent_distances_at_minimum: agent_distances.clone(),
            agent_distances,
            ranges,
            team_reward: 0.0,
        }
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
        self.ranges.copy_from_slice(ranges);
        let caught_before = self.world.caught().len();
        let term = self.config.reward.term::<D>();
        let counterfactual = match term {
            Term::Team(_) | Term::Individual(_) => None,
            Term::Counterfactual(add) => Some((add, self.world.clone())),
        };
        let left = self.world.config().num_steps - self.step;
        let num_steps = self.config.steps_per_action.min(left);
        rewards.fill(0.0);
        self.team_reward = 0.0;
        for _ in 0..num_steps {
            if self.has_ended() {
                break;
            }
            progress.check()?;
            let minimum_before = self.objective().minimum;
            self.world.step(as_ranges(&self.config, &self.ranges))?;
            self.step += 1;
            if self.config.reward.is_individual() {
                std::mem::swap(&mut self.agent_distances_before, &mut self.agent_distances);
                self.world.write_distances(&mut self.agent_distances);
            }
            let values = Objective::values_of(&self.world);
            for (running, value) in self.objectives.iter_mut().zip(values) {
                running.update(value);
            }
            let objective = self.objective();
            let step_context = StepContext {
                world: &self.world,
                max_range: self.config.max_range,
                value: objective.now,
                minimum_before,
                minimum: objective.minimum,
                minimum_at_start: objective.start,
                distances_before: &self.agent_distances_before,
                distances: &self.agent_distances,
                distances_at_minimum: &self.agent_distances_at_minimum,
                is_last: self.has_ended(),
            };
            self.team_reward += term.add_step(&step_context, rewards);
            if objective.minimum < minimum_before {
                self.agent_distances_at_minimum
                    .clone_from(&self.agent_distances);
            }
        }
        if let Some((add, before)) = counterfactual {
            let action = ActionContext {
                before: &before,
                objective: self.config.objective,
                ranges,
                num_steps,
                value: self.objective().now,
            };
            add(&action, rewards, progress)?;
        }
        if self.config.view == View::Agent {
            for agent in self.world.caught().take(caught_before) {
                rewards[agent] = 0.0;
            }
        }
        Ok(())
    }

    /// Returns the number of pairs in the neighbor graph that the next action freezes.
    ///
    /// # Errors
    /// [`crate::Error::Argument`] if the graph does not fit into memory.
    pub(crate) fn pairs_to_freeze(&self, ranges: &[f64]) -> Result<usize> {
        self.world.pairs_to_freeze(as_ranges(&self.config, ranges))
    }

    /// Returns the memory in bytes of an episode.
    pub(crate) fn bytes(scenario: &FlockConfig, config: &EpisodeConfig) -> usize {
        let per_row = size_of::<f64>() * rows(config, scenario);
        let distances = if config.reward.is_individual() { 3 } else { 0 };
        World::<D>::bytes(scenario) + per_row * (1 + distances)
    }

    /// Writes the observation: one row for the flock, or one per agent.
    ///
    /// # Errors
    /// [`crate::Error::Interrupted`] if `progress` was cancelled.
    pub fn observe(&self, out: &mut [f32], progress: &Progress) -> Result<()> {
        self.scene().observe(self.config.view, out, progress)
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
        Scene {
            world: &self.world,
            summary: &self.summary,
            objective: self.config.objective,
            minimum: self.objective().minimum,
            ranges: &self.ranges,
            max_range: self.config.max_range,
            sensing_range: self.config.predator_sensing_range,
            extras: self.config.extras(),
            step: self.step,
        }
    }

    /// Returns the team reward of the last action; 0 for individual rewards.
    pub(crate) fn team_reward(&self) -> f64 {
        self.team_reward
    }

    /// Returns whether the episode has reached its horizon or all agents were caught.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.step >= self.world.config().num_steps || self.world.agents().len() == 0
    }

    /// Returns the number of model steps so far.
    #[must_use]
    pub fn step_count(&self) -> usize {
        self.step
    }

    /// Returns the flock.
    #[must_use]
    pub fn world(&self) -> &World<D> {
        &self.world
    }

    /// Returns the options.
    #[must_use]
    pub fn config(&self) -> &EpisodeConfig {
        &self.config
    }

    /// Returns the value of the objective.
    #[must_use]
    pub fn objective(&self) -> Running {
        self.objectives[self.config.objective as usize]
    }

    /// Returns the norm of the mean heading, in [0, 1].
    #[must_use]
    pub fn polarization(&self) -> f64 {
        self.scene().summary().polarization
    }

    /// Returns the ranges in m of the last action: one entry, or one per agent.
    #[must_use]
    pub fn ranges(&self) -> &[f64] {
        &self.ranges
    }

    /// Returns the number of weakly connected components under the ranges of the last action.
    #[must_use]
    pub fn num_components(&self) -> usize {
        self.world
            .num_components(as_ranges(&self.config, &self.ranges))
    }
}

/// Returns the number of ranges and observation rows per flock: 1, or the number of agents.
pub(crate) fn rows(config: &EpisodeConfig, scenario: &FlockConfig) -> usize {
    match config.view {
        View::Flock => 1,
        View::Agent => scenario.num_agents,
    }
}

fn as_ranges<'a>(config: &EpisodeConfig, ranges: &'a [f64]) -> Ranges<'a> {
    match config.view {
        View::Flock => Ranges::Shared(ranges[0]),
        View::Agent => Ranges::PerAgent(ranges),
    }
}
