//! A slot of a batch: one episode, and the schedule of seeds of the next episodes.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::options::EpisodeConfig;
use super::{Episode, EpisodeState};
use crate::base::error::Result;
use crate::base::exact::exact_sum;
use crate::base::rng::episode_seed;
use crate::flock::{FlockConfig, InitialState};
use crate::parallel::Progress;
use crate::snapshot::Fingerprint;

/// A slot of a batch.
#[derive(Debug, Clone)]
pub(super) struct Slot<const D: usize> {
    /// The scenario of the episodes, before random fields are drawn.
    pub(super) scenario: Arc<FlockConfig>,
    /// Fingerprint of the scenario and of the batch's options.
    pub(super) fingerprint: Fingerprint,
    pub(super) schedule: Schedule,
    pub(super) episode: Option<Episode<D>>,
    /// The scenario that [`Self::draw_next`] has drawn, with the seed of its episode.
    drawn: Option<(u64, Arc<FlockConfig>)>,
    /// Rewards of the last step: the team's, or one per agent. Empty before the first step of an episode.
    last_rewards: Vec<f64>,
}

/// The seeds of a slot's episodes (see [`episode_seed`]).
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Schedule {
    first_seed: u64,
    /// Number of the next episode.
    pub(super) next: u64,
    /// Seed of the current episode.
    pub(super) seed: u64,
}

impl Schedule {
    /// Returns the seed of the next episode.
    fn next_seed(&self) -> u64 {
        episode_seed(self.first_seed, self.next)
    }

    /// Restarts from `seed`. The current episode continues.
    pub(super) fn restart(&mut self, seed: u64) {
        (self.first_seed, self.next) = (seed, 0);
    }
}

/// The serialized form of a slot.
pub(super) type SlotState<const D: usize> = (Schedule, Option<EpisodeState<D>>);

impl<const D: usize> Slot<D> {
    pub(super) fn new(seed: u64, scenario: Arc<FlockConfig>, fingerprint: Fingerprint) -> Self {
        Self {
            scenario,
            fingerprint,
            schedule: Schedule {
                first_seed: seed,
                next: 0,
                seed,
            },
            episode: None,
            drawn: None,
            last_rewards: Vec::new(),
        }
    }

    pub(super) fn save(&self) -> SlotState<D> {
        (self.schedule, self.episode.as_ref().map(Episode::save))
    }

    /// Returns the slot of a snapshot with the same scenario.
    ///
    /// # Errors
    /// As [`FlockConfig::drawn`].
    pub(super) fn restored(
        &self,
        (schedule, episode): SlotState<D>,
        config: &Arc<EpisodeConfig>,
    ) -> Result<Self> {
        let seed = schedule.seed;
        let restore = |state| {
            let scenario = self.scenario.drawn(seed)?;
            Ok(Episode::restore(state, scenario, config, seed))
        };
        Ok(Self {
            schedule,
            episode: episode.map(restore).transpose()?,
            ..self.without_episode()
        })
    }

    /// Returns a copy of the slot without its episode.
    pub(super) fn without_episode(&self) -> Self {
        Self {
            scenario: self.scenario.clone(),
            drawn: self.drawn.clone(),
            episode: None,
            last_rewards: Vec::new(),
            ..*self
        }
    }

    /// Draws the scenario of the next episode of the schedule, unless it was drawn before, and returns it.
    ///
    /// # Errors
    /// As [`FlockConfig::drawn`].
    pub(super) fn draw_next(&mut self) -> Result<Arc<FlockConfig>> {
        let seed = self.schedule.next_seed();
        let known = self.drawn.take().filter(|(drawn, _)| *drawn == seed);
        let scenario = known.map_or_else(|| self.scenario.drawn(seed), |(_, known)| Ok(known))?;
        self.drawn = Some((seed, scenario.clone()));
        Ok(scenario)
    }

    /// Starts the next episode of the schedule. `start` must pass [`InitialState::check`]; its seed is ignored.
    ///
    /// # Errors
    /// As [`Self::draw_next`].
    pub(super) fn start(
        &mut self,
        config: &Arc<EpisodeConfig>,
        start: &InitialState,
    ) -> Result<()> {
        let scenario = self.draw_next()?;
        self.drawn = None;
        let schedule = &mut self.schedule;
        schedule.seed = schedule.next_seed();
        schedule.next = schedule.next.wrapping_add(1);
        let start = InitialState {
            seed: schedule.seed,
            ..start.clone()
        };
        self.last_rewards.clear();
        self.episode = Some(Episode::new(scenario, config.clone(), &start));
        Ok(())
    }

    /// Returns the team's reward of the last step, or the mean of individual rewards over all agents. It is 0
    /// if the slot was not stepped since its reset.
    pub(super) fn team_reward(&self) -> f64 {
        exact_sum(&self.last_rewards) / self.last_rewards.len().max(1) as f64
    }

    /// Advances the episode and returns `true`. If the episode has ended, sets the rewards to 0 and returns
    /// `false`.
    ///
    /// # Errors
    /// As [`Episode::advance`].
    pub(super) fn advance(
        &mut self,
        ranges: &[f64],
        predator_actions: &[f64],
        rewards: &mut [f64],
        progress: &Progress,
    ) -> Result<bool> {
        self.last_rewards.clear();
        match &mut self.episode {
            Some(episode) if !episode.has_ended() => {
                episode.advance(ranges, predator_actions, rewards, progress)?;
                if episode.config().reward.is_individual() {
                    self.last_rewards.extend_from_slice(rewards);
                } else {
                    self.last_rewards.push(episode.team_reward());
                }
                Ok(true)
            }
            _ => {
                rewards.fill(0.0);
                Ok(false)
            }
        }
    }
}
