//! Snapshots of an episode.

use std::sync::{Arc, OnceLock};

use serde::{Deserialize, Serialize};

use super::{Episode, Running, rows};
use crate::base::error::Result;
use crate::episode::options::EpisodeConfig;
use crate::flock::{FlockConfig, World, WorldState};
use crate::snapshot::{check, check_numbers, is_range};

/// The serialized form of an [`Episode`]; fields have the same meaning.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct EpisodeState<const D: usize> {
    world: WorldState<D>,
    step: usize,
    agent_distances: Vec<f64>,
    agent_distances_before: Vec<f64>,
    agent_distances_at_minimum: Vec<f64>,
    mean_distance: Running,
    min_distance: Running,
    fraction_surviving: Running,
    ranges: Vec<f64>,
}

impl<const D: usize> Episode<D> {
    pub(crate) fn save(&self) -> EpisodeState<D> {
        EpisodeState {
            world: self.world.save(),
            step: self.step,
            agent_distances: self.agent_distances.clone(),
            agent_distances_before: self.agent_distances_before.clone(),
            agent_distances_at_minimum: self.agent_distances_at_minimum.clone(),
            mean_distance: self.mean_distance,
            min_distance: self.min_distance,
            fraction_surviving: self.fraction_surviving,
            ranges: self.ranges.clone(),
        }
    }

    /// Restores an episode that was started with `seed`.
    pub(crate) fn restore(
        state: EpisodeState<D>,
        scenario: &Arc<FlockConfig>,
        config: &Arc<EpisodeConfig>,
        seed: u64,
    ) -> Result<Self> {
        check(state.step <= scenario.num_steps, "step")?;
        let num_distances = if config.reward.is_individual() {
            scenario.num_agents
        } else {
            0
        };
        for distances in [
            &state.agent_distances,
            &state.agent_distances_before,
            &state.agent_distances_at_minimum,
        ] {
            check_numbers(distances, num_distances, "agents' distances")?;
        }
        for Running {
            start,
            now,
            minimum,
        } in [
            state.mean_distance,
            state.min_distance,
            state.fraction_surviving,
        ] {
            check_numbers(&[start, now, minimum], 3, "objectives")?;
        }
        check(state.ranges.len() == rows(config, scenario), "ranges")?;
        check(state.ranges.iter().copied().all(is_range), "ranges")?;
        let world = World::restore(state.world, scenario, seed)?;
        Ok(Self {
            config: config.clone(),
            summary: OnceLock::new(),
            world,
            step: state.step,
            agent_distances: state.agent_distances,
            agent_distances_before: state.agent_distances_before,
            agent_distances_at_minimum: state.agent_distances_at_minimum,
            mean_distance: state.mean_distance,
            min_distance: state.min_distance,
            fraction_surviving: state.fraction_surviving,
            ranges: state.ranges,
            team_reward: 0.0,
        })
    }
}
