//! Grids of runs on the same initial states: the search over interaction ranges.

use std::sync::Arc;

use rayon::prelude::*;

use crate::base::error::Result;
use crate::base::memory;
use crate::flock::{FlockConfig, InitialState, World, check_ranges, probe_flocks};
use crate::line::{Line, LineConfig, run_line};
use crate::neighbor::Ranges;
use crate::parallel::{self, Progress};
use crate::reward::Objective;

/// The outcome of one run of a flock sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlockOutcome {
    /// The minima over t of the values of all objectives, in the order of [`Objective`].
    pub objectives: [f64; Objective::COUNT],
    /// Number of connected components at the horizon.
    pub num_components: usize,
}

/// The outcome of one run of a line sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineOutcome {
    /// The escape distance d_ss in the steady state, or the last escape distance if the line did not
    /// converge.
    pub escape_distance: f64,
    /// Number of connected components at the end.
    pub num_components: usize,
    /// Whether the line reached a steady state.
    pub converged: bool,
}

/// Runs a flock for every pair of a range in m and a seed, and returns the outcomes in row-major order: all
/// seeds of the first range, then all seeds of the second, and so on. `config` must be
/// [checked](FlockConfig::check).
///
/// # Errors
/// [`crate::Error::Input`] if a range or the number of threads is out of bounds; [`crate::Error::Memory`];
/// [`crate::Error::Interrupted`] if `progress` was cancelled. `progress` counts finished runs.
pub fn sweep_flock(
    config: &Arc<FlockConfig>,
    ranges: &[f64],
    seeds: &[u64],
    num_threads: Option<usize>,
    progress: &Progress,
) -> Result<Vec<FlockOutcome>> {
    check_ranges("interaction_ranges", ranges)?;
    probe_flocks(config, parallel::num_threads(num_threads).min(seeds.len()))?;
    grid(
        ranges,
        seeds,
        num_threads,
        progress,
        |range, seed| match config.dimension {
            2 => run_flock::<2>(config, range, seed, progress),
            _ => run_flock::<3>(config, range, seed, progress),
        },
    )
}

/// Runs a line for every pair of a range and a seed, and returns the outcomes in row-major order.
///
/// # Errors
/// As [`sweep_flock`].
pub fn sweep_line(
    config: &Arc<LineConfig>,
    ranges: &[f64],
    seeds: &[u64],
    num_threads: Option<usize>,
    progress: &Progress,
) -> Result<Vec<LineOutcome>> {
    check_ranges("interaction_ranges", ranges)?;
    grid(ranges, seeds, num_threads, progress, |range, seed| {
        let mut line = Line::new(config.clone(), seed, None)?;
        let (_, converged) = run_line(&mut line, range, progress, |_| Ok(()))?;
        Ok(LineOutcome {
            escape_distance: line.escape_distance(),
            num_components: line.num_components(range),
            converged,
        })
    })
}

fn grid<T: Send>(
    ranges: &[f64],
    seeds: &[u64],
    num_threads: Option<usize>,
    progress: &Progress,
    run: impl Fn(f64, u64) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    // The outcomes, and as many columns.
    let num_cells = ranges.len().saturating_mul(seeds.len());
    memory::probe::<T>("seeds", num_cells.saturating_mul(2))?;
    parallel::pool(num_threads)?.install(|| {
        (0..ranges.len() * seeds.len())
            .into_par_iter()
            .map(|cell| {
                let outcome = run(ranges[cell / seeds.len()], seeds[cell % seeds.len()]);
                progress.advance();
                outcome
            })
            .collect()
    })
}

fn run_flock<const D: usize>(
    config: &Arc<FlockConfig>,
    range: f64,
    seed: u64,
    progress: &Progress,
) -> Result<FlockOutcome> {
    let mut world = World::<D>::new(config.drawn(seed)?, &InitialState::seeded(seed));
    world.stop_counting();
    let mut objectives = Objective::values_of(&world);
    for _ in 0..config.num_steps {
        progress.check()?;
        world.step(Ranges::Shared(range))?;
        for (minimum, value) in objectives.iter_mut().zip(Objective::values_of(&world)) {
            *minimum = minimum.min(value);
        }
    }
    Ok(FlockOutcome {
        objectives,
        num_components: world.num_components(Ranges::Shared(range)),
    })
}
