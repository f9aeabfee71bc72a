//! Snapshots of an episode.

use std::sync::{Arc, OnceLock};

use serde::{Deserialize, Serialize};

use super::{Episode, Running, rows};
use crate::base::error::Result;
use crate::episode::options::EpisodeConfig;
use crate::flock::{FlockConfig, World, WorldState};
use crate::reward::Objective;
use crate::snapshot::{check, check_numbers, is_range};

/// The serialized form of an [`Episode`]; fields have the same meaning.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct EpisodeState<const D: usize> {
    world: WorldState<D>,
    step: usize,
    agent_distances: Vec<f64>,
    agent_distances_before: Vec<f64>,
    agent_distances_at_minimum: Vec<f64>,
    objectives: [Running; Objective::COUNT],
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
            objectives: self.objectives,
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
        } in state.objectives
        {
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
            objectives: state.objectives,
            ranges: state.ranges,
            team_reward: 0.0,
        })
    }
}
