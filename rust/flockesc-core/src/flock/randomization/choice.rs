//! A uniform distribution over a list of numbers.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::distribution::{Draw, End};
use crate::base::check::finite;
use crate::base::error::{Error, Result};

/// One of several numbers, all equally likely.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Choice {
    /// Path of the number in the scenario, such as `predators[0].pure_pursuit.max_speed`.
    pub field: String,
    /// The numbers, at least one.
    pub values: Vec<f64>,
}

impl Draw for Choice {
    fn field(&self) -> &str {
        &self.field
    }

    fn check(&self, path: &str) -> Result<()> {
        let field = format!("{path}.values");
        if self.values.is_empty() {
            return Err(Error::config(field, "at least one number", "none"));
        }
        let mut places = self.values.iter().enumerate();
        places.try_for_each(|(k, &value)| finite(&format!("{field}[{k}]"), value))
    }

    fn ends(&self) -> Vec<End> {
        let order = |a: &usize, b: &usize| self.values[*a].total_cmp(&self.values[*b]);
        let size_order =
            |a: &usize, b: &usize| self.values[*a].abs().total_cmp(&self.values[*b].abs());
        let places = || 0..self.values.len();
        let extremes = [
            places().next(),
            places().min_by(order),
            places().max_by(order),
            places().min_by(size_order),
        ];
        let unique: BTreeSet<usize> = extremes.into_iter().flatten().collect();
        let ends = unique.into_iter();
        ends.map(|k| (format!("values[{k}]"), self.values[k]))
            .collect()
    }

    fn draw(&self, part: f64) -> f64 {
        let place = (part * self.values.len() as f64) as usize;
        self.values[place.min(self.values.len() - 1)]
    }
}
