//! Many flocks stepped together. Results depend neither on the threads nor on the place in the batch.

use std::sync::Arc;

use rayon::ThreadPool;
use rayon::prelude::*;

use crate::config::{EpisodeConfig, FlockConfig};
use crate::episode::{Episode, rows};
use crate::error::{Error, Result};
use crate::flock::InitialState;
use crate::flock::check_ranges;
use crate::observation;
use crate::threads;

/// A batch of episodes of one scenario, a slot per flock.
#[derive(Debug, Clone)]
pub struct Batch<const D: usize> {
    scenario: Arc<FlockConfig>,
    config: Arc<EpisodeConfig>,
    slots: Vec<Option<Episode<D>>>,
    num_threads: Option<usize>,
    row_length: usize,
}

/// Metrics of one slot, as the environments' `info` reports them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metrics {
    /// Mean distance to the predator now, in m.
    pub mean_distance: f64,
    /// Minimum distance to the predator now, in m.
    pub min_distance: f64,
    /// Smallest mean distance so far, in m.
    pub min_mean_distance: f64,
    /// Smallest minimum distance so far, in m.
    pub min_min_distance: f64,
    /// Connected components under the ranges of the last action.
    pub num_components: usize,
    /// Norm of the mean heading.
    pub polarization: f64,
}

impl<const D: usize> Batch<D> {
    /// A batch of `num_flocks` empty slots for a scenario of dimension D.
    ///
    /// # Errors
    /// [`Error::Config`] if the scenario has no predator; [`Error::Argument`] if `num_flocks` is 0 or
    /// `num_threads` out of bounds.
    pub fn new(
        scenario: FlockConfig,
        config: EpisodeConfig,
        num_flocks: usize,
        num_threads: Option<usize>,
    ) -> Result<Self> {
        if scenario.predators.is_empty() {
            let why = "at least one predator: an environment pays for the distance to it";
            return Err(Error::config("predators", why, "none"));
        }
        if num_flocks == 0 {
            return Err(Error::argument("num_flocks", "an integer of at least 1", 0));
        }
        threads::pool(num_threads)?;
        Ok(Self {
            row_length: observation::entries(config.view, scenario.dimension).len(),
            scenario: Arc::new(scenario),
            config: Arc::new(config),
            slots: (0..num_flocks).map(|_| None).collect(),
            num_threads,
        })
    }

    /// Number of slots.
    #[must_use]
    pub fn num_flocks(&self) -> usize {
        self.slots.len()
    }

    /// Ranges and observation rows per flock: 1, or one per agent.
    #[must_use]
    pub fn rows(&self) -> usize {
        rows(&self.config, &self.scenario)
    }

    /// Entries per observation row.
    #[must_use]
    pub fn row_length(&self) -> usize {
        self.row_length
    }

    /// Starts a new episode in `slot`.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such slot or `start` does not fit the scenario.
    pub fn reset(&mut self, slot: usize, start: &InitialState) -> Result<()> {
        start.check(&self.scenario)?;
        let slots = self.slots.len();
        let place = self
            .slots
            .get_mut(slot)
            .ok_or_else(|| Error::argument("slot", format!("an integer below {slots}"), slot))?;
        *place = Some(Episode::new(
            self.scenario.clone(),
            self.config.clone(),
            start,
        ));
        Ok(())
    }

    /// The episode in `slot`.
    ///
    /// # Errors
    /// [`Error::Episode`] if the slot does not exist or was never reset.
    pub fn episode(&self, slot: usize) -> Result<&Episode<D>> {
        self.slots
            .get(slot)
            .and_then(Option::as_ref)
            .ok_or_else(|| never_reset(slot))
    }

    /// Holds `ranges` in m (flock after flock, `rows()` entries each) for one action in every slot, and
    /// writes rewards (as many) and observations (`row_length()` entries for each).
    ///
    /// # Errors
    /// [`Error::Episode`] if a slot was never reset or has reached its horizon; [`Error::Argument`] for a
    /// range that is negative or not finite or an array of the wrong length. Nothing has changed then.
    pub fn step(
        &mut self,
        ranges: &[f64],
        rewards: &mut [f64],
        observations: &mut [f32],
    ) -> Result<()> {
        self.check_step(ranges, rewards.len(), observations.len())?;
        let rows = self.rows();
        let size = rows * self.row_length;
        match self.pool()? {
            Some(pool) => pool.install(|| {
                self.slots
                    .par_iter_mut()
                    .zip(ranges.par_chunks_exact(rows))
                    .zip(rewards.par_chunks_exact_mut(rows))
                    .zip(observations.par_chunks_exact_mut(size))
                    .for_each(|(((slot, ranges), rewards), out)| {
                        advance(slot, ranges, rewards, out)
                    });
            }),
            None => self
                .slots
                .iter_mut()
                .zip(ranges.chunks_exact(rows))
                .zip(rewards.chunks_exact_mut(rows))
                .zip(observations.chunks_exact_mut(size))
                .for_each(|(((slot, ranges), rewards), out)| advance(slot, ranges, rewards, out)),
        }
        Ok(())
    }

    /// Writes the observation of `slot`.
    ///
    /// # Errors
    /// [`Error::Episode`] if the slot was never reset; [`Error::Argument`] for an array of the wrong length.
    pub fn observe(&self, slot: usize, observation: &mut [f32]) -> Result<()> {
        let episode = self.episode(slot)?;
        check_length(
            "observation",
            observation.len(),
            self.rows() * self.row_length,
        )?;
        episode.observe(observation);
        Ok(())
    }

    /// Metrics of every slot.
    ///
    /// # Errors
    /// [`Error::Episode`] if a slot was never reset.
    pub fn metrics(&self) -> Result<Vec<Metrics>> {
        let slots: Vec<_> = (0..self.num_flocks())
            .map(|slot| self.episode(slot))
            .collect::<Result<_>>()?;
        Ok(match self.pool()? {
            Some(pool) => pool.install(|| slots.par_iter().map(|e| metrics(e)).collect()),
            None => slots.iter().map(|e| metrics(e)).collect(),
        })
    }

    /// The pool to spread over; `None` where one flock or one thread leaves nothing to spread.
    fn pool(&self) -> Result<Option<&'static ThreadPool>> {
        if self.num_flocks() == 1 || self.num_threads == Some(1) {
            return Ok(None);
        }
        threads::pool(self.num_threads).map(Some)
    }

    fn check_step(&self, ranges: &[f64], rewards: usize, observations: usize) -> Result<()> {
        let rows = self.num_flocks() * self.rows();
        check_length("interaction_range", ranges.len(), rows)?;
        check_length("rewards", rewards, rows)?;
        check_length("observations", observations, rows * self.row_length)?;
        for slot in 0..self.num_flocks() {
            if self.episode(slot)?.has_ended() {
                return Err(Error::episode(
                    "step",
                    format!("a reset: the episode in slot {slot} has reached its horizon"),
                    "a step",
                ));
            }
        }
        check_ranges("interaction_range", ranges)
    }
}

fn advance<const D: usize>(
    slot: &mut Option<Episode<D>>,
    ranges: &[f64],
    rewards: &mut [f64],
    observation: &mut [f32],
) {
    if let Some(episode) = slot {
        episode.advance(ranges, rewards);
        episode.observe(observation);
    }
}

fn never_reset(slot: usize) -> Error {
    Error::episode(
        "step",
        "a reset before anything else",
        format!("slot {slot} without an episode"),
    )
}

fn check_length(field: &str, given: usize, expected: usize) -> Result<()> {
    if given == expected {
        Ok(())
    } else {
        Err(Error::argument(field, format!("{expected} entries"), given))
    }
}

fn metrics<const D: usize>(episode: &Episode<D>) -> Metrics {
    Metrics {
        mean_distance: episode.mean_distance().now,
        min_distance: episode.min_distance().now,
        min_mean_distance: episode.mean_distance().minimum,
        min_min_distance: episode.min_distance().minimum,
        num_components: episode.num_components(),
        polarization: episode.world().polarization(),
    }
}
