//! Analysis of the neighbor graph: neighbors and connected components of a flock at one time, matrices of a line.

mod matrices;

use crate::agents::Agents;
use crate::base::check::length;
use crate::base::error::Result;
use crate::base::vector::rows;
use crate::flock::{FlockConfig, check_ranges};
use crate::neighbor::{NeighborOptions, Neighborhood, Ranges};

pub use matrices::{laplacian, perron_matrix};

/// The neighbor graph of a flock at one time: agents that an array or a record has. Arrays are flat, in row-major
/// order.
///
/// ```
/// use flockesc_core::NeighborGraph;
///
/// let graph = NeighborGraph {
///     scenario: None,
///     dimension: 2,
///     positions: vec![0.0, 0.0, 1.0, 0.0, 5.0, 0.0],
///     velocities: vec![1.0, 0.0, 1.0, 0.0, 1.0, 0.0],
///     ranges: vec![1.0],
/// };
/// assert_eq!(graph.pairs()?, [(0, 1), (1, 0)]);
/// assert_eq!(graph.component_labels()?, [0, 0, 2]);
/// # Ok::<(), flockesc_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct NeighborGraph {
    /// The scenario with the neighbor rule; its options `frozen_graph` and `blocks_warnings` have no effect. `None`: all
    /// agents within range are neighbors.
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

impl NeighborGraph {
    /// Returns the number of agents.
    pub fn num_agents(&self) -> usize {
        self.positions.len() / self.dimension
    }

    /// Returns the pairs (agent, neighbor) of different agents, in ascending order.
    ///
    /// # Errors
    /// [`crate::Error::Input`] if a range is negative or not finite, or if there is not one range per agent;
    /// [`crate::Error::Memory`] for the pairs.
    pub fn pairs(&self) -> Result<Vec<(u32, u32)>> {
        let mut pairs = match self.dimension {
            2 => self.pairs_by_id::<2>()?,
            _ => self.pairs_by_id::<3>()?,
        };
        pairs.sort_unstable();
        Ok(pairs)
    }

    /// Returns a label per agent: the lowest id in the weakly connected component of the agent.
    ///
    /// # Errors
    /// As [`Self::pairs`].
    pub fn component_labels(&self) -> Result<Vec<u32>> {
        match self.dimension {
            2 => self.labels::<2>(),
            _ => self.labels::<3>(),
        }
    }

    fn pairs_by_id<const D: usize>(&self) -> Result<Vec<(u32, u32)>> {
        let (agents, neighborhood) = self.neighborhood::<D>()?;
        neighborhood.pairs_by_id(&agents, Ranges::from(&self.ranges[..]))
    }

    fn labels<const D: usize>(&self) -> Result<Vec<u32>> {
        let (agents, neighborhood) = self.neighborhood::<D>()?;
        Ok(neighborhood.component_labels(&agents, Ranges::from(&self.ranges[..])))
    }

    /// Checks the ranges, and returns the agents with their neighborhood.
    fn neighborhood<const D: usize>(&self) -> Result<(Agents<D>, Neighborhood<D>)> {
        let field = "interaction_range";
        if self.ranges.len() != 1 {
            length(field, self.ranges.len(), self.num_agents(), "ranges", "")?;
        }
        check_ranges(field, &self.ranges)?;
        let vectors = |flat| rows(flat).collect::<Vec<_>>();
        let mut agents = Agents::new(&vectors(&self.positions), &vectors(&self.velocities));
        let config = self.scenario.as_ref();
        if let Some(side) = config.and_then(|config| config.periodic_side) {
            agents.wrap(side);
        }
        let options = NeighborOptions {
            is_frozen: false,
            blocks_warnings: false,
            ..config.map_or(NeighborOptions::METRIC, FlockConfig::neighbor_options)
        };
        let neighborhood = Neighborhood::new(options, &mut agents);
        Ok((agents, neighborhood))
    }
}
