//! The options of a neighbor graph: the rule, and the conditions that apply to every rule.

use crate::neighbor::engine::field_of_view::{FieldOfView, Torus};
use crate::neighbor::rules::rule::Criterion;
use crate::neighbor::rules::{Metric, NeighborRule};

/// A scenario's parameters of the neighbor graph.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NeighborOptions {
    pub(crate) rule: NeighborRule,
    pub(crate) field_of_view: FieldOfView,
    pub(crate) torus: Torus,
    /// Whether agents are neighbors only if each is a neighbor of the other.
    pub(crate) is_mutual: bool,
    /// Whether the graph of the first step is kept.
    pub(crate) is_frozen: bool,
    /// Whether a step visits pairs of neighbors.
    pub(crate) visits: bool,
}

impl NeighborOptions {
    /// The paper's options: all agents within range are neighbors.
    pub(crate) const METRIC: Self = Self {
        rule: NeighborRule::Metric(Metric {}),
        field_of_view: FieldOfView::ALL_ROUND,
        torus: Torus::NONE,
        is_mutual: false,
        is_frozen: false,
        visits: false,
    };

    /// Whether distances alone decide who is a neighbor, so that whole nodes of the tree can be added at once.
    pub(in crate::neighbor) fn is_by_reach(&self) -> bool {
        self.rule.criterion() != Criterion::List
            && self.field_of_view == FieldOfView::ALL_ROUND
            && self.torus == Torus::NONE
            && !self.is_mutual
            && !self.is_frozen
    }

    /// Estimated work of a step per agent of a flock of n, in units of the work without pairs. A pair costs a sixteenth.
    pub(crate) fn visits_per_agent(&self, n: usize) -> usize {
        if self.is_by_reach() && !self.visits {
            1
        } else {
            1 + n / 16
        }
    }
}
