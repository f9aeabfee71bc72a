//! A slot of a batch: one episode, and the schedule of seeds of the next episodes.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::options::EpisodeConfig;
use super::{Episode, EpisodeState, rows};
use crate::base::error::Result;
use crate::base::rng::episode_seed;
use crate::flock::{FlockConfig, InitialState};
use crate::parallel::Progress;
use crate::reward::exact_sum;
use crate::snapshot::Fingerprint;

/// A slot of a batch.
#[derive(Debug, Clone)]
pub(crate) struct Slot<const D: usize> {
    scenario: Arc<FlockConfig>,
    /// Fingerprint of the scenario and of the batch's options.
    fingerprint: Fingerprint,
    /// First seed of the schedule (see [`episode_seed`]).
    seed: u64,
    /// Number of the next episode in the schedule.
    next: u64,
    /// Seed of the current episode.
    episode_seed: u64,
    episode: Option<Episode<D>>,
    /// Rewards of the last step: the team's, or one per agent. Empty before the first step of an episode.
    last_rewards: Vec<f64>,
}

/// The serialized form of a slot.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct SlotState<const D: usize> {
    seed: u64,
    next: u64,
    episode_seed: u64,
    episode: Option<EpisodeState<D>>,
}

impl<const D: usize> Slot<D> {
    pub(crate) fn new(seed: u64, scenario: Arc<FlockConfig>, fingerprint: Fingerprint) -> Self {
        Self {
            scenario,
            fingerprint,
            seed,
            next: 0,
            episode_seed: seed,
            episode: None,
            last_rewards: Vec::new(),
        }
    }

    /// Returns the memory in bytes of a slot with an episode.
    pub(crate) fn bytes(scenario: &FlockConfig, config: &EpisodeConfig) -> usize {
        let rewards = size_of::<f64>() * rows(config, scenario).max(4);
        // One in the batch, and one in the map of a reset, which is up to half empty.
        3 * size_of::<Self>() + Episode::<D>::bytes(scenario, config) + rewards
    }

    pub(crate) fn save(&self) -> SlotState<D> {
        SlotState {
            seed: self.seed,
            next: self.next,
            episode_seed: self.episode_seed,
            episode: self.episode.as_ref().map(Episode::save),
        }
    }

    /// Returns the slot of a snapshot with the same scenario.
    pub(crate) fn restored(
        &self,
        state: SlotState<D>,
        config: &Arc<EpisodeConfig>,
    ) -> Result<Self> {
        let seed = state.episode_seed;
        let episode = state.episode;
        Ok(Self {
            seed: state.seed,
            next: state.next,
            episode_seed: seed,
            episode: episode
                .map(|episode| Episode::restore(episode, &self.scenario, config, seed))
                .transpose()?,
            ..self.without_episode()
        })
    }

    /// Returns a copy of the slot without its episode.
    pub(crate) fn without_episode(&self) -> Self {
        Self {
            scenario: self.scenario.clone(),
            episode: None,
            last_rewards: Vec::new(),
            ..*self
        }
    }

    /// Restarts the schedule from `seed`. The current episode continues.
    pub(crate) fn seed(&mut self, seed: u64) {
        (self.seed, self.next) = (seed, 0);
    }

    /// Sets the number of the next episode in the schedule.
    pub(crate) fn set_next_episode(&mut self, episode: u64) {
        self.next = episode;
    }

    /// Starts the next episode of the schedule. `start` must pass [`InitialState::check`]; its seed is
    /// ignored.
    pub(crate) fn start(&mut self, config: &Arc<EpisodeConfig>, start: &InitialState) {
        self.episode_seed = episode_seed(self.seed, self.next);
        let start = InitialState {
            seed: self.episode_seed,
            ..start.clone()
        };
        self.next = self.next.wrapping_add(1);
        self.last_rewards.clear();
        let scenario = self.scenario.clone();
        self.episode = Some(Episode::new(scenario, config.clone(), &start));
    }

    /// Returns the scenario of the episodes, before random fields are drawn.
    pub(crate) fn scenario(&self) -> &Arc<FlockConfig> {
        &self.scenario
    }

    /// Returns the fingerprint of the scenario and of the batch's options.
    pub(crate) fn fingerprint(&self) -> Fingerprint {
        self.fingerprint
    }

    /// Returns the seed of the current episode.
    pub(crate) fn episode_seed(&self) -> u64 {
        self.episode_seed
    }

    pub(crate) fn episode(&self) -> Option<&Episode<D>> {
        self.episode.as_ref()
    }

    /// Returns the team's reward of the last step, or the mean of individual rewards over all agents. It is 0
    /// if the slot was not stepped since its reset.
    pub(crate) fn team_reward(&self) -> f64 {
        exact_sum(&self.last_rewards) / self.last_rewards.len().max(1) as f64
    }

    /// Advances the episode and returns `true`. If the episode has ended, sets the rewards to 0 and returns
    /// `false`.
    ///
    /// # Errors
    /// As [`Episode::advance`].
    pub(crate) fn advance(
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
