//! Neighbor rules, one per file.

mod metric;
pub(super) mod rule;
mod topological;
mod voronoi;

use serde::{Deserialize, Serialize};
use strum::{AsRefStr, VariantNames};

use crate::base::error::Result;
use crate::neighbor::ranges::Ranges;
pub use metric::Metric;
use rule::{Criterion, Found, Rule, Sensing};
pub use topological::Topological;
pub use voronoi::Voronoi;

/// Generates [`NeighborRule`] and its methods from the list of all rules.
macro_rules! rules {
    ($($(#[$about:meta])* $Variant:ident($Rule:ident),)+) => {
        /// The rule that determines which agents are neighbors. Every agent is its own neighbor.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, AsRefStr, VariantNames)]
        #[serde(rename_all = "snake_case")]
        #[strum(serialize_all = "snake_case")]
        pub enum NeighborRule {
            $($(#[$about])* $Variant($Rule),)+
        }

        impl NeighborRule {
            /// Names of all rules in a scenario.
            pub const KINDS: &'static [&'static str] = <Self as VariantNames>::VARIANTS;

            /// Checks that the rule is defined in a world with this dimension and periodic side.
            pub(crate) fn check(&self, dimension: usize, periodic_side: Option<f64>) -> Result<()> {
                match self {
                    $(Self::$Variant(rule) => rule.check(dimension, periodic_side),)+
                }
            }

            /// Returns the criterion by which agents are neighbors.
            pub(in crate::neighbor) fn criterion(&self) -> Criterion {
                match self {
                    $(Self::$Variant(rule) => rule.criterion(),)+
                }
            }

            /// Returns the memory in bytes of lists and buffers for this many agents.
            pub(in crate::neighbor) fn bytes(&self, num_agents: usize) -> usize {
                match self {
                    $(Self::$Variant(rule) => rule.bytes(num_agents),)+
                }
            }

            /// Computes the reaches or lists that the criterion needs. `found` has the results of the last
            /// step.
            pub(in crate::neighbor) fn find<const D: usize>(
                &self,
                sensing: &Sensing<'_, D>,
                found: &mut Found,
            ) {
                match self {
                    $(Self::$Variant(rule) => rule.find(sensing, found),)+
                }
            }

            /// Returns the mean reach of a sample of the agents, in m.
            pub(in crate::neighbor) fn typical_reach(&self, ranges: Ranges<'_>, found: &Found) -> f64 {
                match self {
                    $(Self::$Variant(rule) => rule.typical_reach(ranges, found),)+
                }
            }
        }
    };
}

rules! {
    /// All agents within the interaction range, boundary included.
    Metric(Metric),
    /// The k nearest agents in view, ties included. The interaction range is k.
    Topological(Topological),
    /// The agents within the interaction range whose Voronoi cells share an edge with the agent's. For D = 2.
    Voronoi(Voronoi),
}
