//! `Batch`: many flocks of one or more scenarios, stepped together on several threads. Results depend
//! neither on the number of threads nor on a flock's slot.

mod create;
mod reset;
mod state;
mod step;
#[cfg(test)]
mod tests;

use std::sync::Arc;

pub use reset::Reset;
pub use step::AtEnd;

use super::options::EpisodeConfig;
use super::slot::Slot;
use super::{Episode, Metrics, rows};
use crate::agents;
use crate::base::entry::Entry;
use crate::base::error::{Error, Result};
use crate::base::rng::episode_seed;
use crate::flock::FlockConfig;
use crate::observation;
use crate::parallel::{self, Pool, dispatch};

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
    slots: Vec<Slot<D>>,
    num_threads: Option<usize>,
    row_length: usize,
    /// Estimated number of agents that a step visits.
    work: usize,
    /// Estimated memory in bytes after a reset and some steps.
    bytes: u128,
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
        rows(&self.config, self.scenario())
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
        self.slots[0].scenario()
    }

    /// Restarts the seed schedules of all slots: slot i from [`episode_seed`]`(seed, i + 1)`.
    /// Running episodes continue. Without this call slot i follows the schedule of seed i.
    pub fn seed(&mut self, seed: u64) {
        for (index, slot) in (1..).zip(&mut self.slots) {
            slot.seed(episode_seed(seed, index));
        }
    }

    /// Returns a copy of the batch without its episodes.
    #[must_use]
    pub fn without_episodes(&self) -> Self {
        Self {
            config: self.config.clone(),
            slots: self.slots.iter().map(Slot::without_episode).collect(),
            ..*self
        }
    }

    /// Returns the largest number of model steps that an action can last.
    #[must_use]
    pub fn steps_per_action(&self) -> usize {
        let num_steps = self.slots.iter().map(|slot| slot.scenario().num_steps);
        self.config
            .steps_per_action
            .min(num_steps.max().unwrap_or(0))
    }

    /// Estimates the number of agents that a step visits, a measure of its run time.
    #[must_use]
    pub fn work(&self) -> usize {
        self.work
    }

    /// Estimates the memory in bytes of the batch after a reset and some steps, with the arrays of an environment. It
    /// does not include frozen neighbor graphs.
    #[must_use]
    pub fn bytes(&self) -> u128 {
        self.bytes
    }

    /// Returns the episode in `slot`.
    ///
    /// # Errors
    /// [`Error::Episode`] if the slot does not exist or was never reset.
    pub fn episode(&self, slot: usize) -> Result<&Episode<D>> {
        self.slots
            .get(slot)
            .and_then(Slot::episode)
            .ok_or_else(|| never_reset(slot))
    }

    /// Returns the seed of the episode in `slot`.
    ///
    /// # Errors
    /// As [`Self::episode`].
    pub fn episode_seed(&self, slot: usize) -> Result<u64> {
        self.episode(slot)?;
        Ok(self.slots[slot].episode_seed())
    }

    /// Returns the team's reward of every slot in the last step. With individual rewards it is
    /// their mean over all agents, caught agents included. It is 0 for a slot that was not stepped
    /// since its reset.
    #[must_use]
    pub fn team_rewards(&self) -> Vec<f64> {
        self.slots.iter().map(Slot::team_reward).collect()
    }

    /// Returns the predators' reward of every slot in the last step: minus the [team's
    /// reward](Self::team_rewards).
    #[must_use]
    pub fn predator_rewards(&self) -> Vec<f64> {
        let team_rewards = self.slots.iter().map(Slot::team_reward);
        team_rewards.map(|reward| 0.0 - reward).collect()
    }

    /// Writes the observations of `slots`, slot after slot.
    ///
    /// # Errors
    /// [`Error::Episode`] if a slot was never reset; [`Error::Argument`] if `observations` has the
    /// wrong length.
    pub fn observe(&self, slots: &[usize], observations: &mut [f32]) -> Result<()> {
        let size = self.rows() * self.row_length;
        check_length("observations", observations.len(), slots.len() * size)?;
        let episodes = self.episodes(slots.iter().copied())?;
        let work = episodes.iter().zip(observations.chunks_exact_mut(size));
        dispatch(self.pool(slots.len())?, work, |(episode, out)| {
            episode.observe(out);
        });
        Ok(())
    }

    /// Writes one row per slot: the flock's observation without optional entries. It does not depend on the
    /// view of the batch.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn observe_flock(&self, slots: &[usize], observations: &mut [f32]) -> Result<()> {
        let size = observation::flock_entries(D).len();
        check_length("observations", observations.len(), slots.len() * size)?;
        let episodes = self.episodes(slots.iter().copied())?;
        let work = episodes.iter().zip(observations.chunks_exact_mut(size));
        dispatch(self.pool(slots.len())?, work, |(episode, out)| {
            episode.observe_flock(out);
        });
        Ok(())
    }

    /// Writes the observations of the learned predators of `slots`, slot after slot and one row per
    /// predator.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn observe_predators(&self, slots: &[usize], observations: &mut [f32]) -> Result<()> {
        let entries = observation::predator_entries(D).len();
        let size = self.num_learned() * entries;
        check_length("observations", observations.len(), slots.len() * size)?;
        let episodes = self.episodes(slots.iter().copied())?;
        if size > 0 {
            let work = episodes.iter().zip(observations.chunks_exact_mut(size));
            dispatch(self.pool(slots.len())?, work, |(episode, out)| {
                episode.observe_predators(out);
            });
        }
        Ok(())
    }

    /// Returns the metrics of every slot.
    ///
    /// # Errors
    /// [`Error::Episode`] if a slot was never reset.
    pub fn metrics(&self) -> Result<Vec<Metrics>> {
        self.map(Metrics::of)
    }

    /// Returns the number of connected components of every slot under the ranges of its last
    /// action.
    ///
    /// # Errors
    /// [`Error::Episode`] if a slot was never reset.
    pub fn num_components(&self) -> Result<Vec<usize>> {
        self.map(Episode::num_components)
    }

    fn map<T: Send>(&self, measure: fn(&Episode<D>) -> T) -> Result<Vec<T>> {
        let episodes = self.episodes(0..self.num_flocks())?;
        let pool = self.pool(episodes.len())?;
        Ok(dispatch(pool, episodes.into_iter(), measure))
    }

    fn episodes(&self, slots: impl Iterator<Item = usize>) -> Result<Vec<&Episode<D>>> {
        slots.map(|slot| self.episode(slot)).collect()
    }

    /// Returns the threads for work on `flocks` flocks. One small flock, or a batch of one thread,
    /// needs no pool.
    pub(super) fn pool(&self, flocks: usize) -> Result<Pool> {
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
    Error::episode(format!(
        "reset() was never called: flock {slot} has no episode"
    ))
}

fn check_length(field: &str, given: usize, expected: usize) -> Result<()> {
    if given == expected {
        Ok(())
    } else {
        let (expected, given) = (format!("{expected} entries"), format!("{given} entries"));
        Err(Error::argument(field, expected, given))
    }
}
