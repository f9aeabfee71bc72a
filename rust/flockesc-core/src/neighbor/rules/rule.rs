//! `Rule`: the trait of a neighbor rule.

use crate::agents::{Agents, Column, GROUP, TILE};
use crate::base::error::Result;
use crate::neighbor::engine::field_of_view::{FieldOfView, Torus};
use crate::neighbor::engine::lists::Lists;
use crate::neighbor::engine::select::TileColumn;
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::ranges::Ranges;

/// The criterion by which visible agents are neighbors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::neighbor) enum Criterion {
    /// A neighbor is within the agent's interaction range.
    Range,
    /// A neighbor is within the reach that the rule computes for the agent.
    Reach,
    /// A neighbor is within this reach and in the list that the rule computes for the agent.
    List,
}

/// The input of a rule.
#[derive(Debug, Clone, Copy)]
pub(in crate::neighbor) struct Sensing<'a, const D: usize> {
    pub(in crate::neighbor) agents: &'a Agents<D>,
    pub(in crate::neighbor) tree: &'a Tree<D>,
    pub(in crate::neighbor) field_of_view: FieldOfView,
    pub(in crate::neighbor) torus: Torus,
    pub(in crate::neighbor) ranges: Ranges<'a>,
}

/// The output of a rule. Buffers are reused from step to step.
#[derive(Debug, Clone, Default)]
pub(in crate::neighbor) struct Found {
    /// Squared reaches in m^2 of the agents, group by group. Empty if the criterion is the interaction range.
    pub(in crate::neighbor) squares: Vec<Column<f64>>,
    pub(in crate::neighbor) lists: Lists,
    /// Search buffers, one per chunk of groups.
    pub(in crate::neighbor) searches: Vec<SearchBuffers>,
}

/// Buffers of a search for the nearest agents.
#[derive(Debug, Clone, Default)]
pub(in crate::neighbor) struct SearchBuffers {
    pub(in crate::neighbor) tiles: Vec<u32>,
    /// Squared distances in m^2 of the agents of one tile from other agents, one row per other agent.
    pub(in crate::neighbor) distances: Vec<TileColumn<f64>>,
}

impl SearchBuffers {
    /// Largest memory in bytes that is kept from step to step.
    const MOST_BYTES: usize = 1 << 17;

    /// Returns the memory in bytes that the buffers of a chunk keep in a flock of this many agents.
    pub(super) fn most_bytes(num_agents: usize) -> usize {
        let per_agent = size_of::<TileColumn<f64>>() + size_of::<u32>();
        Self::MOST_BYTES.min(2 * (num_agents + TILE) * per_agent)
    }

    /// Frees the buffers if they are too large to keep.
    pub(super) fn trim(&mut self) {
        let distances = self.distances.capacity() * size_of::<TileColumn<f64>>();
        if distances + self.tiles.capacity() * size_of::<u32>() > Self::MOST_BYTES {
            *self = Self::default();
        }
    }
}

impl Found {
    /// Sets the reach of every agent to its interaction range.
    pub(in crate::neighbor) fn square_ranges<const D: usize>(&mut self, sensing: &Sensing<'_, D>) {
        self.squares
            .resize(sensing.agents.groups.len(), [0.0; GROUP]);
        for (group, squares) in self.squares.iter_mut().enumerate() {
            sensing.ranges.square(sensing.agents.ids_of(group), squares);
        }
    }
}

/// A neighbor rule.
pub(in crate::neighbor) trait Rule {
    /// Checks that the rule is defined in a world with this dimension and periodic side.
    fn check(&self, _dimension: usize, _periodic_side: Option<f64>) -> Result<()> {
        Ok(())
    }

    /// Returns the criterion by which agents are neighbors.
    fn criterion(&self) -> Criterion;

    /// Returns the memory in bytes of lists and buffers for this many agents.
    fn bytes(&self, _num_agents: usize) -> usize {
        0
    }

    /// Computes the reaches or lists that the criterion needs. `found` has the results of the last step.
    fn find<const D: usize>(&self, sensing: &Sensing<'_, D>, found: &mut Found) {
        found.square_ranges(sensing);
    }

    /// Returns the mean reach of a sample of the agents, in m.
    fn typical_reach(&self, ranges: Ranges<'_>, _found: &Found) -> f64 {
        ranges.sample_mean()
    }
}
