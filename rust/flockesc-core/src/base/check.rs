//! Validation of single fields and arguments.

use std::hint::black_box;

use crate::base::error::{Error, Result};
use crate::base::vector::{larger, smaller};

/// Largest number of agents of a scenario. The limit prevents allocations that exceed the memory of any
/// machine.
pub const MAX_AGENTS: usize = 10_000_000;
/// Largest number of steps of a scenario.
pub const MAX_STEPS: usize = 1_000_000_000;

/// Largest number of predators, and of distributions of numbers, of a scenario. The limit bounds the time that
/// the check of a scenario takes.
pub const MAX_PARTS: usize = 10_000;

/// Largest number of candidate ranges of an observation.
pub const MAX_CANDIDATES: usize = 64;

/// Largest magnitude of a parameter. With such parameters, coordinates stay below 1e119 m for [`MAX_STEPS`]
/// steps, and their squares are finite.
pub(crate) const MAX_MAGNITUDE: f64 = 1e20;

/// Smallest value of a parameter that a step divides by.
const MIN_DIVISOR: f64 = 1e-20;

/// Checks that the thread rounds to nearest. Another rounding mode changes all results.
pub(crate) fn rounding() -> Result<()> {
    let (one, tiny) = black_box((1.0, 1e-300));
    if one + tiny == one && one - tiny == one {
        Ok(())
    } else {
        Err(Error::Rounding)
    }
}

/// Largest distance of an action from its bounds, in units of the larger bound: 8 roundings, of 2^-24 each.
///
/// A linear map onto [low, high] in float32 misses a bound by as many roundings as it has operations. These are at
/// most 4, with that of the bound, for `low + (high - low) (a + 1) / 2` and `a (high - low) / 2 + (low + high) / 2`,
/// and 5 + max(|a|, |b|) / (b - a) for Gymnasium's `RescaleAction(a, b)`: 6 for [0, 1].
const ACTION_ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

/// Returns an action clipped to [low, high], or NaN if it is NaN or farther outside than by rounding in float32.
pub fn clipped(action: f64, low: f64, high: f64) -> f64 {
    let slack = ACTION_ROUNDING * larger(low.abs(), high.abs());
    // The bounds of a space of float32 are accepted even if they are subnormal or infinite.
    let least = smaller(low - slack, f64::from(low as f32));
    let most = larger(high + slack, f64::from(high as f32));
    if (least..=most).contains(&action) {
        action.clamp(low, high)
    } else {
        f64::NAN
    }
}

pub(crate) fn finite(field: &str, value: f64) -> Result<()> {
    number(field, value, "a finite number", value.is_finite())
}

/// Checks a number that is only compared, such as a range. It may exceed [`MAX_MAGNITUDE`].
pub(crate) fn not_negative(field: &str, value: f64) -> Result<()> {
    let good = value.is_finite() && value >= 0.0;
    number(field, value, "a finite number of at least 0", good)
}

pub(crate) fn positive(field: &str, value: f64) -> Result<()> {
    let good = value.is_finite() && value > 0.0;
    number(field, value, "a finite number above 0", good)
}

/// Checks a parameter from 0 to [`MAX_MAGNITUDE`].
pub(crate) fn quantity(field: &str, value: f64) -> Result<()> {
    within_bounds(field, value, 0.0, MAX_MAGNITUDE)
}

/// Checks a parameter that a step divides by, from [`MIN_DIVISOR`] to [`MAX_MAGNITUDE`].
pub(crate) fn positive_quantity(field: &str, value: f64) -> Result<()> {
    within_bounds(field, value, MIN_DIVISOR, MAX_MAGNITUDE)
}

pub(crate) fn coordinate(field: &str, value: f64) -> Result<()> {
    within_bounds(field, value, -MAX_MAGNITUDE, MAX_MAGNITUDE)
}

/// Checks the coordinates in an argument of a call. `field` returns the name of the coordinate at an index,
/// for errors.
pub(crate) fn coordinates(values: &[f64], field: impl Fn(usize) -> String) -> Result<()> {
    let is_good = |value: &f64| (-MAX_MAGNITUDE..=MAX_MAGNITUDE).contains(value);
    match values.iter().position(|value| !is_good(value)) {
        Some(at) => coordinate(&field(at), values[at]),
        None => Ok(()),
    }
}

pub(crate) fn within_bounds(field: &str, value: f64, low: f64, high: f64) -> Result<()> {
    let expected = format!("a number from {low:?} to {high:?}");
    number(field, value, &expected, (low..=high).contains(&value))
}

/// Checks a point, velocity or direction with `dimension` coordinates.
pub(crate) fn vector(field: &str, entries: &[f64], dimension: usize) -> Result<()> {
    length(field, entries.len(), dimension, "numbers", "")?;
    let mut places = entries.iter().enumerate();
    places.try_for_each(|(k, &entry)| coordinate(&format!("{field}[{k}]"), entry))
}

pub(crate) fn within(field: &str, value: usize, low: usize, high: usize) -> Result<()> {
    let expected = format!("an integer from {low} to {high}");
    require((low..=high).contains(&value), field, &expected, value)
}

/// Checks the length of a list of parts, such as `predators`.
pub(crate) fn at_most(field: &str, parts: &str, count: usize, most: usize) -> Result<()> {
    let expected = format!("at most {most} {parts}");
    require(count <= most, field, &expected, count)
}

/// Checks the candidate ranges of a profile: 1 to [`MAX_CANDIDATES`] increasing numbers from 0 to
/// `max_range`.
pub(crate) fn profile_ranges(field: &str, ranges: &[f64], max_range: f64) -> Result<()> {
    let expected = format!("1 to {MAX_CANDIDATES} ranges");
    let is_full = (1..=MAX_CANDIDATES).contains(&ranges.len());
    require(is_full, field, &expected, ranges.len())?;
    for (k, &range) in ranges.iter().enumerate() {
        within_bounds(&format!("{field}[{k}]"), range, 0.0, max_range)?;
    }
    let (given, is_rising) = (format!("{ranges:?}"), ranges.is_sorted_by(|a, b| a < b));
    require(is_rising, field, "increasing ranges", given)
}

/// Formats a number in its shortest form.
fn format_number(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
}

fn number(field: &str, value: f64, expected: &str, is_good: bool) -> Result<()> {
    // NOTE: Steps check their arguments too, so nothing is formatted before a check fails.
    if is_good {
        return Ok(());
    }
    Err(Error::input(field, expected, format_number(value)))
}

/// Checks that there are `count` items, which errors call `items`. `note` ends the description of what is expected.
pub(crate) fn length(
    field: &str,
    given: usize,
    count: usize,
    items: &str,
    note: &str,
) -> Result<()> {
    if given == count {
        return Ok(());
    }
    let (expected, given) = (format!("{count} {items}{note}"), format!("{given} {items}"));
    Err(Error::input(field, expected, given))
}

/// Checks any condition: `expected` describes it, and `given` is what was found.
pub(crate) fn require(
    is_good: bool,
    field: &str,
    expected: &str,
    given: impl ToString,
) -> Result<()> {
    if is_good {
        Ok(())
    } else {
        Err(Error::input(field, expected, given))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_show_numbers_in_their_shortest_form() {
        for (value, shown) in [(-1.0, "-1"), (-0.25, "-0.25"), (f64::NAN, "NaN")] {
            let error = not_negative("reach", value).unwrap_err();
            let expected = "reach: expected a finite number of at least 0, got";
            assert_eq!(error.to_string(), format!("{expected} {shown}"));
        }
    }
}
