//! `Objective`: the value whose running minimum an episode maximizes, and the table of all objectives.

use serde::{Deserialize, Serialize};
use strum::{IntoStaticStr, VariantArray, VariantNames};

use crate::flock::World;

/// The value whose running minimum an episode maximizes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[derive(VariantNames, VariantArray, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Objective {
    /// Mean predator distance over the agents in m (Eq. 12).
    MinMeanDistance,
    /// Minimum predator distance over the agents in m (Eq. 13).
    MinMinDistance,
    /// Fraction of the agents that were not caught.
    FractionSurviving,
}

/// A row of the table of objectives, which all reports read. A larger objective is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct ObjectiveSpec {
    /// Name in documents, and column of the objective so far, in `info`, rollouts and sweeps.
    pub name: &'static str,
    /// Model: `flock` or `line`.
    pub model: &'static str,
    /// Symbol of the objective J.
    pub symbol: &'static str,
    /// Name of the value at one time.
    pub label: &'static str,
    /// Definition of the objective.
    pub definition: &'static str,
    /// Unit; empty for a number without a unit.
    pub unit: &'static str,
    /// Column of the value at one time, in `info` and in recorded runs.
    pub series: &'static str,
    /// Field of the scenario without which the objective is the same under all ranges.
    pub requires: &'static str,
}

impl ObjectiveSpec {
    /// Returns the row as a JSON document.
    pub fn to_json(&self) -> String {
        serde_json::to_value(self).unwrap_or_default().to_string()
    }
}

impl Objective {
    /// Number of objectives.
    pub const COUNT: usize = <Self as VariantNames>::VARIANTS.len();

    /// Returns the objective's row of the table.
    fn spec(self) -> ObjectiveSpec {
        let name = self.into();
        match self {
            Self::MinMeanDistance => ObjectiveSpec {
                name,
                model: "flock",
                symbol: "J_mean",
                label: "mean predator distance",
                definition: "minimum over time of the mean predator distance (Eq. 12)",
                unit: "m",
                series: "mean_distance",
                requires: "predators",
            },
            Self::MinMinDistance => ObjectiveSpec {
                name,
                model: "flock",
                symbol: "J_min",
                label: "minimum predator distance",
                definition: "minimum over time of the minimum predator distance (Eq. 13)",
                unit: "m",
                series: "min_distance",
                requires: "predators",
            },
            Self::FractionSurviving => ObjectiveSpec {
                name,
                model: "flock",
                symbol: "J_survival",
                label: "fraction surviving",
                definition: "fraction of the agents that are not caught",
                unit: "",
                series: "fraction_surviving",
                requires: "capture_radius",
            },
        }
    }

    /// Returns whether the objective is a distance in m.
    pub(crate) fn is_distance(self) -> bool {
        self.spec().unit == "m"
    }

    /// Returns the current value of the objective in a flock.
    pub(crate) fn value_of<const D: usize>(self, world: &World<D>) -> f64 {
        match self {
            Self::MinMeanDistance => world.predator_distance().mean,
            Self::MinMinDistance => world.predator_distance().minimum,
            Self::FractionSurviving => world.fraction_surviving(),
        }
    }

    /// Returns the current values of all objectives in a flock, in the order of the table.
    pub(crate) fn values_of<const D: usize>(world: &World<D>) -> [f64; Self::COUNT] {
        std::array::from_fn(|index| <Self as VariantArray>::VARIANTS[index].value_of(world))
    }
}

const LINE: ObjectiveSpec = ObjectiveSpec {
    name: "escape_distance",
    model: "line",
    symbol: "d_ss",
    label: "escape distance",
    definition: "distance between the predator and the nearest agent at the end",
    unit: "",
    series: "escape_distance",
    requires: "predator_position",
};

/// Returns the table of objectives: those of the flock in the order of [`Objective`], then that of the line.
/// The first objective of a model is its default.
///
/// ```
/// let symbols = flockesc_core::objectives().map(|objective| objective.symbol);
/// assert_eq!(symbols.collect::<Vec<_>>(), ["J_mean", "J_min", "J_survival", "d_ss"]);
/// ```
pub fn objectives() -> impl Iterator<Item = ObjectiveSpec> {
    let flock = <Objective as VariantArray>::VARIANTS.iter();
    flock.map(|objective| objective.spec()).chain([LINE])
}
