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
    /// Returns the range in m.
    pub(crate) fn length(self, scenario: &FlockConfig) -> f64 {
        match self {
            Self::PredatorRange => scenario.predator_range,
            Self::Length(range) => range,
        }
    }
}
