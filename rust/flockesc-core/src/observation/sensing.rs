//! The distance up to which agents sense a predator.

use serde::{Deserialize, Serialize};

use crate::flock::FlockConfig;

/// Distance up to which agents sense a predator.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SensingRange {
    /// The predator range rho_p of the episode's scenario.
    PredatorRange,
    /// A length in m.
    #[serde(untagged)]
    Length(f64),
}

impl SensingRange {
    /// Returns whether an agent senses a predator at this distance in m.
    pub(crate) fn reaches(self, distance: f64, scenario: &FlockConfig) -> bool {
        match self {
            Self::PredatorRange => distance <= scenario.predator_range,
            Self::Length(range) => distance <= range,
        }
    }
}
