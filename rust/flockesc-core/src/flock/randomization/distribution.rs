//! What a number of the scenario is drawn from.

use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

use crate::base::check::{finite, positive};
use crate::base::error::{Error, Result};
use crate::base::rng;

/// What a number of the scenario is drawn from.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// Uniform.
    Uniform(Interval),
    /// Uniform in its logarithm; above 0.
    LogUniform(Interval),
    /// One of some values, all as likely.
    Choice(Choice),
}

/// A number between two others.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Interval {
    /// Path of the number in the scenario, as errors name it.
    pub field: String,
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
}

/// One of some numbers.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Choice {
    /// Path of the number in the scenario, as errors name it.
    pub field: String,
    /// At least one.
    pub values: Vec<f64>,
}

impl Distribution {
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Self::Uniform(_) => "uniform",
            Self::LogUniform(_) => "log_uniform",
            Self::Choice(_) => "choice",
        }
    }

    pub(super) fn field(&self) -> &str {
        match self {
            Self::Uniform(interval) | Self::LogUniform(interval) => &interval.field,
            Self::Choice(choice) => &choice.field,
        }
    }

    pub(super) fn check(&self, path: &str) -> Result<()> {
        match self {
            Self::Uniform(interval) => interval.check(path),
            Self::LogUniform(interval) => {
                positive(&format!("{path}.low"), interval.low)?;
                interval.check(path)
            }
            Self::Choice(choice) => {
                let field = format!("{path}.values");
                if choice.values.is_empty() {
                    return Err(Error::config(field, "at least one number", "none"));
                }
                let mut places = choice.values.iter().enumerate();
                places.try_for_each(|(k, &value)| finite(&format!("{field}[{k}]"), value))
            }
        }
    }

    /// The smallest and the largest value, or all of them, each with the name of where it stands.
    pub(super) fn ends(&self) -> Vec<(String, f64)> {
        match self {
            Self::Uniform(Interval { low, high, .. })
            | Self::LogUniform(Interval { low, high, .. }) => {
                vec![("low".to_owned(), *low), ("high".to_owned(), *high)]
            }
            Self::Choice(choice) => (0..)
                .zip(&choice.values)
                .map(|(k, &value)| (format!("values[{k}]"), value))
                .collect(),
        }
    }

    /// One uniform number makes one value; rounding does not carry it beyond the ends.
    pub(super) fn draw(&self, rng: &mut ChaCha8Rng) -> f64 {
        let part = rng::uniform(rng, 1.0);
        let between = |low: f64, high: f64| low * (1.0 - part) + high * part;
        match self {
            Self::Uniform(Interval { low, high, .. }) => between(*low, *high).clamp(*low, *high),
            Self::LogUniform(Interval { low, high, .. }) => {
                // libm, not the platform's: a seed means the same scenario on every machine.
                libm::exp(between(libm::log(*low), libm::log(*high))).clamp(*low, *high)
            }
            Self::Choice(Choice { values, .. }) => {
                let place = (part * values.len() as f64) as usize;
                values[place.min(values.len() - 1)]
            }
        }
    }
}

impl Interval {
    fn check(&self, path: &str) -> Result<()> {
        finite(&format!("{path}.low"), self.low)?;
        let field = format!("{path}.high");
        finite(&field, self.high)?;
        if self.low <= self.high {
            return Ok(());
        }
        let expected = format!("a number of at least low = {:?}", self.low);
        Err(Error::config(field, expected, self.high))
    }
}
