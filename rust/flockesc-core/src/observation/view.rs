//! `View`: one observation for the flock, or one per agent.

use serde::{Deserialize, Serialize};
use strum::VariantNames;

use crate::flock::FlockConfig;

/// Whether an episode has one observation and one range for the flock, or one per agent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, VariantNames)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum View {
    /// One row for the flock.
    Flock,
    /// One row per agent, in the agent's body frame.
    Agent,
}

impl View {
    /// Returns whether there is one observation row and one range per agent, or one for the flock.
    pub fn is_per_agent(self) -> bool {
        match self {
            Self::Flock => false,
            Self::Agent => true,
        }
    }

    /// Returns the number of observation rows and ranges of a flock.
    pub fn rows(self, scenario: &FlockConfig) -> usize {
        if self.is_per_agent() {
            scenario.num_agents
        } else {
            1
        }
    }
}
