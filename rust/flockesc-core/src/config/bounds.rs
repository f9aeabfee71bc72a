//! Bounds of single fields; what is out of them is refused by name.

use crate::error::{Error, Result};

/// Largest length in m of an initial shape: what is drawn around any center stays finite.
pub(super) const MAX_LENGTH: f64 = 1e290;

pub(crate) fn finite(field: &str, value: f64) -> Result<()> {
    check(field, value, "a finite number", value.is_finite())
}

pub(crate) fn not_negative(field: &str, value: f64) -> Result<()> {
    let good = value.is_finite() && value >= 0.0;
    check(field, value, "a finite number of at least 0", good)
}

pub(crate) fn positive(field: &str, value: f64) -> Result<()> {
    let good = value.is_finite() && value > 0.0;
    check(field, value, "a finite number above 0", good)
}

/// A length of an initial shape in m.
pub(crate) fn length(field: &str, value: f64) -> Result<()> {
    within_bounds(field, value, 0.0, MAX_LENGTH)
}

pub(crate) fn within_bounds(field: &str, value: f64, low: f64, high: f64) -> Result<()> {
    let expected = format!("a number from {low:?} to {high:?}");
    check(field, value, &expected, (low..=high).contains(&value))
}

/// A point or direction: 2 or `dimension` finite numbers.
pub(crate) fn vector(field: &str, entries: &[f64], dimension: usize) -> Result<()> {
    if entries.len() != 2 && entries.len() != dimension {
        let expected = match dimension {
            2 => "2 numbers".to_owned(),
            _ => format!("2 or {dimension} numbers"),
        };
        return Err(Error::config(field, expected, entries.len()));
    }
    let mut places = entries.iter().enumerate();
    places.try_for_each(|(k, &entry)| finite(&format!("{field}[{k}]"), entry))
}

pub(crate) fn within(field: &str, value: usize, low: usize, high: usize) -> Result<()> {
    let expected = format!("an integer from {low} to {high}");
    check(field, value, &expected, (low..=high).contains(&value))
}

fn check(field: &str, value: impl ToString, expected: &str, good: bool) -> Result<()> {
    if good {
        Ok(())
    } else {
        Err(Error::config(field, expected, value))
    }
}
