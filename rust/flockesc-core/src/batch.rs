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
use crate::rng::episode_seed;
use crate::slot::Slot;
use crate::threads;

/// A batch of episodes of one scenario, a slot per flock.
#[derive(Debug, Clone)]
pub struct Batch<const D: usize> {
    scenario: Arc<FlockConfig>,
    config: Arc<EpisodeConfig>,
    slots: Vec<Slot<D>>,
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
        if num_flocks > 1 || num_threads.is_some() {
            threads::pool(num_threads)?; // refused now rather than in the first step
        }
        Ok(Self {
            row_length: observation::entries(config.view, scenario.dimension).len(),
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

    /// Starts the schedules of all slots anew, slot i from [`episode_seed`]`(seed, i + 1)`, without touching what
    /// runs. Before that slot i plays the schedule of seed i.
    pub fn seed(&mut self, seed: u64) {
        for (index, slot) in (1..).zip(&mut self.slots) {
            slot.seed(episode_seed(seed, index));
        }
    }

    /// Starts a new episode in `slot`, and the schedule of its seed.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such slot or `start` does not fit the scenario.
    pub fn reset(&mut self, slot: usize, start: &InitialState) -> Result<()> {
        self.reset_many(&[(slot, Some(start.seed))], start)
    }

    /// Starts new episodes in several slots: with a seed of their own, or with the next one of their schedule.
    /// All take the arrays of `start`, whose seed does not count.
    ///
    /// # Errors
    /// [`Error::Argument`] if there is no such slot or `start` does not fit the scenario. Nothing has changed
    /// then.
    pub fn reset_many(
        &mut self,
        resets: &[(usize, Option<u64>)],
        start: &InitialState,
    ) -> Result<()> {
        start.check(&self.scenario)?;
        let slots = self.slots.len();
        if let Some((slot, _)) = resets.iter().find(|(slot, _)| *slot >= slots) {
            let expected = format!("an integer below {slots}");
            return Err(Error::argument("slot", expected, slot));
        }
        let pool = self.pool(resets.len())?;
        let mut is_reset = vec![false; slots];
        for &(slot, seed) in resets {
            is_reset[slot] = true;
            if let Some(seed) = seed {
                self.slots[slot].seed(seed);
            }
        }
        let (scenario, config) = (&self.scenario, &self.config);
        let work = self.slots.iter_mut().zip(is_reset);
        spread(
            pool,
            work.filter_map(|(slot, is_reset)| is_reset.then_some(slot)),
            |slot| slot.start(scenario, config, start),
        );
        Ok(())
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
        self.step_measured(ranges, false, rewards, observations, |_| ())
            .map(drop)
    }

    /// As [`Self::step`], and returns what `measure` finds in every slot after it, in the same pass over the
    /// threads. With `restart` a slot that has reached its horizon is not refused: it starts its next
    /// episode in place of moving, and is paid nothing.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_measured<T: Send>(
        &mut self,
        ranges: &[f64],
        restart: bool,
        rewards: &mut [f64],
        observations: &mut [f32],
        measure: impl Fn(&Episode<D>) -> T + Send + Sync,
    ) -> Result<Vec<T>> {
        self.check_step(ranges, restart, rewards.len(), observations.len())?;
        let rows = self.rows();
        let size = rows * self.row_length;
        let pool = self.pool(self.num_flocks())?;
        let (scenario, config) = (&self.scenario, &self.config);
        let work = self
            .slots
            .iter_mut()
            .zip(ranges.chunks_exact(rows))
            .zip(rewards.chunks_exact_mut(rows))
            .zip(observations.chunks_exact_mut(size));
        let measured = spread(pool, work, |(((slot, ranges), rewards), out)| {
            if !slot.advance(ranges, rewards) {
                slot.start(scenario, config, &InitialState::default());
            }
            slot.episode().map(|episode| {
                episode.observe(out);
                measure(episode)
            })
        });
        Ok(measured.into_iter().flatten().collect())
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
        spread(self.pool(slots.len())?, work, |(episode, out)| {
            episode.observe(out);
        });
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
        Ok(spread(pool, episodes.into_iter(), measure))
    }

    fn episodes(&self, slots: impl Iterator<Item = usize>) -> Result<Vec<&Episode<D>>> {
        slots.map(|slot| self.episode(slot)).collect()
    }

    /// The pool to spread `flocks` over; `None` where one small flock or one thread leaves nothing to spread.
    fn pool(&self, flocks: usize) -> Result<Option<&'static ThreadPool>> {
        let is_small = flocks <= 1 && !threads::is_large(self.scenario.num_agents);
        if is_small || self.num_threads == Some(1) {
            return Ok(None);
        }
        threads::pool(self.num_threads).map(Some)
    }

    fn check_step(
        &self,
        ranges: &[f64],
        restart: bool,
        rewards: usize,
        observations: usize,
    ) -> Result<()> {
        let rows = self.num_flocks() * self.rows();
        check_length("interaction_range", ranges.len(), rows)?;
        check_length("rewards", rewards, rows)?;
        check_length("observations", observations, rows * self.row_length)?;
        for slot in 0..self.num_flocks() {
            if self.episode(slot)?.has_ended() && !restart {
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

impl Metrics {
    /// Metrics of one episode.
    #[must_use]
    pub fn of<const D: usize>(episode: &Episode<D>) -> Self {
        Self {
            mean_distance: episode.mean_distance().now,
            min_distance: episode.min_distance().now,
            min_mean_distance: episode.mean_distance().minimum,
            min_min_distance: episode.min_distance().minimum,
            polarization: episode.polarization(),
        }
    }
}

/// Runs every piece of work, over the threads of `pool` if there is one; results are in order.
fn spread<T: Send, R: Send>(
    pool: Option<&ThreadPool>,
    work: impl Iterator<Item = T>,
    run: impl Fn(T) -> R + Send + Sync,
) -> Vec<R> {
    match pool {
        Some(pool) => {
            let work: Vec<T> = work.collect();
            pool.install(|| work.into_par_iter().map(run).collect())
        }
        None => work.map(run).collect(),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{InitialRegion, Objective, View};
    use crate::neighbor::NeighborRule;
    use crate::predator::{ConstantVelocity, PredatorConfig};
    use crate::reward::Reward;

    const FLOCKS: usize = 5;
    const AGENTS: usize = 30;

    fn batch(num_flocks: usize, num_threads: usize) -> Batch<2> {
        let predator = ConstantVelocity {
            position: vec![-5.0, -5.0],
            velocity: vec![10.0, 10.0],
        };
        let scenario = FlockConfig {
            num_agents: AGENTS,
            dimension: 2,
            num_steps: 20,
            time_step: 0.05,
            mass: 0.1,
            speed: 10.0,
            initial_side: 30.0,
            initial_region: InitialRegion::Cube,
            predator_range: 20.0,
            repulsion_strength: 10.0,
            constant_speed: true,
            predators: vec![PredatorConfig::ConstantVelocity(predator)],
            neighbor_rule: NeighborRule::Metric {},
        };
        let config = EpisodeConfig {
            view: View::Agent,
            objective: Objective::Mean,
            reward: Reward::RunningMinimum,
            max_range: 10.0,
            predator_sensing_range: None,
            steps_per_action: 3,
        };
        Batch::new(scenario, config, num_flocks, Some(num_threads)).expect("a good scenario")
    }

    fn step(batch: &mut Batch<2>, range: f64) -> Result<(Vec<f64>, Vec<f32>)> {
        let rows = batch.num_flocks() * AGENTS;
        let ranges: Vec<f64> = (0..rows)
            .map(|row| range + (row % AGENTS) as f64 / 10.0)
            .collect();
        let mut rewards = vec![0.0; rows];
        let mut observations = vec![0.0; rows * batch.row_length()];
        batch.step(&ranges, &mut rewards, &mut observations)?;
        Ok((rewards, observations))
    }

    #[test]
    fn threads_and_places_do_not_matter() {
        let run = |threads: usize, seeds: &[u64]| {
            let mut batch = batch(seeds.len(), threads);
            for (slot, seed) in seeds.iter().enumerate() {
                batch
                    .reset(slot, &InitialState::seeded(*seed))
                    .expect("a slot");
            }
            (0..7)
                .map(|_| step(&mut batch, 4.0).expect("steps left"))
                .collect::<Vec<_>>()
        };
        let seeds: Vec<u64> = (0..FLOCKS as u64).collect();
        let serial = run(1, &seeds);
        for threads in [2, 4, 7] {
            assert_eq!(run(threads, &seeds), serial);
        }
        for (seed, step) in (0..FLOCKS).flat_map(|seed| (0..7).map(move |step| (seed, step))) {
            let alone = &run(1, &[seed as u64])[step];
            let width = alone.1.len();
            assert_eq!(alone.0, serial[step].0[seed * AGENTS..(seed + 1) * AGENTS]);
            assert_eq!(alone.1, serial[step].1[seed * width..(seed + 1) * width]);
        }
    }

    #[test]
    fn rewards_sum_to_the_change_of_the_objective() {
        let mut batch = batch(1, 1);
        batch.reset(0, &InitialState::seeded(3)).expect("a slot");
        let start = batch.episode(0).expect("an episode").objective().start;
        let mut total = 0.0;
        while !batch.episode(0).expect("an episode").has_ended() {
            total += step(&mut batch, 4.0).expect("steps left").0[0];
        }
        let end = batch.episode(0).expect("an episode").objective().minimum;
        assert!(end < start && (total - (end - start)).abs() < 1e-12);
    }

    /// Slots whose episodes end at different times: each goes on as if it were alone.
    #[test]
    fn slots_restart_at_their_own_horizon() {
        let ends = 7; // of 20 steps, three per action
        for threads in [1, 3] {
            let mut crowd = batch(3, threads);
            let all: Vec<_> = (0..3).map(|slot| (slot, Some(slot as u64))).collect();
            crowd
                .reset_many(&all, &InitialState::default())
                .expect("slots");
            let mut alone: Vec<_> = (0..3).map(|_| batch(1, 1)).collect();
            for (seed, batch) in alone.iter_mut().enumerate() {
                let start = InitialState::seeded(seed as u64);
                batch.reset(0, &start).expect("a slot");
            }
            let rows = 3 * AGENTS;
            let mut rewards = vec![0.0; rows];
            let mut observations = vec![0.0; rows * crowd.row_length()];
            let mut numbers = [0, 0, 0];
            for action in 0..3 * ends {
                if action == 2 {
                    let next = InitialState::seeded(episode_seed(1, 1));
                    crowd
                        .reset_many(&[(1, None)], &InitialState::seeded(99))
                        .expect("a slot");
                    alone[1].reset(0, &next).expect("a slot");
                    numbers[1] = 1;
                }
                crowd
                    .step_measured(
                        &vec![4.0; rows],
                        true,
                        &mut rewards,
                        &mut observations,
                        |_| (),
                    )
                    .expect("good ranges");
                for (slot, alone) in alone.iter_mut().enumerate() {
                    let mut reward = vec![1.0; AGENTS];
                    let mut observation = vec![0.0; AGENTS * alone.row_length()];
                    if alone.episode(0).expect("an episode").has_ended() {
                        numbers[slot] += 1;
                        let start = InitialState::seeded(episode_seed(slot as u64, numbers[slot]));
                        alone.reset(0, &start).expect("a slot");
                        alone.observe(&[0], &mut observation).expect("a slot");
                        reward.fill(0.0);
                    } else {
                        let ranges = vec![4.0; AGENTS];
                        alone
                            .step(&ranges, &mut reward, &mut observation)
                            .expect("steps left");
                    }
                    let width = observation.len();
                    assert_eq!(rewards[slot * AGENTS..(slot + 1) * AGENTS], reward);
                    assert_eq!(observations[slot * width..(slot + 1) * width], observation);
                }
            }
            assert_eq!(numbers, [2, 3, 2]);
        }
    }

    #[test]
    fn unseeded_slots_start_apart_and_refused_resets_change_nothing() {
        let mut batch = batch(3, 1);
        batch.seed(5);
        let all: Vec<_> = (0..3).map(|slot| (slot, None)).collect();
        assert!(
            batch
                .reset_many(&[(0, None), (3, None)], &InitialState::default())
                .is_err()
        );
        let spoilt = InitialState {
            positions: Some(vec![0.0]),
            ..InitialState::default()
        };
        assert!(batch.reset_many(&all, &spoilt).is_err());
        assert!(batch.metrics().is_err());
        batch
            .reset_many(&all, &InitialState::default())
            .expect("slots");
        let metrics = batch.metrics().expect("episodes");
        assert!(metrics[0] != metrics[1] && metrics[1] != metrics[2] && metrics[0] != metrics[2]);
        for (slot, expected) in metrics.iter().enumerate() {
            let seed = episode_seed(5, slot as u64 + 1);
            batch
                .reset(slot, &InitialState::seeded(seed))
                .expect("a slot");
            assert_eq!(
                Metrics::of(batch.episode(slot).expect("an episode")),
                *expected
            );
        }
        assert_eq!(batch.num_components().expect("episodes"), [AGENTS; 3]);
    }

    #[test]
    fn refused_steps_change_nothing() {
        let mut batch = batch(2, 1);
        assert!(matches!(step(&mut batch, 1.0), Err(Error::Episode { .. })));
        for slot in 0..2 {
            batch.reset(slot, &InitialState::seeded(9)).expect("a slot");
        }
        let before = batch.metrics();
        for range in [f64::NAN, f64::INFINITY, -3.0] {
            assert!(matches!(
                step(&mut batch, range),
                Err(Error::Argument { .. })
            ));
        }
        assert_eq!(batch.metrics(), before);
        for _ in 0..7 {
            step(&mut batch, 1.0).expect("steps left");
        }
        assert!(matches!(step(&mut batch, 1.0), Err(Error::Episode { .. })));
        assert!(batch.reset(2, &InitialState::seeded(0)).is_err());
    }
}
