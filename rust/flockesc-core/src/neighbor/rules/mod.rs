//! The neighbor rules.

pub(super) mod rule;
mod topological;
mod voronoi;

use serde::{Deserialize, Serialize};
use strum::{AsRefStr, VariantNames};

use crate::base::error::Result;
use crate::neighbor::ranges::Ranges;
use rule::{Criterion, RuleInput, RuleOutput};

/// The rule that determines which agents are neighbors. Every agent is its own neighbor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, AsRefStr, VariantNames)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum NeighborRule {
    /// All agents within the interaction range, boundary included.
    Metric(Metric),
    /// The k nearest agents in view, ties included. The interaction range is k.
    Topological(Topological),
    /// The agents within the interaction range whose Voronoi cells share an edge with the agent's. For D = 2.
    Voronoi(Voronoi),
}

/// The paper's rule: all agents within the interaction range, boundary included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Metric {}

/// The k nearest agents in view, ties included. The interaction range is k.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Topological {}

/// The agents within the interaction range whose Voronoi cells share an edge with the agent's. For D = 2.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Voronoi {}

impl NeighborRule {
    /// Names of all rules in a scenario.
    pub const KINDS: &'static [&'static str] = <Self as VariantNames>::VARIANTS;

    /// Checks that the rule is defined in a world with this dimension and periodic side.
    pub(crate) fn check(&self, dimension: usize, periodic_side: Option<f64>) -> Result<()> {
        match self {
            Self::Metric(_) | Self::Topological(_) => Ok(()),
            Self::Voronoi(_) => voronoi::check(dimension, periodic_side),
        }
    }

    /// Returns the criterion by which agents are neighbors.
    pub(super) fn criterion(&self) -> Criterion {
        match self {
            Self::Metric(_) => Criterion::Range,
            Self::Topological(_) => Criterion::Reach,
            Self::Voronoi(_) => Criterion::List,
        }
    }

    /// Computes the reaches and lists that the criterion needs. `output` has the results of the last step.
    pub(super) fn apply<const D: usize>(&self, input: &RuleInput<'_, D>, output: &mut RuleOutput) {
        match self {
            Self::Metric(_) => output.square_ranges(input),
            Self::Topological(_) => topological::find_reaches(input, output),
            Self::Voronoi(_) => {
                output.square_ranges(input);
                output.lists = voronoi::neighbors(input.distances.agents);
            }
        }
    }

    /// Returns the mean reach of a sample of the agents, in m.
    pub(super) fn typical_reach(&self, ranges: Ranges<'_>, output: &RuleOutput) -> f64 {
        match self {
            Self::Metric(_) | Self::Voronoi(_) => ranges.sample_mean(),
            Self::Topological(_) => topological::typical_reach(output),
        }
    }
}
