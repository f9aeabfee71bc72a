//! How far a predator is seen.

use serde::Deserialize;

use crate::flock::FlockConfig;

/// Distance up to which a predator is seen.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum SensingRange {
    /// In m.
    Length(f64),
    /// That of another range.
    Same(SameRange),
}

/// A range that another one is equal to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SameRange {
    /// rho_p of the episode's scenario.
    PredatorRange,
}

impl SensingRange {
    /// Whether a predator is seen from this distance in m.
    pub(crate) fn reaches(self, distance: f64, scenario: &FlockConfig) -> bool {
        match self {
            Self::Length(range) => distance <= range,
            Self::Same(SameRange::PredatorRange) => distance <= scenario.predator_range,
        }
    }
}
