//! Whole runs of a line: `simulate_line`, with a fixed range, and `rollout_line`, under networks.

use std::sync::Arc;

use super::episode::{LineEpisode, LineEpisodeConfig};
use super::step::Line;
use crate::base::error::Result;
use crate::base::memory;
use crate::line::scenario::LineConfig;
use crate::network::{EpisodeNetwork, Networks};
use crate::parallel::{self, Pool, Progress, dispatch};

/// A recorded run of a line: one entry or row per time 0..=steps.
#[derive(Debug, Clone, Default, PartialEq)]
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
    let mut trajectory = LineTrajectory::default();
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
        self.states.extend(line.states());
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

/// The outcome of an episode of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineEpisodeOutcome {
    /// Escape distance d at the end of the episode.
    pub escape_distance: f64,
    /// Number of connected components at the end, under the range of the last action.
    pub num_components: usize,
    /// Number of model steps.
    pub steps: usize,
    /// Whether the line reached a steady state.
    pub converged: bool,
    /// Number of actions.
    pub num_actions: usize,
}

/// Plays the line of every seed to the end of its episode, and returns the outcomes. There is one
/// network for all lines, or one per line. `progress` counts lines.
///
/// # Errors
/// [`crate::Error::Input`] if the scenario has no predator; if the
/// number of networks is neither 1 nor the number of seeds, or if `num_threads` is out of bounds;
/// [`crate::Error::Interrupted`] if `progress` was cancelled.
pub fn rollout_line(
    scenario: &Arc<LineConfig>,
    config: &LineEpisodeConfig,
    networks: &Networks,
    seeds: &[u64],
    num_threads: Option<usize>,
    progress: &Progress,
) -> Result<Vec<LineEpisodeOutcome>> {
    networks.check_count(seeds.len())?;
    let pool = match num_threads {
        Some(1) => Pool::None,
        _ => Pool::WithCaller(parallel::pool(num_threads)?),
    };
    let outcomes = dispatch(pool, seeds.iter().enumerate(), |(index, seed)| {
        progress.check()?;
        let episode = LineEpisode::new(scenario.clone(), config.clone(), *seed, None)?;
        let outcome = play(episode, networks.for_episode(index, 1), progress);
        progress.advance();
        outcome
    });
    outcomes.into_iter().collect()
}

/// Plays an episode to its end.
fn play(
    mut episode: LineEpisode,
    mut network: EpisodeNetwork<'_>,
    progress: &Progress,
) -> Result<LineEpisodeOutcome> {
    let (mut range, mut num_actions) = ([0.0], 0);
    while !episode.has_ended() {
        network.act(&episode.observation(), &mut range, progress)?;
        episode.advance(range[0], progress)?;
        num_actions += 1;
    }
    Ok(LineEpisodeOutcome {
        escape_distance: episode.line().escape_distance(),
        num_components: episode.line().num_components(episode.last_range()),
        steps: episode.steps(),
        converged: episode.is_steady(),
        num_actions,
    })
}
