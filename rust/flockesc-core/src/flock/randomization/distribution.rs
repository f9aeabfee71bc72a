//! `Distribution`: the distributions of numbers of the scenario.

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use strum::{AsRefStr, VariantNames};

use crate::base::check::{finite, not_negative, positive, require};
use crate::base::error::Result;
use crate::base::rng;

/// The distribution of a number of the scenario, or of the start of a predator. `field` is the path of the number,
/// such as `predators[0].pure_pursuit.max_speed`.
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
    /// Position and velocity of a predator together: a uniform direction of flight toward a uniform point of the
    /// initial region, and a log-uniform speed on [`low`, `high`].
    RandomApproach {
        /// Index of the predator.
        predator: usize,
        /// Distance in m from the start to the point.
        distance: f64,
        /// Smallest speed in m/s, above 0.
        low: f64,
        /// Largest speed in m/s.
        high: f64,
    },
}

impl Distribution {
    /// Returns the paths of the numbers in a scenario's document; none for a predator that is not there.
    pub(super) fn fields(&self, scenario: &Value) -> Vec<String> {
        match self {
            Self::Uniform { field, .. }
            | Self::LogUniform { field, .. }
            | Self::Choice { field, .. } => vec![field.clone()],
            Self::RandomApproach { predator, .. } => {
                let start = scenario["predators"][*predator].as_object();
                let Some(kind) = start.and_then(|variant| variant.keys().next()) else {
                    return Vec::new();
                };
                let vectors = ["position", "velocity"].into_iter();
                vectors
                    .flat_map(|vector| {
                        (0..dimension(scenario)).map(move |axis| {
                            format!("predators[{predator}].{kind}.{vector}[{axis}]")
                        })
                    })
                    .collect()
            }
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
                require(!values.is_empty(), &field, "at least one number", "none")?;
                let mut values = values.iter().enumerate();
                values.try_for_each(|(k, &value)| finite(&format!("{field}[{k}]"), value))
            }
            Self::RandomApproach {
                distance,
                low,
                high,
                ..
            } => {
                not_negative(&format!("{path}.distance"), *distance)?;
                positive(&format!("{path}.low"), *low)?;
                check_interval(path, *low, *high)
            }
        }
    }

    /// Draws the numbers in the order of [`Self::fields`].
    pub(super) fn draw(&self, scenario: &Value, rng: &mut ChaCha8Rng) -> Vec<f64> {
        match self {
            Self::Uniform { low, high, .. } => {
                let part = rng::uniform(rng, 1.0);
                vec![interpolate(*low, *high, part).clamp(*low, *high)]
            }
            Self::LogUniform { low, high, .. } => vec![log_uniform(*low, *high, rng)],
            Self::Choice { values, .. } => {
                let place = (rng::uniform(rng, 1.0) * values.len() as f64) as usize;
                vec![values[place.min(values.len() - 1)]]
            }
            Self::RandomApproach {
                distance,
                low,
                high,
                ..
            } => {
                let is_plane = scenario["initial_plane"].as_bool() == Some(true);
                let axes = if is_plane { 2 } else { dimension(scenario) };
                let side = scenario["initial_side"].as_f64().unwrap_or_default();
                let heading = rng::direction::<3>(axes, rng);
                let aim = [(); 3].map(|()| rng::uniform(rng, side));
                let speed = log_uniform(*low, *high, rng);
                let start =
                    |axis: usize| f64::from(axis < axes) * aim[axis] - distance * heading[axis];
                let (position, velocity) = ((0..3).map(start), heading.iter().map(|x| speed * x));
                let vectors = position.take(dimension(scenario));
                vectors.chain(velocity.take(dimension(scenario))).collect()
            }
        }
    }
}

/// Returns the dimension of a scenario's document.
fn dimension(scenario: &Value) -> usize {
    scenario["dimension"].as_u64().unwrap_or_default() as usize
}

/// Draws a log-uniform number. It lies between the ends in spite of rounding.
fn log_uniform(low: f64, high: f64, rng: &mut ChaCha8Rng) -> f64 {
    // libm instead of the platform's functions, so that a seed draws the same scenario on every machine.
    let logarithm = interpolate(libm::log(low), libm::log(high), rng::uniform(rng, 1.0));
    libm::exp(logarithm).clamp(low, high)
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
    let expected = format!("a number of at least low = {low:?}");
    require(low <= high, &field, &expected, high)
}
