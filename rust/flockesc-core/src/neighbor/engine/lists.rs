//! A neighbor graph as lists, in the order of names.

use serde::{Deserialize, Serialize};

/// For every agent some others, by name.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::neighbor) struct Lists {
    /// Where the list of each agent begins in `others`, and where the last one ends.
    starts: Vec<usize>,
    others: Vec<u32>,
}

impl Lists {
    /// The lists of `num_agents` agents, from pairs (whose list, who is in it), none of them twice.
    pub(in crate::neighbor) fn new(num_agents: usize, pairs: &[(u32, u32)]) -> Self {
        let mut starts = vec![0; num_agents + 1];
        for &(name, _) in pairs {
            starts[name as usize + 1] += 1;
        }
        for name in 0..num_agents {
            starts[name + 1] += starts[name];
        }
        let (mut next, mut others) = (starts.clone(), vec![0; pairs.len()]);
        for &(name, other) in pairs {
            others[next[name as usize]] = other;
            next[name as usize] += 1;
        }
        Self { starts, others }
    }

    /// Whether these are lists of `num_agents` agents.
    pub(in crate::neighbor) fn fit(&self, num_agents: usize) -> bool {
        self.starts.len() == num_agents + 1
            && self.starts[0] == 0
            && self.starts.is_sorted()
            && self.starts[num_agents] == self.others.len()
            && self.others.iter().all(|name| (*name as usize) < num_agents)
    }

    /// The names in the list of one agent, in no order that means anything.
    pub(in crate::neighbor) fn of(&self, name: usize) -> &[u32] {
        &self.others[self.starts[name]..self.starts[name + 1]]
    }
}
