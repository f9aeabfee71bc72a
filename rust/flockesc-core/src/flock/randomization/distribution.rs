//! The trait of a distribution, and what intervals have in common.

use crate::base::check::finite;
use crate::base::error::{Error, Result};

/// A distribution of one number of the scenario.
pub(super) trait Draw {
    /// Path of the number in the scenario.
    fn field(&self) -> &str;

    /// Checks the parameters; errors begin with `path`.
    fn check(&self, path: &str) -> Result<()>;

    /// The smallest and the largest value, or all values.
    fn ends(&self) -> Vec<End>;

    /// The value for a uniform `part` in [0, 1). Rounding does not carry it out of the ends.
    fn draw(&self, part: f64) -> f64;
}

/// A value, and the parameter that holds it.
pub(super) type End = (String, f64);

/// The number at `part` of the way from `low` to `high`.
pub(super) fn between(low: f64, high: f64, part: f64) -> f64 {
    low * (1.0 - part) + high * part
}

/// The ends of an interval.
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
