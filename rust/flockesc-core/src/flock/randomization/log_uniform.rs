//! The log-uniform distribution.

use serde::{Deserialize, Serialize};

use super::distribution::{Draw, End, check_interval, interpolate, interval_ends};
use crate::base::check::positive;
use crate::base::error::Result;

/// Log-uniform on [`low`, `high`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LogUniform {
    /// Path of the number in the scenario, such as `predators[0].pure_pursuit.max_speed`.
    pub field: String,
    /// Smallest value, above 0.
    pub low: f64,
    /// Largest value.
    pub high: f64,
}

impl Draw for LogUniform {
    fn field(&self) -> &str {
        &self.field
    }

    fn check(&self, path: &str) -> Result<()> {
        positive(&format!("{path}.low"), self.low)?;
        check_interval(path, self.low, self.high)
    }

    fn ends(&self) -> Vec<End> {
        interval_ends(self.low, self.high)
    }

    fn draw(&self, part: f64) -> f64 {
        // libm instead of the platform's functions, so that a seed draws the same scenario on every machine.
        let logarithm = interpolate(libm::log(self.low), libm::log(self.high), part);
        libm::exp(logarithm).clamp(self.low, self.high)
    }
}
