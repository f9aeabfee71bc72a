//! Scenarios and environment options: parsed from one JSON document each, then checked field by field.

mod episode;
mod flock;
mod line;
#[cfg(test)]
pub(crate) mod tests;

pub use episode::{EpisodeConfig, Objective, SameRange, SensingRange, View};
pub use flock::FlockConfig;
pub use line::LineConfig;
