//! A flock's place in a batch: its episode, and the seeds of those to come.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::options::EpisodeConfig;
use super::{Episode, EpisodeState};
use crate::base::error::Result;
use crate::base::rng::episode_seed;
use crate::flock::{FlockConfig, InitialState};
use crate::parallel::Progress;

#[derive(Debug, Clone)]
pub(crate) struct Slot<const D: usize> {
    /// The seed that the schedule began with ([`episode_seed`]).
    seed: u64,
    /// Number of the next episode in the schedule.
    next: u64,
    /// Seed of the episode.
    playing: u64,
    episode: Option<Episode<D>>,
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
        })
    }

    /// The same place without its episode.
    pub(crate) fn without_episode(&self) -> Self {
        Self {
            episode: None,
            ..*self
        }
    }

    /// Begins the schedule anew; the episode goes on.
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
        self.episode = Some(Episode::new(scenario.clone(), config.clone(), &start));
    }

    /// Seed of the episode.
    pub(crate) fn episode_seed(&self) -> u64 {
        self.playing
    }

    pub(crate) fn episode(&self) -> Option<&Episode<D>> {
        self.episode.as_ref()
    }

    /// Advances the episode, unless it has ended: that pays nothing and gives `false`.
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
                episode.advance(ranges, controls, rewards, progress)?;
                Ok(true)
            }
            _ => {
                rewards.fill(0.0);
                Ok(false)
            }
        }
    }
}
