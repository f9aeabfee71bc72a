//! `Draw`: the trait of the distributions of a scenario's numbers, and functions for intervals.

use crate::base::check::finite;
use crate::base::error::{Error, Result};

/// A distribution of one number of the scenario.
pub(super) trait Draw {
    /// Returns the path of the number in the scenario.
    fn field(&self) -> &str;

    /// Checks the parameters. `path` is the distribution's path in the scenario.
    fn check(&self, path: &str) -> Result<()>;

    /// Returns the smallest and the largest value and, of a finite set, also the first one and the one nearest
    /// to 0.
    fn ends(&self) -> Vec<End>;

    /// Returns the value for a uniform number `part` in [0, 1). It lies between the ends in spite of
    /// rounding.
    fn draw(&self, part: f64) -> f64;
}

/// An extreme value, with the name of the parameter that sets it.
pub(super) type End = (String, f64);

/// Interpolates linearly from `low` at `part` = 0 to `high` at `part` = 1.
pub(super) fn interpolate(low: f64, high: f64, part: f64) -> f64 {
    low * (1.0 - part) + high * part
}

/// Returns the ends of an interval.
pub(super) fn interval_ends(low: f64, high: f64) -> Vec<End> {
    vec![("low".to_owned(), low), ("high".to_owned(), high)]
}

/// Checks the ends of an interval.
pub(super) fn check_interval(path: &str, low: f64, high: f64) -> Result<()> {
    finite(&format!("{path}.low"), low)?;
    let field = format!("{path}.high");
    finite(&field, high)?;
    if low <= high {
        return Ok(());
    }
    let expected = format!("a number of at least low = {low:?}");
    Err(Error::config(field, expected, high))
}
