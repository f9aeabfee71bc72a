//! How far a predator is seen.

use serde::{Deserialize, Serialize};

use crate::flock::FlockConfig;

/// Distance up to which a predator is seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SensingRange {
    /// rho_p of the episode's scenario.
    PredatorRange,
    /// In m.
    #[serde(untagged)]
    Length(f64),
}

impl SensingRange {
    /// Whether a predator is seen from this distance in m.
    pub(crate) fn reaches(self, distance: f64, scenario: &FlockConfig) -> bool {
        match self {
            Self::PredatorRange => distance <= scenario.predator_range,
            Self::Length(range) => distance <= range,
        }
    }
}
