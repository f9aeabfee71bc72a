//! A flock from its start to the horizon: steps under actions, running minima, rewards, observations.

mod batch;
mod metrics;
mod options;
mod rollout;
mod running;
mod slot;
mod state;

use std::sync::Arc;

pub use batch::{AtEnd, Batch, Reset};
pub use metrics::Metrics;
pub use options::EpisodeConfig;
pub use rollout::EpisodeOutcome;
pub use running::Running;
pub(crate) use state::EpisodeState;

use crate::base::error::Result;
use crate::flock::{FlockConfig, InitialState, Summary, World};
use crate::neighbor::Ranges;
use crate::observation::{Scene, View};
use crate::parallel::Progress;
use crate::reward::{Action, Moment, Objective, Term};

/// A flock in an episode.
#[derive(Debug, Clone)]
pub struct Episode<const D: usize> {
    config: Arc<EpisodeConfig>,
    world: World<D>,
    step: usize,
    /// d_i now and one step ago in m, for individual rewards; otherwise empty.
    agent_distances: Vec<f64>,
    agent_distances_before: Vec<f64>,
    /// The same when the objective's running minimum fell last, or at the start.
    agent_distances_at_minimum: Vec<f64>,
    mean_distance: Running,
    min_distance: Running,
    fraction_surviving: Running,
    summary: Summary<D>,
    /// Ranges of the last action, one or n; 0 before the first.
    ranges: Vec<f64>,
    /// What the team earned by the last action.
    team_reward: f64,
}

impl<const D: usize> Episode<D> {
    /// The episode at t = 0; `start` has passed [`InitialState::check`].
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
            mean_distance: Running::new(world.predator_distance().mean),
            min_distance: Running::new(world.predator_distance().minimum),
            fraction_surviving: Running::new(world.fraction_surviving()),
            summary: Summary::of(&world),
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

    /// Holds `ranges` (one entry, or one per agent) and `controls` (D entries per learned predator; none: they fly
    /// straight on) for `steps_per_action` steps or until the end, and writes the rewards: one entry for the
    /// flock, or one per agent, 0 for agents that were caught before.
    ///
    /// # Errors
    /// [`crate::Error::Interrupted`] if `progress` was cancelled. The episode is then unusable: only part of the action
    /// was held.
    pub fn advance(
        &mut self,
        ranges: &[f64],
        controls: &[f64],
        rewards: &mut [f64],
        progress: &Progress,
    ) -> Result<()> {
        self.hold(ranges, controls, rewards, progress)?;
        self.summarize();
        Ok(())
    }

    /// As [`Self::advance`], without the summary. The flock's and the predators' observations and the polarization need
    /// [`Self::summarize`] then.
    fn hold(
        &mut self,
        ranges: &[f64],
        controls: &[f64],
        rewards: &mut [f64],
        progress: &Progress,
    ) -> Result<()> {
        self.world.set_predator_actions(controls);
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
            self.world.step(as_ranges(&self.config, &self.ranges));
            self.step += 1;
            if self.config.reward.is_individual() {
                std::mem::swap(&mut self.agent_distances_before, &mut self.agent_distances);
                self.world.write_distances(&mut self.agent_distances);
            }
            let distance = self.world.predator_distance();
            self.mean_distance.update(distance.mean);
            self.min_distance.update(distance.minimum);
            self.fraction_surviving
                .update(self.world.fraction_surviving());
            let objective = self.objective();
            let moment = Moment {
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
            self.team_reward += term.add_step(&moment, rewards);
            if objective.minimum < minimum_before {
                self.agent_distances_at_minimum
                    .clone_from(&self.agent_distances);
            }
        }
        if let Some((add, before)) = counterfactual {
            let action = Action {
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

    fn summarize(&mut self) {
        self.summary = Summary::of(&self.world);
    }

    /// Writes the observation: one row for the flock, or one per agent.
    pub fn observe(&self, out: &mut [f32]) {
        self.scene().observe(self.config.view, out);
    }

    /// Writes the observations of the learned predators, one row for each.
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
            step: self.step,
        }
    }

    /// What the team earned by the last action; 0 where the reward differs between agents.
    pub(crate) fn team_reward(&self) -> f64 {
        self.team_reward
    }

    /// Whether the horizon is reached or no agent is left.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.step >= self.world.config().num_steps || self.world.agents().len() == 0
    }

    /// Steps of the model made.
    #[must_use]
    pub fn step_count(&self) -> usize {
        self.step
    }

    /// The flock itself.
    #[must_use]
    pub fn world(&self) -> &World<D> {
        &self.world
    }

    /// The options.
    #[must_use]
    pub fn config(&self) -> &EpisodeConfig {
        &self.config
    }

    /// Mean predator distance.
    #[must_use]
    pub fn mean_distance(&self) -> Running {
        self.mean_distance
    }

    /// Minimum predator distance.
    #[must_use]
    pub fn min_distance(&self) -> Running {
        self.min_distance
    }

    /// Share of the agents that were not caught.
    #[must_use]
    pub fn fraction_surviving(&self) -> Running {
        self.fraction_surviving
    }

    /// The objective's value.
    #[must_use]
    pub fn objective(&self) -> Running {
        match self.config.objective {
            Objective::Mean => self.mean_distance,
            Objective::Minimum => self.min_distance,
            Objective::Survival => self.fraction_surviving,
        }
    }

    /// Norm of the mean heading, in [0, 1].
    #[must_use]
    pub fn polarization(&self) -> f64 {
        self.summary.polarization
    }

    /// Ranges of the last action: one entry, or one per agent.
    #[must_use]
    pub fn ranges(&self) -> &[f64] {
        &self.ranges
    }

    /// Number of (weakly) connected components under the ranges of the last action.
    #[must_use]
    pub fn num_components(&self) -> usize {
        self.world
            .num_components(as_ranges(&self.config, &self.ranges))
    }
}

/// Ranges and observation rows that one flock has: 1, or one per agent.
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
