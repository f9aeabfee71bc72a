//! The neighbor graph: connected components, Perron matrix, Laplacian.

mod components;
mod matrices;

pub(crate) use components::num_components;
pub use matrices::{laplacian, perron_matrix};
