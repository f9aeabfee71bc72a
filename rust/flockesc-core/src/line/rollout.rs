//! Rollouts of lines: whole episodes under networks.

use std::sync::Arc;

use super::episode::{LineEpisode, LineEpisodeConfig};
use crate::base::error::Result;
use crate::line::scenario::LineConfig;
use crate::network::{EpisodeNetwork, Networks};
use crate::parallel::{self, Pool, Progress, dispatch};

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
