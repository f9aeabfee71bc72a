//! `Objective`: the value whose running minimum an episode maximizes.

use serde::{Deserialize, Serialize};

use crate::flock::World;

/// The value whose running minimum an episode maximizes.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Serialize,
    Deserialize,
    strum::VariantNames,
    strum::VariantArray,
    strum::IntoStaticStr,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Objective {
    /// Mean predator distance over the agents in m (Eq. 12).
    MinMeanDistance,
    /// Minimum predator distance over the agents in m (Eq. 13).
    MinMinDistance,
    /// Fraction of the agents that were not caught.
    FractionSurviving,
}

impl Objective {
    /// All objectives. The first one is the default.
    pub const ALL: &'static [Self] = <Self as strum::VariantArray>::VARIANTS;
    /// Number of objectives.
    pub const COUNT: usize = Self::ALL.len();

    /// Returns the name in documents, and of the column of the objective so far.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns the name of the column of the value at one time.
    pub fn series(self) -> &'static str {
        match self {
            Self::MinMeanDistance => "mean_distance",
            Self::MinMinDistance => "min_distance",
            Self::FractionSurviving => "fraction_surviving",
        }
    }

    /// Returns whether the objective is a distance in m.
    pub(crate) fn is_distance(self) -> bool {
        match self {
            Self::MinMeanDistance | Self::MinMinDistance => true,
            Self::FractionSurviving => false,
        }
    }

    /// Returns the current value of the objective in a flock.
    pub(crate) fn value_of<const D: usize>(self, world: &World<D>) -> f64 {
        match self {
            Self::MinMeanDistance => world.predator_distance().mean,
            Self::MinMinDistance => world.predator_distance().minimum,
            Self::FractionSurviving => world.fraction_surviving(),
        }
    }

    /// Returns the current values of all objectives in a flock, in the order of [`Self::ALL`].
    pub(crate) fn values_of<const D: usize>(world: &World<D>) -> [f64; Self::COUNT] {
        std::array::from_fn(|index| Self::ALL[index].value_of(world))
    }
}
