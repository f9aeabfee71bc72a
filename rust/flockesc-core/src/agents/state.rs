//! Snapshots of agents: one row per agent, so that a snapshot does not depend on the layout of groups.

use serde::{Deserialize, Serialize};

use super::{Agent, Agents, Caught};

/// The serialized agents of a flock.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct AgentsState<const D: usize> {
    /// In the order of places.
    agents: Vec<Agent<D>>,
    caught: Vec<Caught<D>>,
    reached: Vec<bool>,
}

impl<const D: usize> Agents<D> {
    pub(crate) fn save(&self) -> AgentsState<D> {
        AgentsState {
            agents: self.iter().collect(),
            caught: self.caught.clone(),
            reached: self.reached.clone(),
        }
    }

    /// Restores a flock. The caller recomputes the distances to predators.
    pub(crate) fn restore(state: AgentsState<D>) -> Self {
        let AgentsState {
            agents,
            caught,
            reached,
        } = state;
        let mut restored = Self {
            caught,
            reached,
            ..Self::unsorted(agents.len())
        };
        for (place, agent) in agents.into_iter().enumerate() {
            restored.put(place, agent);
        }
        restored
    }
}
