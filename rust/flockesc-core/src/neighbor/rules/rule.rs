//! The trait of a neighbor rule.

use crate::agents::{Agents, Column, GROUP};
use crate::base::error::Result;
use crate::neighbor::engine::field_of_view::{FieldOfView, Torus};
use crate::neighbor::engine::lists::Lists;
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::ranges::Ranges;

/// What makes another agent a neighbor, if it is seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::neighbor) enum Criterion {
    /// It is within the interaction range.
    Range,
    /// It is within the reach that the rule finds for every agent.
    Reach,
    /// It is within that reach, and in the list that the rule makes for every agent.
    List,
}

/// A flock, and how its agents see each other.
#[derive(Debug, Clone, Copy)]
pub(in crate::neighbor) struct Sensing<'a, const D: usize> {
    pub(in crate::neighbor) agents: &'a Agents<D>,
    pub(in crate::neighbor) tree: &'a Tree<D>,
    pub(in crate::neighbor) field_of_view: FieldOfView,
    pub(in crate::neighbor) torus: Torus,
    pub(in crate::neighbor) ranges: Ranges<'a>,
}

/// What a rule has found; it keeps its memory from step to step.
#[derive(Debug, Clone, Default)]
pub(in crate::neighbor) struct Found {
    /// Squared reach in m^2 of the agents of every group; empty where interaction ranges suffice.
    pub(in crate::neighbor) squares: Vec<Column<f64>>,
    pub(in crate::neighbor) lists: Lists,
    /// Buffers of a search, one per chunk of groups.
    pub(in crate::neighbor) searches: Vec<SearchBuffers>,
}

/// Buffers of a search for the nearest agents.
#[derive(Debug, Clone, Default)]
pub(in crate::neighbor) struct SearchBuffers {
    pub(in crate::neighbor) tiles: Vec<u32>,
    /// Squared distances in m^2 as bits, which have the order of the numbers because none is negative.
    pub(in crate::neighbor) distances: Vec<u64>,
}

impl Found {
    /// Makes the interaction range the reach of every agent.
    pub(in crate::neighbor) fn square_ranges<const D: usize>(&mut self, sensing: &Sensing<'_, D>) {
        self.squares
            .resize(sensing.agents.groups.len(), [0.0; GROUP]);
        for (group, squares) in self.squares.iter_mut().enumerate() {
            sensing.ranges.square(sensing.agents.ids_of(group), squares);
        }
    }
}

/// A rule that makes agents neighbors.
pub(in crate::neighbor) trait Rule {
    /// Refuses a world in which the rule is not defined.
    fn check(&self, _dimension: usize, _periodic_side: Option<f64>) -> Result<()> {
        Ok(())
    }

    /// What makes another agent a neighbor.
    fn criterion(&self) -> Criterion;

    /// Finds what the criterion needs. The reaches found in the last step are still there.
    fn find<const D: usize>(&self, sensing: &Sensing<'_, D>, found: &mut Found) {
        found.square_ranges(sensing);
    }

    /// Mean reach over a sample of the agents, in m.
    fn typical_reach(&self, ranges: Ranges<'_>, _found: &Found) -> f64 {
        ranges.typical()
    }
}
