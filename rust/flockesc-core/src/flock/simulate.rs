//! `simulate_flock`: a recorded run of a flock with a fixed range or a schedule of ranges.

use std::sync::Arc;

use nalgebra::SVector;

use super::initial_state::InitialState;
use super::world::World;
use crate::base::check::{clipped, length, not_negative};
use crate::base::error::{Error, Result};
use crate::base::memory;
use crate::flock::scenario::FlockConfig;
use crate::neighbor::Ranges;
use crate::parallel::{self, Progress};

/// Interaction ranges and predator actions of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Schedule {
    /// Ranges in m, in row-major order.
    pub values: Vec<f64>,
    /// Number of rows: 1 for a constant range, or the number of steps.
    pub rows: usize,
    /// Number of columns: 1 for a shared range, or the number of agents.
    pub columns: usize,
    /// Actions of the learned predators in [-1, 1], with D entries per predator in every step. If it is
    /// empty, learned predators fly straight on.
    pub predator_actions: Vec<f64>,
}

impl Schedule {
    fn check(&self, config: &FlockConfig) -> Result<()> {
        let fits = (self.rows == 1 || self.rows == config.num_steps)
            && (self.columns == 1 || self.columns == config.num_agents)
            && self.values.len() == self.rows * self.columns;
        if !fits {
            let (steps, agents) = (config.num_steps, config.num_agents);
            return Err(Error::input(
                "interaction_range",
                format!("a scalar or shape ({agents},), ({steps},), ({steps}, {agents})"),
                format!("{} x {}", self.rows, self.columns),
            ));
        }
        check_ranges("interaction_range", &self.values)?;
        let each = config.num_learned() * config.dimension;
        check_predator_actions(&self.predator_actions, config.num_steps * each)
    }

    /// Returns the actions of the learned predators in a step.
    fn actions_at(&self, step: usize, num_steps: usize) -> &[f64] {
        let each = self.predator_actions.len() / num_steps;
        &self.predator_actions[step * each..(step + 1) * each]
    }

    fn at(&self, step: usize) -> Ranges<'_> {
        let row = if self.rows == 1 { 0 } else { step };
        match self.columns {
            1 => Ranges::Shared(self.values[row]),
            n => Ranges::PerAgent(&self.values[row * n..(row + 1) * n]),
        }
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

/// A recorded run of a flock: one entry or row per time 0..=T, where T is the number of steps. Arrays are
/// flat, in row-major order.
///
/// ```
/// use std::sync::Arc;
/// use flockesc_core::{FlockConfig, InitialState, Progress, Schedule, simulate_flock};
///
/// let config = FlockConfig { num_steps: 20, ..FlockConfig::default() };
/// let schedule = Schedule { values: vec![12.0], rows: 1, columns: 1, ..Schedule::default() };
/// let start = InitialState::seeded(7);
/// let run = simulate_flock(Arc::new(config), &schedule, &start, None, &Progress::default())?;
/// assert_eq!(run.mean_distance.len(), 21);
/// assert_eq!(run.positions.len(), 21 * 300 * 2);
/// # Ok::<(), flockesc_core::Error>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trajectory {
    /// r_i(t) in m, (T + 1) * n * D entries.
    pub positions: Vec<f64>,
    /// v_i(t) in m/s, (T + 1) * n * D entries.
    pub velocities: Vec<f64>,
    /// r_p(t) in m, (T + 1) * D entries per predator.
    pub predator_positions: Vec<f64>,
    /// Mean predator distance in m.
    pub mean_distance: Vec<f64>,
    /// Minimum predator distance in m.
    pub min_distance: Vec<f64>,
    /// Number of connected components under the range of the next step. The last entry uses the range of the
    /// last step.
    pub num_components: Vec<i64>,
    /// Norm of the mean heading.
    pub polarization: Vec<f64>,
    /// Fraction of the agents that were not caught.
    pub fraction_surviving: Vec<f64>,
    /// The step in which each agent was caught, 1..=T, or -1; n entries.
    pub caught_at: Vec<i64>,
}

impl Trajectory {
    /// Creates an empty record with memory for the whole run.
    fn with_capacity_for(config: &FlockConfig) -> Result<Self> {
        let times = config.num_steps + 1;
        let agents = times.saturating_mul(config.num_agents * config.dimension);
        let predators = times.saturating_mul(config.predators.len() * config.dimension);
        let vector = |entries| memory::vector("num_steps", entries);
        Ok(Self {
            positions: vector(agents)?,
            velocities: vector(agents)?,
            predator_positions: vector(predators)?,
            mean_distance: vector(times)?,
            min_distance: vector(times)?,
            num_components: memory::vector("num_steps", times)?,
            polarization: vector(times)?,
            fraction_surviving: vector(times)?,
            caught_at: vec![-1; config.num_agents],
        })
    }

    fn record<const D: usize>(&mut self, world: &World<D>, ranges: Ranges<'_>) {
        extend(&mut self.positions, world.positions().iter());
        extend(&mut self.velocities, world.velocities().iter());
        let predators = world.predators().iter().map(|p| &p.position);
        extend(&mut self.predator_positions, predators);
        let distance = world.predator_distance();
        self.mean_distance.push(distance.mean);
        self.min_distance.push(distance.minimum);
        self.num_components
            .push(world.num_components(ranges) as i64);
        self.polarization.push(world.polarization());
        self.fraction_surviving.push(world.fraction_surviving());
        let step = self.mean_distance.len() as i64 - 1;
        for agent in world.caught() {
            if self.caught_at[agent] < 0 {
                self.caught_at[agent] = step;
            }
        }
    }
}

fn extend<'a, const D: usize>(
    flat: &mut Vec<f64>,
    vectors: impl Iterator<Item = &'a SVector<f64, D>>,
) {
    for vector in vectors {
        flat.extend_from_slice(vector.as_slice());
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

/// Runs a flock for `num_steps` steps and records it. A large flock runs on `num_threads` threads; `None` is
/// one thread per core.
///
/// # Errors
/// [`Error::Input`] if `start` or `schedule` does not fit the scenario or `num_threads` is out of bounds;
/// [`Error::Memory`] for the record; [`Error::Interrupted`] if `progress` was cancelled.
pub fn simulate_flock(
    config: Arc<FlockConfig>,
    schedule: &Schedule,
    start: &InitialState,
    num_threads: Option<usize>,
    progress: &Progress,
) -> Result<Trajectory> {
    start.check(&config)?;
    let config = config.drawn(start.seed)?;
    schedule.check(&config)?;
    probe_flocks(&config, 1)?;
    parallel::pool(num_threads)?.install(|| match config.dimension {
        2 => run::<2>(config, schedule, start, progress),
        _ => run::<3>(config, schedule, start, progress),
    })
}

fn run<const D: usize>(
    config: Arc<FlockConfig>,
    schedule: &Schedule,
    start: &InitialState,
    progress: &Progress,
) -> Result<Trajectory> {
    let num_steps = config.num_steps;
    let mut trajectory = Trajectory::with_capacity_for(&config)?;
    let mut world = World::<D>::new(config, start);
    for step in 0..num_steps {
        progress.check()?;
        trajectory.record(&world, schedule.at(step));
        world.set_predator_actions(schedule.actions_at(step, num_steps));
        world.step(schedule.at(step))?;
    }
    trajectory.record(&world, schedule.at(num_steps - 1));
    Ok(trajectory)
}
