//! `Batch`: many flocks of one or more scenarios, stepped together on several threads. Results depend
//! neither on the number of threads nor on a flock's slot.

mod create;
mod reset;
mod state;
mod step;
#[cfg(test)]
mod tests;

use std::sync::Arc;

pub use reset::SlotReset;
pub use step::AtEnd;
use strum::{EnumString, VariantNames};

use super::Episode;
use super::options::EpisodeConfig;
use super::slot::Slot;
use crate::agents;
use crate::base::check::rounding;
use crate::base::entry::Entry;
use crate::base::error::{Error, Result};
use crate::base::rng::episode_seed;
use crate::flock::FlockConfig;
use crate::observation;
use crate::parallel::{self, Pool, Progress, dispatch};

/// A batch of episodes. Each flock has a slot; all have one scenario, or each its own.
#[derive(Debug, Clone)]
pub struct Batch<const D: usize> {
    pub(super) config: Arc<EpisodeConfig>,
    /// A clone of the batch shares each slot until one of the two changes it.
    slots: Vec<Arc<Slot<D>>>,
    num_threads: Option<usize>,
    row_length: usize,
    /// Estimated number of agents that a step visits.
    work: usize,
    /// Estimated number of agents that the observation of one flock visits.
    observation_work: usize,
}

/// Whose observations to return.
#[derive(Debug, Clone, Copy, EnumString, VariantNames)]
#[strum(serialize_all = "snake_case")]
pub enum Observed {
    /// The rows of the batch's view.
    Own,
    /// One row of the flock, without optional entries.
    Flock,
    /// One row per learned predator.
    Predators,
}

impl<const D: usize> Batch<D> {
    /// Returns the number of slots.
    pub fn num_flocks(&self) -> usize {
        self.slots.len()
    }

    /// Returns the number of ranges and observation rows per flock: 1, or the number of agents.
    pub fn rows(&self) -> usize {
        self.config.view.rows(self.scenario())
    }

    /// Returns the number of entries of an observation row.
    pub fn row_length(&self) -> usize {
        self.row_length
    }

    /// Returns the entries of an observation row.
    pub fn entries(&self) -> Vec<Entry> {
        self.config.entries(D)
    }

    /// Returns the number of learned predators per flock.
    pub fn num_learned(&self) -> usize {
        self.scenario().num_learned()
    }

    /// Returns the scenario of the first slot. All scenarios have the same numbers of agents and of learned
    /// predators.
    pub(super) fn scenario(&self) -> &Arc<FlockConfig> {
        &self.slots[0].scenario
    }

    /// Restarts the seed schedules of all slots: slot i from [`episode_seed`]`(seed, i + 1)`.
    /// Running episodes continue. Without this call slot i follows the schedule of seed i.
    pub fn seed(&mut self, seed: u64) {
        for (index, slot) in (1..).zip(&mut self.slots) {
            Arc::make_mut(slot)
                .schedule
                .restart(episode_seed(seed, index));
        }
    }

    /// Returns a copy of the batch without its episodes.
    pub fn without_episodes(&self) -> Self {
        Self {
            config: self.config.clone(),
            slots: self
                .slots
                .iter()
                .map(|slot| Arc::new(slot.without_episode()))
                .collect(),
            ..*self
        }
    }

    /// Estimates the number of agents that a step visits, a measure of its run time.
    pub fn work(&self) -> usize {
        self.work
    }

    /// Returns the episode in `slot`.
    ///
    /// # Errors
    /// [`Error::Episode`] if the slot does not exist or was never reset.
    pub fn episode(&self, slot: usize) -> Result<&Episode<D>> {
        let found = self
            .slots
            .get(slot)
            .and_then(|found| found.episode.as_ref());
        found.ok_or_else(|| Error::episode(format!("flock {slot} has no episode; call reset()")))
    }

    /// Returns the seed of the episode in `slot`.
    ///
    /// # Errors
    /// As [`Self::episode`].
    pub fn episode_seed(&self, slot: usize) -> Result<u64> {
        self.episode(slot)?;
        Ok(self.slots[slot].schedule.seed)
    }

    /// Returns the team's reward of every slot in the last step. With individual rewards it is
    /// their mean over all agents, caught agents included. It is 0 for a slot that was not stepped
    /// since its reset.
    pub fn team_rewards(&self) -> Vec<f64> {
        self.slots.iter().map(|slot| slot.team_reward()).collect()
    }

    /// Estimates the number of agents that the observations of `slots` slots visit, as [`Self::work`] does.
    pub fn work_of_observations(&self, slots: usize) -> usize {
        slots.saturating_mul(self.observation_work)
    }

    /// Returns the number of rows of a slot and the number of entries of a row.
    pub fn shape_of(&self, observed: Observed) -> [usize; 2] {
        match observed {
            Observed::Own => [self.rows(), self.row_length],
            Observed::Flock => [1, observation::flock_entries(D).len()],
            Observed::Predators => [self.num_learned(), observation::predator_entries(D).len()],
        }
    }

    /// Returns the observations of `slots`, slot after slot.
    ///
    /// # Errors
    /// As [`Self::measure`].
    pub fn observe(
        &self,
        slots: &[usize],
        observed: Observed,
        progress: &Progress,
    ) -> Result<Vec<f32>> {
        let episodes = self.episodes(slots)?;
        let size: usize = self.shape_of(observed).iter().product();
        let mut observations = vec![0.0; slots.len() * size];
        let rows = observations.chunks_exact_mut(size.max(1));
        let written = dispatch(
            self.pool(slots.len())?,
            episodes.iter().zip(rows),
            |(episode, out)| match observed {
                Observed::Own => episode.observe(out, progress),
                Observed::Flock => episode.observe_flock(out, progress),
                Observed::Predators => {
                    episode.observe_predators(out);
                    progress.check()
                }
            },
        );
        written.into_iter().collect::<Result<()>>()?;
        Ok(observations)
    }

    /// Returns `measure(episode)` of each of `slots`.
    ///
    /// # Errors
    /// [`Error::Episode`] if a slot was never reset; [`Error::Interrupted`] if `progress` was cancelled.
    pub fn measure<T: Send>(
        &self,
        slots: &[usize],
        progress: &Progress,
        measure: impl Fn(&Episode<D>) -> T + Sync + Send,
    ) -> Result<Vec<T>> {
        let episodes = self.episodes(slots)?;
        let measured = dispatch(self.pool(slots.len())?, episodes.into_iter(), |episode| {
            progress.check()?;
            Ok(measure(episode))
        });
        measured.into_iter().collect()
    }

    fn episodes(&self, slots: &[usize]) -> Result<Vec<&Episode<D>>> {
        slots.iter().map(|slot| self.episode(*slot)).collect()
    }

    /// Returns the threads for work on `flocks` flocks. One small flock, or a batch of one thread,
    /// needs no pool.
    ///
    /// # Errors
    /// As [`parallel::pool`].
    pub(super) fn pool(&self, flocks: usize) -> Result<Pool> {
        rounding()?;
        let is_large = agents::is_large(self.scenario().num_agents);
        if self.num_threads == Some(1) || (flocks <= 1 && !is_large) {
            return Ok(Pool::None);
        }
        let pool = parallel::pool(self.num_threads)?;
        Ok(if is_large {
            Pool::ThreadsOnly(pool)
        } else {
            Pool::WithCaller(pool)
        })
    }
}
