//! Analysis of the neighbor graph: neighbors and connected components of a flock at one time, matrices of a line.

mod matrices;

use nalgebra::SVector;

use crate::agents::Agents;
use crate::base::error::{Error, Result};
use crate::base::vector::rows;
use crate::flock::{FlockConfig, check_ranges};
use crate::neighbor::{NeighborOptions, Neighborhood, Ranges};

pub use matrices::{laplacian, perron_matrix};

/// The neighbor graph of a flock at one time, for any interaction ranges.
///
/// ```
/// use flockesc_core::{NeighborGraph, Ranges};
/// use nalgebra::vector;
///
/// let positions = [vector![0.0, 0.0], vector![1.0, 0.0], vector![5.0, 0.0]];
/// let velocities = [vector![1.0, 0.0]; 3];
/// let graph = NeighborGraph::new(None, &positions, &velocities);
/// assert_eq!(graph.pairs(Ranges::Shared(1.0))?, [(0, 1), (1, 0)]);
/// assert_eq!(graph.component_labels(Ranges::Shared(1.0))?, [0, 0, 2]);
/// # Ok::<(), flockesc_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct NeighborGraph<const D: usize> {
    agents: Agents<D>,
    neighborhood: Neighborhood<D>,
}

impl<const D: usize> NeighborGraph<D> {
    /// Creates the graph of agents at `positions` in m with `velocities` in m/s, by the neighbor rule of a
    /// scenario. Without a scenario, all agents within range are neighbors. The options `frozen_graph` and
    /// `blocks_warnings` have no effect.
    pub fn new(
        config: Option<&FlockConfig>,
        positions: &[SVector<f64, D>],
        velocities: &[SVector<f64, D>],
    ) -> Self {
        let mut agents = Agents::new(positions, velocities);
        if let Some(side) = config.and_then(|config| config.periodic_side) {
            agents.wrap(side);
        }
        let options = NeighborOptions {
            is_frozen: false,
            blocks_warnings: false,
            ..config.map_or(NeighborOptions::METRIC, FlockConfig::neighbor_options)
        };
        Self {
            neighborhood: Neighborhood::new(options, &mut agents),
            agents,
        }
    }

    /// Returns the pairs (agent, neighbor) of different agents, in ascending order.
    ///
    /// # Errors
    /// [`Error::Input`] if a range is negative or not finite, or if there is not one range per agent;
    /// [`Error::Memory`] for the pairs.
    pub fn pairs(&self, ranges: Ranges<'_>) -> Result<Vec<(u32, u32)>> {
        self.check(ranges)?;
        let mut pairs = self.neighborhood.pairs_by_id(&self.agents, ranges)?;
        pairs.sort_unstable();
        Ok(pairs)
    }

    /// Returns a label per agent: the lowest id in the weakly connected component of the agent.
    ///
    /// # Errors
    /// As [`Self::pairs`].
    pub fn component_labels(&self, ranges: Ranges<'_>) -> Result<Vec<u32>> {
        self.check(ranges)?;
        Ok(self.neighborhood.component_labels(&self.agents, ranges))
    }

    fn check(&self, ranges: Ranges<'_>) -> Result<()> {
        let (given, expected) = match ranges {
            Ranges::Shared(range) => (&[range][..], 1),
            Ranges::PerAgent(ranges) => (ranges, self.agents.len()),
        };
        if given.len() != expected {
            let (expected, given) = (
                format!("{expected} ranges"),
                format!("{} ranges", given.len()),
            );
            return Err(Error::input("interaction_range", expected, given));
        }
        check_ranges("interaction_range", given)
    }
}

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
