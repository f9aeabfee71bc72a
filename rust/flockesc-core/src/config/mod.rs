//! Scenarios and environment options: parsed from one JSON document each, then checked field by field.

mod episode;

pub use episode::{EpisodeConfig, Objective, SameRange, SensingRange, View};
