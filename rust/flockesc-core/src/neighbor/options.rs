//! `NeighborOptions`: the neighbor rule and the conditions that apply to every rule.

use crate::agents::Agents;
use crate::neighbor::engine::distances::Distances;
use crate::neighbor::engine::field_of_view::{FieldOfView, Torus};
use crate::neighbor::rules::NeighborRule;
use crate::neighbor::rules::rule::Criterion;

/// Parameters of the neighbor graph.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NeighborOptions {
    pub(crate) rule: NeighborRule,
    pub(crate) field_of_view: FieldOfView,
    pub(crate) torus: Torus,
    /// Whether agents are neighbors only if each is a neighbor of the other.
    pub(crate) is_mutual: bool,
    /// Whether the graph of the first step is kept.
    pub(crate) is_frozen: bool,
    /// Whether agents that no predator has reached hear no agent that one has reached.
    pub(crate) blocks_warnings: bool,
    /// Whether a step iterates over pairs of neighbors.
    pub(crate) needs_pairs: bool,
}

impl NeighborOptions {
    /// The paper's options: all agents within range are neighbors.
    pub(crate) const METRIC: Self = Self {
        rule: NeighborRule::Metric {},
        field_of_view: FieldOfView::ALL_ROUND,
        torus: Torus::NONE,
        is_mutual: false,
        is_frozen: false,
        blocks_warnings: false,
        needs_pairs: false,
    };

    /// Returns the distances between agents in the world of these options.
    pub(crate) fn distances<const D: usize>(self, agents: &Agents<D>) -> Distances<'_, D> {
        Distances {
            agents,
            field_of_view: self.field_of_view,
            torus: self.torus,
        }
    }

    /// Returns whether neighbors are determined by distances alone, so that nodes of the tree can be added at
    /// once.
    pub(crate) fn is_by_reach(&self) -> bool {
        self.is_by_view() && self.field_of_view == FieldOfView::ALL_ROUND
    }

    /// Returns whether neighbors are determined by distances and the agents' own fields of view.
    pub(crate) fn is_by_view(&self) -> bool {
        let is_plain = !self.is_mutual && !self.is_frozen && !self.blocks_warnings;
        is_plain && self.rule.criterion() != Criterion::List
    }

    /// Estimates the cost of a step per agent of a flock of n under `range`, in units of the cost under the
    /// metric rule. Each of the k nearest agents costs 1, and each of the n pairs of an agent 1/16.
    pub(crate) fn work_per_agent(&self, n: usize, range: f64) -> usize {
        let nearest = match self.rule.criterion() {
            Criterion::Reach => n.min(range as usize),
            Criterion::Range | Criterion::List => 0,
        };
        let is_by_pairs = !self.is_by_reach() || self.needs_pairs;
        1 + nearest + if is_by_pairs { n / 16 } else { 0 }
    }
}
