//! Whose eyes an observation is made for.

use serde::Deserialize;

/// Whose eyes an observation is made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum View {
    /// One summary per flock.
    Flock,
    /// One row per agent, in its own frame.
    Agent,
}
