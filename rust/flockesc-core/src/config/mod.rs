//! Scenarios and environment options: parsed from one JSON document each, then checked field by field.

mod bounds;
mod document;
mod episode;
mod flock;
mod line;
#[cfg(test)]
pub(crate) mod tests;

pub(crate) use bounds::{
    LARGEST, coordinates, finite, not_negative, positive, positive_quantity, quantity, vector,
    within, within_bounds,
};
pub(crate) use document::parse;
pub use episode::{EpisodeConfig, Objective, SameRange, SensingRange, View};
pub use flock::FlockConfig;
pub use line::LineConfig;

/// Largest flock or line that a scenario may name; guards against allocations no machine has.
pub const MAX_AGENTS: usize = 10_000_000;
/// Largest number of steps that a scenario may name.
pub const MAX_STEPS: usize = 1_000_000_000;
