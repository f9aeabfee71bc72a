//! `simulate_line`: a recorded run of a line with a fixed range, up to its steady state.

use std::sync::Arc;

use super::step::Line;
use crate::base::error::Result;
use crate::base::memory;
use crate::line::scenario::LineConfig;
use crate::parallel::Progress;

/// A recorded run of a line: one entry or row per time 0..=steps.
#[derive(Debug, Clone, PartialEq)]
pub struct LineTrajectory {
    /// States x(t), (steps + 1) * n entries in row-major order.
    pub states: Vec<f64>,
    /// Number of connected components m(t).
    pub num_components: Vec<i64>,
    /// Escape distance d(t); infinite without a predator.
    pub escape_distance: Vec<f64>,
    /// Whether the last step moved no agent by more than the tolerance.
    pub converged: bool,
    /// Number of steps.
    pub steps: usize,
}

/// Runs a line with the interaction range `range` until its steady state or for `max_steps` steps, and
/// records it.
///
/// # Errors
/// As [`Line::new`] and [`Line::step`]; [`crate::Error::Memory`] for the record;
/// [`crate::Error::Interrupted`] if `progress` was cancelled.
pub fn simulate_line(
    config: Arc<LineConfig>,
    range: f64,
    seed: u64,
    initial_state: Option<&[f64]>,
    progress: &Progress,
) -> Result<LineTrajectory> {
    let mut line = Line::new(config, seed, initial_state)?;
    let mut trajectory = LineTrajectory {
        states: Vec::new(),
        num_components: Vec::new(),
        escape_distance: Vec::new(),
        converged: false,
        steps: 0,
    };
    trajectory.record(&line, range)?;
    let (steps, converged) = run_line(&mut line, range, progress, |line| {
        trajectory.record(line, range)
    })?;
    (trajectory.steps, trajectory.converged) = (steps, converged);
    Ok(trajectory)
}

impl LineTrajectory {
    fn record(&mut self, line: &Line, range: f64) -> Result<()> {
        memory::reserve("max_steps", &mut self.states, line.config().num_agents)?;
        line.append_states(&mut self.states);
        self.num_components.push(line.num_components(range) as i64);
        self.escape_distance.push(line.escape_distance());
        Ok(())
    }
}

/// Runs a line until its steady state or for `max_steps` steps, and calls `record` after every step. Returns the
/// number of steps and whether the line reached a steady state.
pub(crate) fn run_line(
    line: &mut Line,
    range: f64,
    progress: &Progress,
    mut record: impl FnMut(&Line) -> Result<()>,
) -> Result<(usize, bool)> {
    for step in 1..=line.config().max_steps {
        progress.check()?;
        let moved = line.step(range)?;
        record(line)?;
        if line.is_steady(moved) {
            return Ok((step, true));
        }
    }
    Ok((line.config().max_steps, false))
}
