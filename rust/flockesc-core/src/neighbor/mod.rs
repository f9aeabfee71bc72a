//! Who listens to whom. Everything that depends on the neighbor rule goes through [`Neighborhood`].

mod metric;

use nalgebra::SVector;
use serde::Deserialize;

use crate::graph;

/// The rule that makes agents neighbors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum NeighborRule {
    /// All agents within the interaction range, boundary and self included.
    Metric {},
}

/// Interaction ranges rho in m: one for the flock, or one per agent.
#[derive(Debug, Clone, Copy)]
pub enum Ranges<'a> {
    /// The same range for every agent.
    Shared(f64),
    /// Entry i is the range of agent i; the neighbor graph is then directed.
    PerAgent(&'a [f64]),
}

impl Ranges<'_> {
    pub(crate) fn of(&self, agent: usize) -> f64 {
        match self {
            Self::Shared(range) => *range,
            Self::PerAgent(ranges) => ranges[agent],
        }
    }
}

/// What every agent heard: <v>_i and |N_i|.
#[derive(Debug, Clone)]
pub(crate) struct Neighborhood<const D: usize> {
    rule: NeighborRule,
    /// <v>_i, mean velocity over N_i, in m/s.
    pub(crate) mean_velocity: Vec<SVector<f64, D>>,
    /// |N_i|, agent i itself included.
    pub(crate) count: Vec<f64>,
}

impl<const D: usize> Neighborhood<D> {
    /// What agents have heard before their first step: themselves alone.
    pub(crate) fn silent(rule: NeighborRule, velocities: &[SVector<f64, D>]) -> Self {
        Self {
            rule,
            mean_velocity: velocities.to_vec(),
            count: vec![1.0; velocities.len()],
        }
    }

    /// Finds every agent's neighbors and averages their velocities (Eq. 11).
    pub(crate) fn listen(
        &mut self,
        positions: &[SVector<f64, D>],
        velocities: &[SVector<f64, D>],
        ranges: Ranges<'_>,
    ) {
        match self.rule {
            NeighborRule::Metric {} => {
                metric::for_each_listener(positions, velocities, ranges, |agent, mean, count| {
                    self.mean_velocity[agent] = mean;
                    self.count[agent] = count;
                });
            }
        }
    }

    /// Number of weakly connected components of the neighbor graph.
    pub(crate) fn num_components(
        &self,
        positions: &[SVector<f64, D>],
        ranges: Ranges<'_>,
    ) -> usize {
        match self.rule {
            NeighborRule::Metric {} => graph::num_components(positions.len(), |i, j| {
                let range = ranges.of(i).max(ranges.of(j));
                (positions[i] - positions[j]).norm_squared() <= range * range
            }),
        }
    }
}
