//! Matrices of the neighbor graph of a line, for analysis.

mod matrices;

pub use matrices::{laplacian, perron_matrix};
