//! `GraphArguments`: a flock in flat arrays, whose neighbor graph the bindings compute.

use super::NeighborGraph;
use crate::base::error::Result;
use crate::base::vector::rows;
use crate::flock::FlockConfig;
use crate::neighbor::Ranges;

/// The arguments of a function on the neighbor graph of a flock. Arrays are flat, in row-major order.
#[derive(Debug)]
pub struct GraphArguments {
    /// The scenario with the neighbor rule. `None`: metric neighbors.
    pub scenario: Option<FlockConfig>,
    /// Number of coordinates of a vector, 2 or 3.
    pub dimension: usize,
    /// r_i in m, n * D entries.
    pub positions: Vec<f64>,
    /// v_i in m/s, n * D entries.
    pub velocities: Vec<f64>,
    /// Ranges in m, 1 or n entries.
    pub ranges: Vec<f64>,
}

impl GraphArguments {
    /// Returns the number of agents.
    #[must_use]
    pub fn num_agents(&self) -> usize {
        self.positions.len() / self.dimension
    }

    /// As [`NeighborGraph::pairs`].
    ///
    /// # Errors
    /// As [`NeighborGraph::pairs`].
    pub fn pairs(&self) -> Result<Vec<(u32, u32)>> {
        match self.dimension {
            2 => self.graph::<2>().pairs(self.ranges()),
            _ => self.graph::<3>().pairs(self.ranges()),
        }
    }

    /// As [`NeighborGraph::component_labels`].
    ///
    /// # Errors
    /// As [`NeighborGraph::pairs`].
    pub fn component_labels(&self) -> Result<Vec<u32>> {
        match self.dimension {
            2 => self.graph::<2>().component_labels(self.ranges()),
            _ => self.graph::<3>().component_labels(self.ranges()),
        }
    }

    fn graph<const D: usize>(&self) -> NeighborGraph<D> {
        let positions: Vec<_> = rows(&self.positions).collect();
        let velocities: Vec<_> = rows(&self.velocities).collect();
        NeighborGraph::new(self.scenario.as_ref(), &positions, &velocities)
    }

    fn ranges(&self) -> Ranges<'_> {
        match self.ranges[..] {
            [range] => Ranges::Shared(range),
            _ => Ranges::PerAgent(&self.ranges),
        }
    }
}
