//! `View`: one observation for the flock, or one per agent.

use serde::{Deserialize, Serialize};

/// Whether an episode has one observation and one range for the flock, or one per agent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, strum::VariantNames)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum View {
    /// One row for the flock.
    Flock,
    /// One row per agent, in the agent's body frame.
    Agent,
}

impl View {
    /// Names of all views in documents.
    pub const KINDS: &[&str] = <Self as strum::VariantNames>::VARIANTS;
}
