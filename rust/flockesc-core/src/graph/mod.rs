//! Analysis of the neighbor graph: neighbors and connected components of a flock, matrices of a line.

mod matrices;
mod neighbors;

pub use matrices::{laplacian, perron_matrix};
pub use neighbors::{GraphArguments, NeighborGraph};
