//! Who observes.

use serde::{Deserialize, Serialize};

/// Who observes, and gets a range per action: the flock as a whole, or every agent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, strum::VariantNames)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum View {
    /// One summary per flock.
    Flock,
    /// One row per agent, in its own frame.
    Agent,
}

impl View {
    /// The names of all views in documents.
    pub const KINDS: &[&str] = <Self as strum::VariantNames>::VARIANTS;
}
