//! The rules that make agents neighbors: one per file, and the list of all.

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

/// Makes the list of all rules, and everything that matches on a rule.
macro_rules! rules {
    ($($(#[$about:meta])* $Variant:ident($Rule:ident),)+) => {
        /// The rule that makes agents neighbors; an agent is always its own.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, AsRefStr, VariantNames)]
        #[serde(rename_all = "snake_case")]
        #[strum(serialize_all = "snake_case")]
        pub enum NeighborRule {
            $($(#[$about])* $Variant($Rule),)+
        }

        impl NeighborRule {
            /// Names of all rules in a scenario.
            pub const KINDS: &'static [&'static str] = <Self as VariantNames>::VARIANTS;

            /// Refuses a world in which the rule is not defined.
            pub(crate) fn check(&self, dimension: usize, periodic_side: Option<f64>) -> Result<()> {
                match self {
                    $(Self::$Variant(rule) => rule.check(dimension, periodic_side),)+
                }
            }

            /// What makes another agent a neighbor.
            pub(in crate::neighbor) fn criterion(&self) -> Criterion {
                match self {
                    $(Self::$Variant(rule) => rule.criterion(),)+
                }
            }

            /// Finds what the criterion needs. The reaches found in the last step are still there.
            pub(in crate::neighbor) fn find<const D: usize>(
                &self,
                sensing: &Sensing<'_, D>,
                found: &mut Found,
            ) {
                match self {
                    $(Self::$Variant(rule) => rule.find(sensing, found),)+
                }
            }

            /// Mean reach over a sample of the agents, in m.
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
    /// The k nearest agents in view, and all that are as near as the last of them; an action sets k.
    Topological(Topological),
    /// The agents within the interaction range whose Voronoi cells share an edge with the agent's; in the plane only.
    Voronoi(Voronoi),
}
