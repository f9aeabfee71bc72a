//! What an episode is about.

use serde::Deserialize;

/// What is to be kept large: a predator distance, or the flock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Objective {
    /// The mean over agents (Eq. 12).
    Mean,
    /// The minimum over agents (Eq. 13).
    Minimum,
    /// The share of agents that have not been caught.
    Survival,
}
