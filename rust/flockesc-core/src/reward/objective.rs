//! `Objective`: the value whose running minimum an episode maximizes.

use serde::{Deserialize, Serialize};

use crate::flock::World;

/// The value whose running minimum an episode maximizes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, strum::VariantNames)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Objective {
    /// Mean predator distance over the agents in m (Eq. 12).
    Mean,
    /// Minimum predator distance over the agents in m (Eq. 13).
    Minimum,
    /// Fraction of the agents that were not caught.
    Survival,
}

impl Objective {
    /// Names of all objectives in documents.
    pub const KINDS: &[&str] = <Self as strum::VariantNames>::VARIANTS;

    /// Returns the current value of the objective in a flock.
    pub(crate) fn value_of<const D: usize>(self, world: &World<D>) -> f64 {
        match self {
            Self::Mean => world.predator_distance().mean,
            Self::Minimum => world.predator_distance().minimum,
            Self::Survival => world.fraction_surviving(),
        }
    }
}
