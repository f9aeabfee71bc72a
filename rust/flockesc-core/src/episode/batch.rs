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
///
/// ```
/// use flockesc_core::{Batch, EpisodeConfig, FlockConfig, InitialState};
///
/// let scenario = FlockConfig { num_agents: 20, num_steps: 30, ..FlockConfig::default() };
/// let mut batch = Batch::<2>::new(scenario, EpisodeConfig::default(), 1, None)?;
/// batch.reset(0, &InitialState::seeded(7))?;
/// let (mut reward, mut observation) = ([0.0], vec![0.0; batch.row_length()]);
/// let mut total = 0.0;
/// while !batch.episode(0)?.has_ended() {
///     batch.step(&[10.0], &mut reward, &mut observation)?;
///     total += reward[0];
/// }
/// let objective = batch.episode(0)?.objective();
/// assert!((total - (objective.minimum - objective.start)).abs() < 1e-9);
/// # Ok::<(), flockesc_core::Error>(())
/// ```
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

impl<const D: usize> Batch<D> {
    /// Returns the number of slots.
    #[must_use]
    pub fn num_flocks(&self) -> usize {
        self.slots.len()
    }

    /// Returns the number of ranges and observation rows per flock: 1, or the number of agents.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.config.view.rows(self.scenario())
    }

    /// Returns the number of entries of an observation row.
    #[must_use]
    pub fn row_length(&self) -> usize {
        self.row_length
    }

    /// Returns the entries of an observation row.
    #[must_use]
    pub fn entries(&self) -> Vec<Entry> {
        self.config.entries(D)
    }

    /// Returns the dimension D.
    #[must_use]
    pub fn dimension(&self) -> usize {
        D
    }

    /// Returns the number of learned predators per flock.
    #[must_use]
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
    #[must_use]
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
    #[must_use]
    pub fn work(&self) -> usize {
        self.work
    }

    /// Returns the episode in `slot`.
    ///
    /// # Errors
    /// [`Error::Episode`] if the slot does not exist or was never reset.
    pub fn episode(&self, slot: usize) -> Result<&Episode<D>> {
        self.slots
            .get(slot)
            .and_then(|slot| slot.episode.as_ref())
            .ok_or_else(|| never_reset(slot))
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
    #[must_use]
    pub fn team_rewards(&self) -> Vec<f64> {
        self.slots.iter().map(|slot| slot.team_reward()).collect()
    }

    /// Estimates the number of agents that the observations of `slots` slots visit, as [`Self::work`] does.
    #[must_use]
    pub fn work_of_observations(&self, slots: usize) -> usize {
        slots.saturating_mul(self.observation_work)
    }

    /// Writes the observations of `slots`, slot after slot.
    ///
    /// # Errors
    /// [`Error::Episode`] if a slot was never reset; [`Error::Input`] if `observations` has the
    /// wrong length; [`Error::Interrupted`] if `progress` was cancelled.
    pub fn observe(
        &self,
        slots: &[usize],
        observations: &mut [f32],
        progress: &Progress,
    ) -> Result<()> {
        let size = self.rows() * self.row_length;
        self.write(slots, size, observations, |episode, out| {
            episode.observe(out, progress)
        })
    }

    /// Writes one row per slot: the flock's observation without optional entries. It does not depend on the
    /// view of the batch.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn observe_flock(
        &self,
        slots: &[usize],
        observations: &mut [f32],
        progress: &Progress,
    ) -> Result<()> {
        let size = observation::flock_entries(D).len();
        self.write(slots, size, observations, |episode, out| {
            episode.observe_flock(out, progress)
        })
    }

    /// Writes the observations of the learned predators of `slots`, slot after slot and one row per
    /// predator.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn observe_predators(
        &self,
        slots: &[usize],
        observations: &mut [f32],
        progress: &Progress,
    ) -> Result<()> {
        let size = self.num_learned() * observation::predator_entries(D).len();
        self.write(slots, size, observations, |episode, out| {
            progress.check()?;
            episode.observe_predators(out);
            Ok(())
        })
    }

    /// Calls `write` with the episode of each slot and its `size` entries of `observations`.
    fn write(
        &self,
        slots: &[usize],
        size: usize,
        observations: &mut [f32],
        write: impl Fn(&Episode<D>, &mut [f32]) -> Result<()> + Sync + Send,
    ) -> Result<()> {
        check_length("observations", observations.len(), slots.len() * size)?;
        let episodes = self.episodes(slots)?;
        if size == 0 {
            return Ok(());
        }
        let work = episodes.iter().zip(observations.chunks_exact_mut(size));
        let written = dispatch(self.pool(slots.len())?, work, |(episode, out)| {
            write(episode, out)
        });
        written.into_iter().collect()
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

fn never_reset(slot: usize) -> Error {
    Error::episode(format!("flock {slot} has no episode; call reset()"))
}

fn check_length(field: &str, given: usize, expected: usize) -> Result<()> {
    if given == expected {
        Ok(())
    } else {
        let (expected, given) = (format!("{expected} entries"), format!("{given} entries"));
        Err(Error::input(field, expected, given))
    }
}
