//! The neighbor graph, for analysis: components of a flock, matrices of a line.

mod components;
mod matrices;

pub use components::component_labels;
pub use matrices::{laplacian, perron_matrix};
