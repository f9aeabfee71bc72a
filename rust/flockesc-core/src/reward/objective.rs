//! What an episode is about.

use serde::{Deserialize, Serialize};

use crate::flock::World;

/// What is to be kept large: a predator distance, or the flock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, strum::VariantNames)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Objective {
    /// The mean over agents (Eq. 12).
    Mean,
    /// The minimum over agents (Eq. 13).
    Minimum,
    /// The share of agents that have not been caught.
    Survival,
}

impl Objective {
    /// The names of all objectives in documents.
    pub const KINDS: &[&str] = <Self as strum::VariantNames>::VARIANTS;

    /// Its value in a flock now.
    pub(crate) fn value_of<const D: usize>(self, world: &World<D>) -> f64 {
        match self {
            Self::Mean => world.predator_distance().mean,
            Self::Minimum => world.predator_distance().minimum,
            Self::Survival => world.fraction_surviving(),
        }
    }
}
