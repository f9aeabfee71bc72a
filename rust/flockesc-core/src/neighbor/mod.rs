//! The neighbor graph of a flock, and the sums over neighbors' velocities (Eq. 11).

mod engine;
mod neighborhood;
mod options;
mod profile;
mod ranges;
mod rules;
#[cfg(test)]
mod tests;

pub(crate) use engine::field_of_view::{FieldOfView, Torus};
pub(crate) use engine::offsets::OffsetBuffers;
pub(crate) use engine::pairs::Pairs;
pub(crate) use engine::sums::NeighborSums;
pub(crate) use neighborhood::{Neighborhood, NeighborhoodState};
pub(crate) use options::NeighborOptions;
pub(crate) use profile::Profile;
pub use ranges::Ranges;
pub use rules::NeighborRule;
