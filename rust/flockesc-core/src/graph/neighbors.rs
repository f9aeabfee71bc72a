//! Who listens to whom in a flock at one moment, and who hangs together with whom.

use nalgebra::SVector;

use crate::agents::Agents;
use crate::base::error::{Error, Result};
use crate::flock::{FlockConfig, check_ranges};
use crate::neighbor::{NeighborOptions, Neighborhood, Ranges};

/// A flock at one moment, and how its neighbor graph is made.
#[derive(Debug, Clone)]
pub struct NeighborGraph<const D: usize> {
    agents: Agents<D>,
    neighborhood: Neighborhood<D>,
}

impl<const D: usize> NeighborGraph<D> {
    /// The graph of agents at `positions` in m that move at `velocities` in m/s, as many, by the rule of a scenario;
    /// `None`: neighbors are those within range. A frozen graph is that of this moment.
    #[must_use]
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
            ..config.map_or(NeighborOptions::METRIC, FlockConfig::neighbor_options)
        };
        Self {
            neighborhood: Neighborhood::silent(options, &agents),
            agents,
        }
    }

    /// Pairs (listener, neighbor) of different agents, in order.
    ///
    /// # Errors
    /// [`Error::Argument`] for ranges that are negative, not finite or not one per agent.
    pub fn pairs(&self, ranges: Ranges<'_>) -> Result<Vec<(u32, u32)>> {
        self.check(ranges)?;
        let mut pairs = self.neighborhood.pairs_by_name(&self.agents, ranges);
        pairs.sort_unstable();
        Ok(pairs)
    }

    /// The weakly connected component of every agent, named by the lowest index in it.
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
            let expected = format!("{expected} ranges");
            return Err(Error::argument("interaction_range", expected, given.len()));
        }
        check_ranges("interaction_range", given)
    }
}
