//! Rollouts: whole episodes under networks.

use std::sync::Arc;

use super::options::EpisodeConfig;
use super::{Batch, Episode, Metrics};
use crate::base::error::Result;
use crate::base::exact::exact_sum;
use crate::base::rng::episode_seed;
use crate::flock::{FlockConfig, InitialState};
use crate::network::{EpisodeNetwork, Networks};
use crate::parallel::{Progress, dispatch};

/// The outcome of an episode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EpisodeOutcome {
    /// Metrics at the end of the episode.
    pub metrics: Metrics,
    /// Number of connected components at the end, under the ranges of the last action.
    pub num_components: usize,
    /// Sum of the rewards, averaged over all agents. Caught agents get no reward.
    pub mean_return: f64,
    /// Number of actions.
    pub num_actions: usize,
}

impl<const D: usize> Batch<D> {
    /// Plays the first episode in the schedule of every seed to its end, in the scenario of the first slot, and
    /// returns the outcomes.
    /// There is one network for all episodes, or one per episode. The slots stay unchanged.
    /// `progress` counts episodes.
    ///
    /// # Errors
    /// [`crate::Error::Input`] if the number of networks is neither 1 nor the number of seeds;
    /// [`crate::Error::Interrupted`] if `progress` was cancelled.
    pub fn rollout(
        &self,
        networks: &Networks,
        seeds: &[u64],
        progress: &Progress,
    ) -> Result<Vec<EpisodeOutcome>> {
        networks.check_count(seeds.len())?;
        let (scenario, config) = (self.scenario(), &self.config);
        let rows = config.view.rows(scenario);
        let work = seeds.iter().enumerate();
        let outcomes = dispatch(self.pool(seeds.len())?, work, |(index, seed)| {
            let outcome = play::<D>(
                scenario,
                config,
                *seed,
                networks.for_episode(index, rows),
                progress,
            );
            progress.advance();
            outcome
        });
        outcomes.into_iter().collect()
    }
}

/// Plays the first episode in the schedule of `seed` to its end.
fn play<const D: usize>(
    scenario: &Arc<FlockConfig>,
    config: &Arc<EpisodeConfig>,
    seed: u64,
    mut network: EpisodeNetwork<'_>,
    progress: &Progress,
) -> Result<EpisodeOutcome> {
    progress.check()?;
    let start = InitialState::seeded(episode_seed(seed, 0));
    let mut episode = Episode::<D>::new(scenario.drawn(start.seed)?, config.clone(), &start);
    let rows = config.view.rows(scenario);
    let mut observations = vec![0.0; rows * network.row_length()];
    let (mut ranges, mut rewards) = (vec![0.0; rows], vec![0.0; rows]);
    let (mut mean_return, mut num_actions) = (0.0, 0);
    while !episode.has_ended() {
        episode.observe(&mut observations, progress)?;
        network.act(&observations, &mut ranges, progress)?;
        let mut num_rewarded = rows;
        if config.view.is_per_agent() {
            let caught = episode.world().caught();
            num_rewarded -= caught.len();
            caught.for_each(|agent| ranges[agent] = 0.0);
        }
        episode.advance(&ranges, &[], &mut rewards, progress)?;
        mean_return += if config.reward.is_individual() {
            exact_sum(&rewards) / rows as f64
        } else {
            episode.team_reward() * (num_rewarded as f64 / rows as f64)
        };
        num_actions += 1;
    }
    Ok(EpisodeOutcome {
        metrics: episode.metrics(),
        num_components: episode.num_components(),
        mean_return,
        num_actions,
    })
}
