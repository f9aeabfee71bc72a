//! A recorded run of a line under a fixed range, until it stands still.

use std::sync::Arc;

use super::step::Line;
use crate::base::error::Result;
use crate::line::scenario::LineConfig;
use crate::parallel::Progress;

/// A recorded run of the line: one entry per time 0..=steps.
#[derive(Debug, Clone, PartialEq)]
pub struct LineTrajectory {
    /// x(t), row after row, (steps + 1) * n entries.
    pub states: Vec<f64>,
    /// m(t).
    pub num_components: Vec<i64>,
    /// d(t); infinite without a predator.
    pub escape_distance: Vec<f64>,
    /// Whether the last step moved no agent by more than the tolerance.
    pub converged: bool,
    /// Number of steps made.
    pub steps: usize,
}

/// Runs a line under `range` until its steady state, or until `max_steps`.
///
/// # Errors
/// As [`Line::new`] and [`Line::step`]; [`crate::Error::Interrupted`] if `progress` was cancelled.
pub fn simulate_line(
    config: Arc<LineConfig>,
    range: f64,
    seed: u64,
    initial_state: Option<&[f64]>,
    progress: &Progress,
) -> Result<LineTrajectory> {
    let mut line = Line::new(config, seed, initial_state)?;
    let mut trajectory = LineTrajectory {
        states: line.states(),
        num_components: vec![line.num_components(range) as i64],
        escape_distance: vec![line.escape_distance()],
        converged: false,
        steps: 0,
    };
    while !trajectory.converged && trajectory.steps < line.config().max_steps {
        progress.check()?;
        let moved = line.step(range)?;
        line.append_states(&mut trajectory.states);
        trajectory
            .num_components
            .push(line.num_components(range) as i64);
        trajectory.escape_distance.push(line.escape_distance());
        trajectory.converged = line.is_steady(moved);
        trajectory.steps += 1;
    }
    Ok(trajectory)
}
