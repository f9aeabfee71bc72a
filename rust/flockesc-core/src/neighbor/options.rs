//! All that a scenario says of the neighbor graph: the rule, and what holds on top of any rule.

use crate::neighbor::engine::field_of_view::{Sight, Torus};
use crate::neighbor::rules::NeighborRule;

/// All that a scenario says of the neighbor graph.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NeighborOptions {
    pub(crate) rule: NeighborRule,
    pub(crate) sight: Sight,
    pub(crate) torus: Torus,
    /// Whether only agents that would both listen to each other are neighbors.
    pub(crate) is_mutual: bool,
    /// Whether the graph of the first step stays.
    pub(crate) is_frozen: bool,
    /// Whether [`Neighborhood::pairs`](super::Neighborhood::pairs) is asked for.
    pub(crate) visits: bool,
}

impl NeighborOptions {
    /// The paper's: all agents within range.
    pub(crate) const METRIC: Self = Self {
        rule: NeighborRule::Metric {},
        sight: Sight::ALL_ROUND,
        torus: Torus::NONE,
        is_mutual: false,
        is_frozen: false,
        visits: false,
    };

    /// Whether squared ranges alone decide who is a neighbor, so that whole nodes of the tree can be taken at once.
    pub(in crate::neighbor) fn is_by_reach(&self) -> bool {
        let is_rule_by_reach = match self.rule {
            NeighborRule::Metric {} | NeighborRule::Topological {} => true,
            NeighborRule::Voronoi {} => false,
        };
        is_rule_by_reach
            && self.sight == Sight::ALL_ROUND
            && self.torus == Torus::NONE
            && !self.is_mutual
            && !self.is_frozen
    }

    /// About how many others a step looks at for each of n agents, where one is as dear as an agent that a step takes with
    /// its whole node: pairs by ones cost a sixteenth.
    pub(crate) fn visits_per_agent(&self, n: usize) -> usize {
        if self.is_by_reach() && !self.visits {
            1
        } else {
            1 + n / 16
        }
    }
}
