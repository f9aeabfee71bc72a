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
    /// In m.
    pub(crate) fn length(self, scenario: &FlockConfig) -> f64 {
        match self {
            Self::PredatorRange => scenario.predator_range,
            Self::Length(range) => range,
        }
    }
}
