//! Scenarios and environment options: parsed from one JSON document each, then checked field by field.

mod episode;
mod line;

pub use episode::{EpisodeConfig, Objective, SameRange, SensingRange, View};
pub use line::LineConfig;
