//! `simulate_flock`: a recorded run of a flock with a fixed range or a schedule of ranges.

use std::sync::Arc;

use nalgebra::SVector;

use super::initial_state::InitialState;
use super::run::{Run, check_predator_actions, check_ranges};
use super::world::World;
use crate::base::error::{Error, Result};
use crate::base::memory;
use crate::flock::scenario::FlockConfig;
use crate::neighbor::Ranges;
use crate::parallel::{self, Progress};

/// Interaction ranges and predator actions of a run, and what it does not record.
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
    /// Number of steps that are not recorded between two recorded times.
    pub skipped: usize,
    /// Which of [`COLUMNS`] are not recorded.
    pub omitted: [bool; COLUMNS.len()],
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

/// Names of the columns of a [`Trajectory`]: r_i in m, v_i in m/s and r_p in m, each with D entries per agent or
/// predator in row-major order; the mean and minimum predator distance in m; the number of connected components
/// under the range of the next step, or at time T of the last step; the norm of the mean heading; and the fraction
/// of the agents that were not caught.
pub const COLUMNS: [&str; 8] = [
    "positions",
    "velocities",
    "predator_positions",
    "mean_distance",
    "min_distance",
    "num_components",
    "polarization",
    "fraction_surviving",
];

/// A recorded run of a flock of T steps, with entries for the times 0, k, 2 k, .. up to T, where k - 1 steps are
/// skipped.
///
/// ```
/// use std::sync::Arc;
/// use flockesc_core::{FlockConfig, InitialState, Progress, Schedule, simulate_flock};
///
/// let config = FlockConfig { num_steps: 20, ..FlockConfig::default() };
/// let schedule = Schedule { values: vec![12.0], rows: 1, columns: 1, ..Schedule::default() };
/// let start = InitialState::seeded(7);
/// let run = simulate_flock(Arc::new(config), &schedule, &start, None, &Progress::default())?;
/// assert_eq!(run.columns[3].len(), 21);
/// assert_eq!(run.columns[0].len(), 21 * 300 * 2);
/// # Ok::<(), flockesc_core::Error>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trajectory {
    /// [`COLUMNS`]; empty if they are omitted.
    pub columns: [Vec<f64>; COLUMNS.len()],
    /// Minima of the mean and minimum predator distance and of the surviving fraction over all steps.
    pub minima: [f64; 3],
    /// The step in which each agent was caught, 1..=T, or -1; n entries.
    pub caught_at: Vec<i64>,
}

impl Trajectory {
    /// Creates an empty record with memory for the whole run.
    fn with_capacity_for(config: &FlockConfig, schedule: &Schedule) -> Result<Self> {
        let times = config.num_steps / (schedule.skipped + 1) + 1;
        let rows = [config.num_agents, config.num_agents, config.predators.len()];
        let mut record = Self {
            minima: [f64::INFINITY; 3],
            ..Self::default()
        };
        for (index, column) in record.columns.iter_mut().enumerate() {
            if !schedule.omitted[index] {
                let entries = rows.get(index).map_or(1, |rows| rows * config.dimension);
                *column = memory::vector("num_steps", times.saturating_mul(entries))?;
            }
        }
        Ok(record)
    }

    fn record<const D: usize>(&mut self, world: &World<D>, schedule: &Schedule, step: usize) {
        let distance = world.predator_distance();
        let now = [distance.mean, distance.minimum, world.fraction_surviving()];
        for (minimum, now) in self.minima.iter_mut().zip(now) {
            *minimum = minimum.min(now);
        }
        if !step.is_multiple_of(schedule.skipped + 1) {
            return;
        }
        for (index, column) in self.columns.iter_mut().enumerate() {
            if schedule.omitted[index] {
                continue;
            }
            match COLUMNS[index] {
                "positions" => extend(column, world.positions().iter()),
                "velocities" => extend(column, world.velocities().iter()),
                "predator_positions" => {
                    extend(column, world.predators().iter().map(|p| &p.position));
                }
                "mean_distance" => column.push(distance.mean),
                "min_distance" => column.push(distance.minimum),
                "num_components" => {
                    let step = step.min(world.config().num_steps - 1);
                    column.push(world.num_components(schedule.at(step)) as f64);
                }
                "polarization" => column.push(world.polarization()),
                _ => column.push(world.fraction_surviving()),
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
    schedule.check(&config)?;
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
    let mut trajectory = Trajectory::with_capacity_for(&config, schedule)?;
    let mut run = Run::<D>::new(config, start, None)?;
    for step in 0..num_steps {
        progress.check()?;
        trajectory.record(run.world(), schedule, step);
        run.advance(schedule.at(step), schedule.actions_at(step, num_steps), &[])?;
    }
    trajectory.record(run.world(), schedule, num_steps);
    trajectory.caught_at = run.captures.0;
    Ok(trajectory)
}
