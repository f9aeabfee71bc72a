//! `Run`: a flock that is stepped, changed and saved on demand, without the horizon of an episode.

use std::sync::Arc;

use nalgebra::SVector;

use super::initial_state::{InitialState, check_rows};
use super::scenario::FlockConfig;
use super::world::{World, WorldState};
use crate::agents::is_large;
use crate::base::check::{clipped, length, not_negative, rounding};
use crate::base::error::{Error, Result};
use crate::base::memory;
use crate::neighbor::Ranges;
use crate::parallel;
use crate::snapshot::{Fingerprint, decode, encode};

/// Largest relative deviation of a given velocity from the constant speed.
const SPEED_ROUNDING: f64 = 1e-9;

/// What acts on a flock in a step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Action {
    /// Interaction ranges in m: one, or one per agent.
    pub ranges: Vec<f64>,
    /// Actions of the learned predators, D entries per predator; empty: they fly straight on.
    pub predator_actions: Vec<f64>,
    /// A term that is added to f_i, D entries per agent; empty: none.
    pub extra_force: Vec<f64>,
}

/// A flock that is stepped and changed on demand. Arrays have an entry, or D of them, per agent in the order of ids.
#[derive(Debug, Clone)]
pub struct Run<const D: usize> {
    /// The scenario before random fields are drawn.
    scenario: Arc<FlockConfig>,
    num_threads: Option<usize>,
    world: World<D>,
    /// The seed.
    pub seed: u64,
    /// Number of steps since t = 0.
    pub num_steps: u64,
    /// The step in which each agent was caught, or -1.
    pub caught_at: Vec<i64>,
    /// The index of the predator that was nearest to each agent when it was caught, or -1.
    pub caught_by: Vec<i64>,
}

impl<const D: usize> Run<D> {
    /// Creates the flock at t = 0. `scenario.dimension` must be D. A large flock runs on `num_threads` threads; `None`
    /// is one thread per core.
    ///
    /// # Errors
    /// [`Error::Input`] if `start` does not fit the scenario, or a drawn number is out of bounds; [`Error::Memory`].
    pub fn new(
        scenario: Arc<FlockConfig>,
        start: &InitialState,
        num_threads: Option<usize>,
    ) -> Result<Self> {
        start.check(&scenario)?;
        let drawn = scenario.drawn(start.seed)?;
        probe_flocks(&drawn, 1)?;
        Ok(Self {
            num_threads,
            world: World::new(drawn, start),
            seed: start.seed,
            num_steps: 0,
            caught_at: vec![-1; scenario.num_agents],
            caught_by: vec![-1; scenario.num_agents],
            scenario,
        })
    }

    /// Advances the flock by `num_steps` steps with the same action.
    ///
    /// # Errors
    /// [`Error::Input`] if the action does not fit; [`Error::Memory`] as in [`World::step`]. The flock is then unchanged.
    pub fn step(&mut self, action: &Action, num_steps: usize) -> Result<()> {
        let n = self.scenario.num_agents;
        check_ranges("ranges", &action.ranges)?;
        if action.ranges.len() != 1 {
            length("ranges", action.ranges.len(), n, "entries", "")?;
        }
        check_predator_actions(&action.predator_actions, self.scenario.num_learned() * D)?;
        if !action.extra_force.is_empty() {
            check_rows("extra_force", &action.extra_force, n, D)?;
        }
        let threads = self.num_threads;
        on_threads(n, threads, || self.advance(action, num_steps))?
    }

    fn advance(&mut self, action: &Action, num_steps: usize) -> Result<()> {
        let ranges = Ranges::from(&action.ranges[..]);
        self.world.set_predator_actions(&action.predator_actions);
        for _ in 0..num_steps {
            let num_caught = self.world.caught().len();
            self.world.step_with_force(ranges, &action.extra_force)?;
            self.num_steps += 1;
            for agent in &self.world.agents().caught()[num_caught..] {
                let distance =
                    |predator: &[f64; D]| (agent.position - SVector::from(*predator)).norm();
                let distances = self.world.predator_positions().iter().map(distance);
                let nearest = (0..).zip(distances).min_by(|a, b| a.1.total_cmp(&b.1));
                self.caught_at[agent.id as usize] = self.num_steps as i64;
                self.caught_by[agent.id as usize] = nearest.map_or(-1, |(index, _)| index);
            }
        }
        Ok(())
    }

    /// Sets the "positions" in m, which a periodic domain wraps, or the "velocities" in m/s of all agents that are not
    /// caught.
    ///
    /// # Errors
    /// [`Error::Input`] on `field` if the array has the wrong length, an entry is out of bounds, or a velocity does not
    /// have the constant speed of the scenario. The flock is then unchanged.
    pub fn set(&mut self, field: &str, vectors: &[f64]) -> Result<()> {
        check_rows(field, vectors, self.scenario.num_agents, D)?;
        let (config, are_velocities) = (self.world.config(), field == "velocities");
        for (id, vector) in vectors.as_chunks::<D>().0.iter().enumerate() {
            let (speed, given) = (config.speed.of(id), SVector::from(*vector).norm());
            let is_free = !are_velocities || !config.constant_speed || self.caught_by[id] >= 0;
            if !is_free && (given - speed).abs() > SPEED_ROUNDING * speed {
                let expected = format!("the constant speed {speed} m/s");
                let field = format!("{field}[{id}]");
                return Err(Error::input(field, expected, format!("{given} m/s")));
            }
        }
        self.world.set(vectors, are_velocities);
        Ok(())
    }

    /// Returns a snapshot.
    pub fn save(&self) -> Result<Vec<u8>> {
        let origin = (self.seed, self.num_steps);
        let state = (origin, &self.caught_at, &self.caught_by, self.world.save());
        encode(self.fingerprint(), &state)
    }

    /// Restores a snapshot of the same scenario.
    ///
    /// # Errors
    /// [`Error::Input`] on `state` if the bytes are damaged or from another scenario. The flock is then unchanged.
    pub fn restore(&mut self, state: &[u8]) -> Result<()> {
        let ((seed, num_steps), caught_at, caught_by, world) = decode(self.fingerprint(), state)?;
        let world: WorldState<D> = world;
        self.world = World::restore(world, self.scenario.drawn(seed)?, seed);
        (self.seed, self.num_steps) = (seed, num_steps);
        (self.caught_at, self.caught_by) = (caught_at, caught_by);
        Ok(())
    }

    fn fingerprint(&self) -> Fingerprint {
        Fingerprint::of(&(&*self.scenario, "run"))
    }

    /// Estimates the number of agents that a step visits, a measure of its run time.
    pub fn work(&self, ranges: &[f64]) -> usize {
        let (n, longest) = (
            self.scenario.num_agents,
            ranges.iter().copied().fold(0.0, f64::max),
        );
        let options = self.scenario.neighbor_options();
        n.saturating_mul(options.work_per_agent(n, longest))
    }

    /// Returns the number of weakly connected components under these ranges, one or one per agent.
    ///
    /// # Errors
    /// [`Error::Input`] if the threads cannot be started.
    pub fn num_components(&self, ranges: &[f64]) -> Result<usize> {
        let count = || self.world.num_components(ranges.into());
        on_threads(self.scenario.num_agents, self.num_threads, count)
    }

    /// Returns the flock and its predators.
    pub fn world(&self) -> &World<D> {
        &self.world
    }
}

/// Runs `work`, on `num_threads` threads if the flock is large.
fn on_threads<T: Send>(
    num_agents: usize,
    num_threads: Option<usize>,
    work: impl FnOnce() -> T + Send,
) -> Result<T> {
    rounding()?;
    if is_large(num_agents) && num_threads != Some(1) {
        Ok(parallel::pool(num_threads)?.install(work))
    } else {
        Ok(work())
    }
}

/// Checks that all ranges are finite and at least 0.
///
/// # Errors
/// [`Error::Input`] naming the first entry of `field` that is not.
pub fn check_ranges(field: &str, ranges: &[f64]) -> Result<()> {
    let is_valid = |range: &f64| (*range >= 0.0) & (*range <= f64::MAX);
    // Without a branch per range this is vectorized.
    if ranges.iter().fold(true, |all, range| all & is_valid(range)) {
        return Ok(());
    }
    let mut each = ranges.iter().enumerate();
    each.try_for_each(|(at, &range)| not_negative(&format!("{field}[{at}]"), range))
}

/// Checks the actions of learned predators: `count` entries or none, each in [-1, 1] up to rounding in float32.
///
/// # Errors
/// [`Error::Input`] naming the wrong length or the first entry out of bounds.
pub fn check_predator_actions(actions: &[f64], count: usize) -> Result<()> {
    let field = "predator_actions";
    if !actions.is_empty() {
        length(field, actions.len(), count, "entries", "")?;
    }
    match actions.iter().position(|c| clipped(*c, -1.0, 1.0).is_nan()) {
        Some(at) => {
            let field = format!("{field}[{at}]");
            Err(Error::input(field, "a number from -1 to 1", actions[at]))
        }
        None => Ok(()),
    }
}

/// Memory in bytes of a flock without its agents, rounded: one group of agents and the buffers of its slot.
const FLOCK_BYTES: usize = 1 << 14;

/// Memory in bytes of an agent in a large flock, rounded: its columns, sums and neighbor candidates.
const AGENT_BYTES: usize = 1 << 10;

/// Returns the approximate memory in bytes of a flock, with its delayed forces and without a frozen graph.
pub(crate) fn flock_bytes(config: &FlockConfig) -> usize {
    let past = config.sensing_delay.min(config.num_steps);
    let delayed = past.saturating_mul(config.dimension * size_of::<f64>());
    let agents = config
        .num_agents
        .saturating_mul(AGENT_BYTES.saturating_add(delayed));
    FLOCK_BYTES.saturating_add(agents)
}

/// Asks the system for the memory of this many flocks; see [`memory::probe`].
pub(crate) fn probe_flocks(config: &FlockConfig, num_flocks: usize) -> Result<()> {
    memory::probe::<u8>("num_agents", num_flocks.saturating_mul(flock_bytes(config)))
}
