//! A flock's place in a batch: its episode, and the seeds of later ones.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::options::EpisodeConfig;
use super::{Episode, EpisodeState};
use crate::base::error::Result;
use crate::base::rng::episode_seed;
use crate::flock::{FlockConfig, InitialState};
use crate::parallel::Progress;
use crate::reward::exact_sum;

#[derive(Debug, Clone)]
pub(crate) struct Slot<const D: usize> {
    /// The seed that the schedule began with ([`episode_seed`]).
    seed: u64,
    /// Number of the next episode in the schedule.
    next: u64,
    /// Seed of the episode.
    playing: u64,
    episode: Option<Episode<D>>,
    /// What the last step earned: the team, or every agent; empty where it made no step.
    earned: Vec<f64>,
}

/// A slot as plain data.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct SlotState<const D: usize> {
    seed: u64,
    next: u64,
    playing: u64,
    episode: Option<EpisodeState<D>>,
}

impl<const D: usize> Slot<D> {
    pub(crate) fn new(seed: u64) -> Self {
        Self {
            seed,
            next: 0,
            playing: seed,
            episode: None,
            earned: Vec::new(),
        }
    }

    pub(crate) fn save(&self) -> SlotState<D> {
        SlotState {
            seed: self.seed,
            next: self.next,
            playing: self.playing,
            episode: self.episode.as_ref().map(Episode::save),
        }
    }

    pub(crate) fn restore(
        state: SlotState<D>,
        scenario: &Arc<FlockConfig>,
        config: &Arc<EpisodeConfig>,
    ) -> Result<Self> {
        let playing = state.playing;
        let episode = state.episode;
        Ok(Self {
            seed: state.seed,
            next: state.next,
            playing,
            episode: episode
                .map(|episode| Episode::restore(episode, scenario, config, playing))
                .transpose()?,
            earned: Vec::new(),
        })
    }

    /// The same place without its episode.
    pub(crate) fn without_episode(&self) -> Self {
        Self {
            episode: None,
            earned: Vec::new(),
            ..*self
        }
    }

    /// Restarts the schedule; the episode goes on.
    pub(crate) fn seed(&mut self, seed: u64) {
        (self.seed, self.next) = (seed, 0);
    }

    /// Makes the episode of this number in the schedule the next one.
    pub(crate) fn turn_to(&mut self, episode: u64) {
        self.next = episode;
    }

    /// Starts the next episode of the schedule; `start` has passed [`InitialState::check`], its seed does not
    /// count.
    pub(crate) fn start(
        &mut self,
        scenario: &Arc<FlockConfig>,
        config: &Arc<EpisodeConfig>,
        start: &InitialState,
    ) {
        self.playing = episode_seed(self.seed, self.next);
        let start = InitialState {
            seed: self.playing,
            ..start.clone()
        };
        self.next = self.next.wrapping_add(1);
        self.earned.clear();
        self.episode = Some(Episode::new(scenario.clone(), config.clone(), &start));
    }

    /// Seed of the episode.
    pub(crate) fn episode_seed(&self) -> u64 {
        self.playing
    }

    pub(crate) fn episode(&self) -> Option<&Episode<D>> {
        self.episode.as_ref()
    }

    /// What the team earned in the last step: its reward or, where rewards differ between agents, their mean over all.
    /// 0 if the slot has made no step since its reset.
    pub(crate) fn team_reward(&self) -> f64 {
        exact_sum(&self.earned) / self.earned.len().max(1) as f64
    }

    /// Advances the episode. One that has ended earns nothing, and the result is `false`.
    ///
    /// # Errors
    /// As [`Episode::advance`].
    pub(crate) fn advance(
        &mut self,
        ranges: &[f64],
        controls: &[f64],
        rewards: &mut [f64],
        progress: &Progress,
    ) -> Result<bool> {
        match &mut self.episode {
            Some(episode) if !episode.has_ended() => {
                self.earned.clear();
                episode.advance(ranges, controls, rewards, progress)?;
                if episode.config().reward.is_individual() {
                    self.earned.extend_from_slice(rewards);
                } else {
                    self.earned.push(episode.team_reward());
                }
                Ok(true)
            }
            _ => {
                self.earned.clear();
                rewards.fill(0.0);
                Ok(false)
            }
        }
    }
}
