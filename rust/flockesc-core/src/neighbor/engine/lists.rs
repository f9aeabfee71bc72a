//! `Lists`: a neighbor graph as adjacency lists.

use serde::{Deserialize, Serialize};

/// Marks caught agents, which have no place.
pub(crate) const NO_PLACE: u32 = u32::MAX;

/// The ids of an agent and another agent.
pub(crate) type Pair = (u32, u32);

/// The argument that determines the number of pairs, for errors.
pub(crate) const RANGE: &str = "interaction_range";

/// Adjacency lists: for every agent the ids of other agents.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Lists {
    /// Index in `others` at which each agent's list starts, and the end of the last list.
    starts: Vec<usize>,
    others: Vec<u32>,
}

impl Lists {
    /// Creates the lists of `num_agents` agents from distinct pairs (agent, other agent). `others` is an empty vector,
    /// with room for all pairs if there may be too many for the memory.
    pub(crate) fn new(num_agents: usize, pairs: &[Pair], mut others: Vec<u32>) -> Self {
        others.resize(pairs.len(), 0);
        let mut starts = vec![0; num_agents + 1];
        for &(id, _) in pairs {
            starts[id as usize + 1] += 1;
        }
        for id in 0..num_agents {
            starts[id + 1] += starts[id];
        }
        let mut next = starts.clone();
        for &(id, other) in pairs {
            others[next[id as usize]] = other;
            next[id as usize] += 1;
        }
        Self { starts, others }
    }

    /// Returns the ids in the list of one agent, in no particular order.
    pub(crate) fn of(&self, id: usize) -> &[u32] {
        &self.others[self.starts[id]..self.starts[id + 1]]
    }
}
