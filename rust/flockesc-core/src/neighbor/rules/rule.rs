//! What the neighbor rules need and compute.

use crate::agents::{Column, GROUP};
use crate::neighbor::engine::distances::Distances;
use crate::neighbor::engine::lists::Lists;
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::ranges::Ranges;

/// The criterion by which visible agents are neighbors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Criterion {
    /// A neighbor is within the agent's interaction range.
    Range,
    /// A neighbor is within the reach that the rule computes for the agent.
    Reach,
    /// A neighbor is within this reach and in the list that the rule computes for the agent.
    List,
}

/// The input of a rule.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RuleInput<'a, const D: usize> {
    pub(crate) distances: Distances<'a, D>,
    pub(crate) tree: &'a Tree<D>,
    pub(crate) ranges: Ranges<'a>,
}

/// The output of a rule. Buffers are reused from step to step.
#[derive(Debug, Clone, Default)]
pub(crate) struct RuleOutput {
    /// Squared reaches in m^2 of the agents, group by group. Empty if the criterion is the interaction range.
    pub(crate) squares: Vec<Column<f64>>,
    pub(crate) lists: Lists,
    /// Search buffers, one per chunk of groups.
    pub(super) searches: Vec<SearchBuffers>,
}

/// Buffers of a search for the nearest agents.
#[derive(Debug, Clone, Default)]
pub(super) struct SearchBuffers {
    pub(super) leaves: Vec<u32>,
    /// Squared distances in m^2 of the agents in the search radius.
    pub(super) near: Vec<f64>,
}

impl SearchBuffers {
    /// Largest memory in bytes that is kept from step to step.
    const MOST_BYTES: usize = 1 << 17;

    /// Frees the buffers if they are too large to keep.
    pub(super) fn trim(&mut self) {
        let near = self.near.capacity() * size_of::<f64>();
        if near + self.leaves.capacity() * size_of::<u32>() > Self::MOST_BYTES {
            *self = Self::default();
        }
    }
}

impl RuleOutput {
    /// Sets the reach of every agent to its interaction range.
    pub(super) fn square_ranges<const D: usize>(&mut self, input: &RuleInput<'_, D>) {
        let agents = input.distances.agents;
        self.squares.resize(agents.groups.len(), [0.0; GROUP]);
        for (group, squares) in self.squares.iter_mut().enumerate() {
            input.ranges.square(agents.ids_of(group), squares);
        }
    }
}
