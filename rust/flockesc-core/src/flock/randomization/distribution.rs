//! `Distribution`: the distributions of a number of the scenario.

use serde::{Deserialize, Serialize};
use strum::{AsRefStr, VariantNames};

use crate::base::check::{finite, positive};
use crate::base::error::{Error, Result};

/// The distribution of a number of the scenario. `field` is the path of the number, such as
/// `predators[0].pure_pursuit.max_speed`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, AsRefStr, VariantNames)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[strum(serialize_all = "snake_case")]
pub enum Distribution {
    /// Uniform on [`low`, `high`].
    Uniform {
        /// Path of the number in the scenario.
        field: String,
        /// Smallest value.
        low: f64,
        /// Largest value.
        high: f64,
    },
    /// Log-uniform on [`low`, `high`].
    LogUniform {
        /// Path of the number in the scenario.
        field: String,
        /// Smallest value, above 0.
        low: f64,
        /// Largest value.
        high: f64,
    },
    /// One of several numbers, all equally likely.
    Choice {
        /// Path of the number in the scenario.
        field: String,
        /// The numbers, at least one.
        values: Vec<f64>,
    },
}

impl Distribution {
    /// Names of all distributions in documents.
    pub const KINDS: &[&str] = <Self as VariantNames>::VARIANTS;

    /// Returns the path of the number in the scenario.
    pub(super) fn field(&self) -> &str {
        match self {
            Self::Uniform { field, .. }
            | Self::LogUniform { field, .. }
            | Self::Choice { field, .. } => field,
        }
    }

    /// Checks the parameters. `path` is the distribution's path in the scenario.
    pub(super) fn check(&self, path: &str) -> Result<()> {
        match self {
            Self::Uniform { low, high, .. } => check_interval(path, *low, *high),
            Self::LogUniform { low, high, .. } => {
                positive(&format!("{path}.low"), *low)?;
                check_interval(path, *low, *high)
            }
            Self::Choice { values, .. } => {
                let field = format!("{path}.values");
                if values.is_empty() {
                    return Err(Error::input(field, "at least one number", "none"));
                }
                let mut values = values.iter().enumerate();
                values.try_for_each(|(k, &value)| finite(&format!("{field}[{k}]"), value))
            }
        }
    }

    /// Returns the value for a uniform number `part` in [0, 1). It lies between the ends in spite of
    /// rounding.
    pub(super) fn draw(&self, part: f64) -> f64 {
        match self {
            Self::Uniform { low, high, .. } => interpolate(*low, *high, part).clamp(*low, *high),
            Self::LogUniform { low, high, .. } => {
                // libm instead of the platform's functions, so that a seed draws the same scenario on every
                // machine.
                let logarithm = interpolate(libm::log(*low), libm::log(*high), part);
                libm::exp(logarithm).clamp(*low, *high)
            }
            Self::Choice { values, .. } => {
                let place = (part * values.len() as f64) as usize;
                values[place.min(values.len() - 1)]
            }
        }
    }
}

/// Interpolates linearly from `low` at `part` = 0 to `high` at `part` = 1.
fn interpolate(low: f64, high: f64, part: f64) -> f64 {
    low * (1.0 - part) + high * part
}

/// Checks the ends of an interval.
fn check_interval(path: &str, low: f64, high: f64) -> Result<()> {
    finite(&format!("{path}.low"), low)?;
    let field = format!("{path}.high");
    finite(&field, high)?;
    if low <= high {
        return Ok(());
    }
    let expected = format!("a number of at least low = {low:?}");
    Err(Error::input(field, expected, high))
}
