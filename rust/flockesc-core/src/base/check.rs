//! Checks of single fields. Errors name the field.

use crate::base::error::{Error, Result};

/// Largest number of agents of a scenario; guards against allocations that no machine can serve.
pub const MAX_AGENTS: usize = 10_000_000;
/// Largest number of steps of a scenario.
pub const MAX_STEPS: usize = 1_000_000_000;

/// Largest magnitude of any number that a step computes with. [`MAX_STEPS`] steps with such numbers stay below 1e119 m,
/// whose square is finite.
pub(crate) const LARGEST: f64 = 1e20;

/// Smallest number that a step divides by.
const SMALLEST: f64 = 1e-20;

pub(crate) fn finite(field: &str, value: f64) -> Result<()> {
    check(field, shown(value), "a finite number", value.is_finite())
}

/// A number that is only compared: a range may exceed [`LARGEST`].
pub(crate) fn not_negative(field: &str, value: f64) -> Result<()> {
    let good = value.is_finite() && value >= 0.0;
    check(field, shown(value), "a finite number of at least 0", good)
}

pub(crate) fn positive(field: &str, value: f64) -> Result<()> {
    let good = value.is_finite() && value > 0.0;
    check(field, shown(value), "a finite number above 0", good)
}

/// A number that a step computes with.
pub(crate) fn quantity(field: &str, value: f64) -> Result<()> {
    within_bounds(field, value, 0.0, LARGEST)
}

/// A number that a step divides by.
pub(crate) fn positive_quantity(field: &str, value: f64) -> Result<()> {
    within_bounds(field, value, SMALLEST, LARGEST)
}

pub(crate) fn coordinate(field: &str, value: f64) -> Result<()> {
    within_bounds(field, value, -LARGEST, LARGEST)
}

/// The coordinates of a call's argument, of which `field` names one.
pub(crate) fn coordinates(values: &[f64], field: impl Fn(usize) -> String) -> Result<()> {
    match values
        .iter()
        .position(|value| !(-LARGEST..=LARGEST).contains(value))
    {
        Some(at) => {
            let expected = format!("a number from {:?} to {LARGEST:?}", -LARGEST);
            Err(Error::argument(field(at), expected, shown(values[at])))
        }
        None => Ok(()),
    }
}

pub(crate) fn within_bounds(field: &str, value: f64, low: f64, high: f64) -> Result<()> {
    let expected = format!("a number from {low:?} to {high:?}");
    check(
        field,
        shown(value),
        &expected,
        (low..=high).contains(&value),
    )
}

/// A point, velocity or direction with `dimension` coordinates.
pub(crate) fn vector(field: &str, entries: &[f64], dimension: usize) -> Result<()> {
    if entries.len() != dimension {
        let expected = format!("{dimension} numbers");
        return Err(Error::config(field, expected, entries.len()));
    }
    let mut places = entries.iter().enumerate();
    places.try_for_each(|(k, &entry)| coordinate(&format!("{field}[{k}]"), entry))
}

pub(crate) fn within(field: &str, value: usize, low: usize, high: usize) -> Result<()> {
    let expected = format!("an integer from {low} to {high}");
    check(field, value, &expected, (low..=high).contains(&value))
}

/// The number in its shortest form.
fn shown(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
}

fn check(field: &str, value: impl ToString, expected: &str, good: bool) -> Result<()> {
    if good {
        Ok(())
    } else {
        Err(Error::config(field, expected, value))
    }
}
