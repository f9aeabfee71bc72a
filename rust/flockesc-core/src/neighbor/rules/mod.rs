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
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[strum(serialize_all = "snake_case")]
pub enum NeighborRule {
    /// All agents within the interaction range, boundary included.
    Metric {},
    /// The k nearest agents in view, ties included. The interaction range is k.
    Topological {},
    /// The agents within the interaction range whose Voronoi cells share an edge with the agent's. For D = 2.
    Voronoi {},
}

impl NeighborRule {
    /// Checks that the rule is defined in a world with this dimension and periodic side.
    pub(crate) fn check(&self, dimension: usize, periodic_side: Option<f64>) -> Result<()> {
        match self {
            Self::Metric {} | Self::Topological {} => Ok(()),
            Self::Voronoi {} => voronoi::check(dimension, periodic_side),
        }
    }

    /// Returns the criterion by which agents are neighbors.
    pub(super) fn criterion(&self) -> Criterion {
        match self {
            Self::Metric {} => Criterion::Range,
            Self::Topological {} => Criterion::Reach,
            Self::Voronoi {} => Criterion::List,
        }
    }

    /// Computes the reaches and lists that the criterion needs. `output` has the results of the last step.
    pub(super) fn apply<const D: usize>(&self, input: &RuleInput<'_, D>, output: &mut RuleOutput) {
        match self {
            Self::Metric {} => output.square_ranges(input),
            Self::Topological {} => topological::find_reaches(input, output),
            Self::Voronoi {} => {
                output.square_ranges(input);
                output.lists = voronoi::neighbors(input.distances.agents);
            }
        }
    }

    /// Returns the mean reach of a sample of the agents, in m.
    pub(super) fn typical_reach(&self, ranges: Ranges<'_>, output: &RuleOutput) -> f64 {
        match self {
            Self::Metric {} | Self::Voronoi {} => ranges.sample_mean(),
            Self::Topological {} => topological::typical_reach(output),
        }
    }
}
