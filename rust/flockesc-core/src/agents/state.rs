//! Snapshots of agents: one row per agent, so that a snapshot does not depend on the layout of groups.

use serde::{Deserialize, Serialize};

use super::{Agent, Agents, Caught};
use crate::base::error::Result;
use crate::base::vector::SHORTEST;
use crate::snapshot::{are_bounded, check, is_bounded};

/// The serialized agents of a flock.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct AgentsState<const D: usize> {
    /// In the order of places.
    agents: Vec<Agent<D>>,
    caught: Vec<Caught<D>>,
}

/// Returns whether an agent is valid: all numbers are bounded, and its speed is the norm of its velocity up
/// to rounding.
fn is_possible<const D: usize>(agent: &Agent<D>) -> bool {
    let (norm, speed) = (agent.velocity.norm(), agent.speed);
    are_bounded(agent.position.iter().chain(agent.velocity.iter()))
        && is_bounded(speed)
        && ((norm - speed).abs() <= 1e-9 * norm
            || (norm.max(speed.abs()) < SHORTEST && speed >= 0.0))
}

impl<const D: usize> Agents<D> {
    pub(crate) fn save(&self) -> AgentsState<D> {
        AgentsState {
            agents: (0..self.len()).map(|place| self.agent(place)).collect(),
            caught: self.caught.clone(),
        }
    }

    /// Restores a flock that had `num_agents` agents at t = 0. The caller recomputes the distances to
    /// predators.
    pub(crate) fn restore(state: AgentsState<D>, num_agents: usize) -> Result<Self> {
        let AgentsState { agents, caught } = state;
        let mut is_used = vec![false; num_agents];
        let ids = agents.iter().map(|agent| agent.id);
        for id in ids.chain(caught.iter().map(|agent| agent.id)) {
            let is_used = is_used.get_mut(id as usize);
            let is_new = is_used.is_some_and(|is_used| !std::mem::replace(is_used, true));
            check(is_new, "ids of agents")?;
        }
        check(!is_used.contains(&false), "ids of agents")?;
        check(agents.iter().all(is_possible), "agents")?;
        let positions = caught.iter().flat_map(|agent| &agent.position);
        check(are_bounded(positions), "positions of caught agents")?;
        let mut restored = Self {
            caught,
            ..Self::unsorted(agents.len())
        };
        for (place, agent) in agents.into_iter().enumerate() {
            restored.put(place, agent);
        }
        Ok(restored)
    }
}
