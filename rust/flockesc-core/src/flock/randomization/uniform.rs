//! The uniform distribution on an interval.

use serde::{Deserialize, Serialize};

use super::distribution::{Draw, End, check_interval, interpolate, interval_ends};
use crate::base::error::Result;

/// Uniform on [`low`, `high`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Uniform {
    /// Path of the number in the scenario, such as `predators[0].pure_pursuit.max_speed`.
    pub field: String,
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
}

impl Draw for Uniform {
    fn field(&self) -> &str {
        &self.field
    }

    fn check(&self, path: &str) -> Result<()> {
        check_interval(path, self.low, self.high)
    }

    fn ends(&self) -> Vec<End> {
        interval_ends(self.low, self.high)
    }

    fn draw(&self, part: f64) -> f64 {
        interpolate(self.low, self.high, part).clamp(self.low, self.high)
    }
}
