//! Whole episodes of lines under networks.

use std::sync::Arc;

use super::episode::{LineEpisode, LineEpisodeConfig};
use crate::base::error::Result;
use crate::line::scenario::LineConfig;
use crate::network::{Networks, Player};
use crate::parallel::{self, Pool, Progress, dispatch};

/// What an episode of a line came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineEpisodeOutcome {
    /// d at the end.
    pub escape_distance: f64,
    /// Connected components at the end, under the range of the last action.
    pub num_components: usize,
    /// Steps of the model.
    pub steps: usize,
    /// Whether the line reached a steady state.
    pub converged: bool,
    /// Actions of the episode.
    pub num_actions: usize,
}

/// Plays the line of every seed to its end, under one network for all or under one for each. `progress` counts lines.
///
/// # Errors
/// [`crate::Error::Config`] if the scenario has no predator; [`crate::Error::Argument`] for another number of networks or a
/// bad number of threads; [`crate::Error::Interrupted`] if `progress` was cancelled.
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
        let outcome = play(episode, networks.player(index, 1), progress);
        progress.advance();
        outcome
    });
    outcomes.into_iter().collect()
}

fn play(
    mut episode: LineEpisode,
    mut player: Player<'_>,
    progress: &Progress,
) -> Result<LineEpisodeOutcome> {
    let (mut range, mut num_actions) = ([0.0], 0);
    while !episode.has_ended() {
        player.act(&episode.observation(), &mut range);
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
