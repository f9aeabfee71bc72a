//! Many flocks stepped together. Results depend neither on the threads nor on the place in the batch.

mod reset;
mod state;
#[cfg(test)]
mod tests;

use std::sync::Arc;

pub use reset::Reset;

use super::options::EpisodeConfig;
use super::slot::Slot;
use super::{Episode, Metrics, rows};
use crate::agents;
use crate::base::entry::Entry;
use crate::base::error::{Error, Result};
use crate::base::rng::episode_seed;
use crate::flock::{FlockConfig, InitialState, check_predator_actions, check_ranges};
use crate::observation;
use crate::parallel::{self, Pool, Progress, dispatch};
use crate::reward::Term;
use crate::snapshot::Fingerprint;

/// What a step does with a slot whose episode has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AtEnd {
    /// It is an error.
    Refuse,
    /// The slot starts its next episode instead of a step, and earns nothing.
    Restart,
    /// The slot stays unchanged, and earns nothing.
    Stay,
}

/// A batch of episodes of one scenario, a slot per flock.
///
/// ```
/// use flockesc_core::{Batch, EpisodeConfig, FlockConfig, InitialState};
///
/// let scenario = FlockConfig { num_agents: 20, num_steps: 30, ..FlockConfig::default() };
/// let mut batch = Batch::<2>::new(scenario, EpisodeConfig::default(), 1, None)?;
/// batch.reset(0, &InitialState::seeded(7))?;
/// let (mut reward, mut seen, mut total) = ([0.0], vec![0.0; batch.row_length()], 0.0);
/// while !batch.episode(0)?.has_ended() {
///     batch.step(&[10.0], &mut reward, &mut seen)?;
///     total += reward[0];
/// }
/// let objective = batch.episode(0)?.objective();
/// assert!((total - (objective.minimum - objective.start)).abs() < 1e-9);
/// # Ok::<(), flockesc_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Batch<const D: usize> {
    pub(super) scenario: Arc<FlockConfig>,
    pub(super) config: Arc<EpisodeConfig>,
    slots: Vec<Slot<D>>,
    num_threads: Option<usize>,
    row_length: usize,
    fingerprint: Fingerprint,
    /// Agents that a step of one flock visits.
    work_each: usize,
}

impl<const D: usize> Batch<D> {
    /// A batch of `num_flocks` empty slots for a scenario of dimension D.
    ///
    /// # Errors
    /// [`Error::Config`] if the scenario or `config` is out of bounds, or has no predator or another dimension;
    /// [`Error::Argument`] if `num_flocks` is 0 or
    /// `num_threads` out of bounds.
    pub fn new(
        scenario: FlockConfig,
        config: EpisodeConfig,
        num_flocks: usize,
        num_threads: Option<usize>,
    ) -> Result<Self> {
        scenario.check()?;
        config.check()?;
        if scenario.dimension != D {
            return Err(Error::config(
                "dimension",
                D.to_string(),
                scenario.dimension,
            ));
        }
        if scenario.predators.is_empty() {
            let why = "at least one predator: an environment rewards the distance to it";
            return Err(Error::config("predators", why, "none"));
        }
        if num_flocks == 0 {
            return Err(Error::argument("num_flocks", "an integer of at least 1", 0));
        }
        if num_flocks > 1 || num_threads.is_some() {
            parallel::pool(num_threads)?; // refused now rather than in the first step
        }
        Ok(Self {
            fingerprint: Fingerprint::of(&(&scenario, &config)),
            row_length: observation::entries(config.view, scenario.dimension).len(),
            work_each: work_each(&scenario, &config),
            scenario: Arc::new(scenario),
            config: Arc::new(config),
            slots: (0..num_flocks as u64).map(Slot::new).collect(),
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

    /// The entries of an observation row.
    #[must_use]
    pub fn entries(&self) -> Vec<Entry> {
        observation::entries(self.config.view, D)
    }

    /// D.
    #[must_use]
    pub fn dimension(&self) -> usize {
        D
    }

    /// Learned predators per flock.
    #[must_use]
    pub fn num_learned(&self) -> usize {
        self.scenario.num_learned()
    }

    /// Restarts the schedules of all slots, slot i from [`episode_seed`]`(seed, i + 1)`, without touching what
    /// runs. Before that slot i plays the schedule of seed i.
    pub fn seed(&mut self, seed: u64) {
        for (index, slot) in (1..).zip(&mut self.slots) {
            slot.seed(episode_seed(seed, index));
        }
    }

    /// The same batch before its first reset.
    #[must_use]
    pub fn without_episodes(&self) -> Self {
        Self {
            scenario: self.scenario.clone(),
            config: self.config.clone(),
            slots: self.slots.iter().map(Slot::without_episode).collect(),
            ..*self
        }
    }

    /// Steps of the model during which an action holds.
    #[must_use]
    pub fn steps_per_action(&self) -> usize {
        self.config.steps_per_action.min(self.scenario.num_steps)
    }

    /// About how many agents a step visits, which tells a long one from a short one.
    #[must_use]
    pub fn work(&self) -> usize {
        self.num_flocks().saturating_mul(self.work_each)
    }

    /// The episode in `slot`.
    ///
    /// # Errors
    /// [`Error::Episode`] if the slot does not exist or was never reset.
    pub fn episode(&self, slot: usize) -> Result<&Episode<D>> {
        self.slots
            .get(slot)
            .and_then(Slot::episode)
            .ok_or_else(|| never_reset(slot))
    }

    /// Seed of the episode in `slot`.
    ///
    /// # Errors
    /// As [`Self::episode`].
    pub fn episode_seed(&self, slot: usize) -> Result<u64> {
        self.episode(slot)?;
        Ok(self.slots[slot].episode_seed())
    }

    /// Holds `ranges` in m (flock after flock, `rows()` entries each) for one action in every slot, and
    /// writes rewards (as many) and observations (`row_length()` entries for each). Learned predators fly straight on.
    ///
    /// # Errors
    /// [`Error::Episode`] if a slot was never reset or its episode has ended; [`Error::Argument`] for a
    /// range that is negative or not finite or an array of the wrong length. Nothing has changed then.
    pub fn step(
        &mut self,
        ranges: &[f64],
        rewards: &mut [f64],
        observations: &mut [f32],
    ) -> Result<()> {
        let progress = Progress::default();
        let action = (ranges, &[][..]);
        self.step_measured(
            action,
            AtEnd::Refuse,
            rewards,
            observations,
            &progress,
            |_| (),
        )
        .map(drop)
    }

    /// As [`Self::step`], and returns what `measure` finds in every slot after it, in the same pass over the
    /// threads. `controls` steer the learned predators (flock after flock, D entries in [-1, 1] for each), unless
    /// empty.
    ///
    /// # Errors
    /// As [`Self::step`]; [`Error::Interrupted`] if `progress` was cancelled, and all episodes are then unusable until a reset.
    #[doc(hidden)]
    pub fn step_measured<T: Send>(
        &mut self,
        (ranges, controls): (&[f64], &[f64]),
        at_end: AtEnd,
        rewards: &mut [f64],
        observations: &mut [f32],
        progress: &Progress,
        measure: impl Fn(&Episode<D>) -> T + Send + Sync,
    ) -> Result<Vec<T>> {
        self.check_step(ranges, at_end, rewards.len(), observations.len())?;
        let steered = self.num_flocks() * self.num_learned() * self.scenario.dimension;
        check_predator_actions(controls, steered)?;
        let controls_each = controls.len() / self.num_flocks();
        let rows = self.rows();
        let size = rows * self.row_length;
        let pool = self.pool(self.num_flocks())?;
        let (scenario, config) = (&self.scenario, &self.config);
        let work = self
            .slots
            .iter_mut()
            .enumerate()
            .zip(ranges.chunks_exact(rows))
            .zip(rewards.chunks_exact_mut(rows))
            .zip(observations.chunks_exact_mut(size));
        let measured = dispatch(pool, work, |((((index, slot), ranges), rewards), out)| {
            let controls = &controls[index * controls_each..(index + 1) * controls_each];
            let is_over = !slot.advance(ranges, controls, rewards, progress)?;
            if is_over && at_end == AtEnd::Restart {
                slot.start(scenario, config, &InitialState::default());
            }
            Ok(slot.episode().map(|episode| {
                episode.observe(out);
                measure(episode)
            }))
        });
        let measured: Result<Vec<Option<T>>> = measured.into_iter().collect();
        Ok(measured?.into_iter().flatten().collect())
    }

    /// What the team of every slot earned in the last step: its reward or, where rewards differ between agents, their
    /// mean over all agents, caught ones included. 0 for a slot that has made no step since its reset.
    #[must_use]
    pub fn team_rewards(&self) -> Vec<f64> {
        self.slots.iter().map(Slot::team_reward).collect()
    }

    /// What the predators of every slot earned in the last step: the opposite of [`Self::team_rewards`].
    #[must_use]
    pub fn predator_rewards(&self) -> Vec<f64> {
        let team_rewards = self.slots.iter().map(Slot::team_reward);
        team_rewards.map(|reward| 0.0 - reward).collect()
    }

    /// Writes the observations of `slots`, one after the other.
    ///
    /// # Errors
    /// [`Error::Episode`] if a slot was never reset; [`Error::Argument`] for an array of the wrong length.
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

    /// Writes what the learned predators of `slots` see, a row for each, one slot after the other.
    ///
    /// # Errors
    /// As [`Self::observe`].
    pub fn observe_predators(&self, slots: &[usize], observations: &mut [f32]) -> Result<()> {
        let entries = observation::predator_entries(self.scenario.dimension).len();
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

    /// Metrics of every slot.
    ///
    /// # Errors
    /// [`Error::Episode`] if a slot was never reset.
    pub fn metrics(&self) -> Result<Vec<Metrics>> {
        self.map(Metrics::of)
    }

    /// Connected components of every slot under the ranges of its last action.
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

    /// The threads to spread `flocks` over; none where one small flock or one thread leaves nothing to spread.
    pub(super) fn pool(&self, flocks: usize) -> Result<Pool> {
        let is_large = agents::is_large(self.scenario.num_agents);
        if self.num_threads == Some(1) || (flocks <= 1 && !is_large) {
            return Ok(Pool::None);
        }
        let pool = parallel::pool(self.num_threads)?;
        Ok(if is_large {
            Pool::Within(pool)
        } else {
            Pool::Beside(pool)
        })
    }

    fn check_step(
        &self,
        ranges: &[f64],
        at_end: AtEnd,
        rewards: usize,
        observations: usize,
    ) -> Result<()> {
        let rows = self.num_flocks() * self.rows();
        check_length("interaction_range", ranges.len(), rows)?;
        check_length("rewards", rewards, rows)?;
        check_length("observations", observations, rows * self.row_length)?;
        for slot in 0..self.num_flocks() {
            let Some(episode) = self.slots[slot].episode() else {
                let message = format!("step() called before reset(): flock {slot} has no episode");
                return Err(Error::episode(message));
            };
            if episode.has_ended() && at_end == AtEnd::Refuse {
                let message =
                    format!("step() called after the end of flock {slot}'s episode; call reset()");
                return Err(Error::episode(message));
            }
        }
        check_ranges("interaction_range", ranges)
    }
}

fn work_each(scenario: &FlockConfig, config: &EpisodeConfig) -> usize {
    let n = scenario.num_agents;
    let visits = match config.reward.term::<2>() {
        Term::Team(_) | Term::Individual(_) => scenario.neighbor_options().visits_per_agent(n),
        Term::Counterfactual(_) => n,
    };
    let steps = config.steps_per_action.min(scenario.num_steps);
    n.saturating_mul(visits).saturating_mul(steps)
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
        Err(Error::argument(field, format!("{expected} entries"), given))
    }
}
