//! `Forest`: sets of connected agents, by union-find.

use crate::agents::{Agents, GROUP};
use crate::neighbor::engine::pairs::Pairs;

/// Returns the weakly connected components, from all pairs of neighbors.
pub(in crate::neighbor) fn connect_pairs<const D: usize>(pairs: &Pairs<'_, D>) -> Forest {
    let mut forest = Forest::new(pairs.agents.len());
    let mut tiles = Vec::new();
    for group in 0..pairs.agents.groups.len() {
        pairs.visit(group, &mut tiles, |lane, place| {
            forest.union(group * GROUP + lane, place);
        });
    }
    forest
}

/// A disjoint-set forest of places.
pub(in crate::neighbor) struct Forest {
    parents: Vec<u32>,
    count: usize,
}

impl Forest {
    /// Creates one set per agent.
    pub(super) fn new(num_agents: usize) -> Self {
        Self {
            parents: (0..num_agents as u32).collect(),
            count: num_agents,
        }
    }

    /// Returns the number of sets.
    pub(in crate::neighbor) fn count(&self) -> usize {
        self.count
    }

    /// Returns the label of every agent's set in the order of ids. A label is the lowest id in the set.
    pub(in crate::neighbor) fn labels<const D: usize>(mut self, agents: &Agents<D>) -> Vec<u32> {
        let mut lowest = vec![u32::MAX; agents.len()];
        for (place, &id) in agents.ids().iter().enumerate() {
            let root = self.find(place);
            lowest[root] = lowest[root].min(id);
        }
        let mut labels = vec![0; agents.num_agents()];
        for (place, &id) in agents.ids().iter().enumerate() {
            labels[id as usize] = lowest[self.find(place)];
        }
        labels
    }

    /// Adds an agent that is alone in its set to the set whose root is `root`.
    #[inline(always)]
    pub(super) fn add(&mut self, root: usize, place: usize) {
        self.parents[place] = root as u32;
        self.count -= 1;
    }

    fn find(&mut self, place: usize) -> usize {
        let mut place = place as u32;
        loop {
            let parent = self.parents[place as usize];
            if parent == place {
                return place as usize;
            }
            let next = self.parents[parent as usize];
            self.parents[place as usize] = next;
            place = next;
        }
    }

    fn union(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        if a != b {
            self.parents[a.max(b)] = a.min(b) as u32;
            self.count -= 1;
        }
    }
}
