//! The neighbor graph, for analysis: neighbors and components of a flock, matrices of a line.

mod matrices;
mod neighbors;

pub use matrices::{laplacian, perron_matrix};
pub use neighbors::NeighborGraph;
