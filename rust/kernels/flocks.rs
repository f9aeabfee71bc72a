//! Flocks of the benchmarks.

use std::sync::Arc;

use flockesc_core::{FlockConfig, InitialState, World};

/// Density of the paper's flock, in agents per m^2.
const DENSITY: f64 = 0.03;
/// Number of steps of an episode of the benchmarks.
pub(crate) const EPISODE: usize = 240;

/// Returns the paper's flock with another number of agents at the same density.
pub(crate) fn flock(num_agents: usize, dimension: usize) -> FlockConfig {
    FlockConfig {
        num_agents,
        dimension,
        num_steps: EPISODE,
        initial_side: (num_agents as f64 / DENSITY).sqrt(),
        ..FlockConfig::default()
    }
}

/// Returns a world at the start of an episode.
pub(crate) fn world<const D: usize>(scenario: FlockConfig) -> World<D> {
    World::new(Arc::new(scenario), &InitialState::seeded(7))
}
