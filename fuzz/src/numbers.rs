//! Generation of numbers from bytes: mostly ordinary ones, and the limits of what is accepted.

use arbitrary::{Result, Unstructured};

/// Largest accepted parameter.
pub(crate) const LARGEST: f64 = 1e20;
/// Special values of parameters.
const SPECIAL_VALUES: [f64; 15] = [
    0.0, 5e-324, 1e-200, 1e-160, 1e-140, 2e-140, 5e-109, 1e-20, 1e-9, 0.5, 1.0, 3.0, 10.0, 1e12,
    LARGEST,
];

/// Returns true once in `times` calls on average, and false if there are no more bytes.
pub fn rarely(u: &mut Unstructured<'_>, times: u8) -> Result<bool> {
    Ok(!u.ratio(times - 1, times)?)
}

/// Generates a special value or a number from 0 to 100.
pub(crate) fn quantity(u: &mut Unstructured<'_>) -> Result<f64> {
    match rarely(u, 3)? {
        true => Ok(*u.choose(&SPECIAL_VALUES)?),
        false => Ok(f64::from(u.arbitrary::<u16>()?) / 655.36),
    }
}

/// Generates an interaction range: a small number, a special value or the largest number.
pub fn any_range(u: &mut Unstructured<'_>) -> Result<f64> {
    match rarely(u, 8)? {
        true => Ok(f64::MAX),
        false => quantity(u),
    }
}

/// Generates a coordinate, often a small integer, so that many are equal.
pub(crate) fn coordinate(u: &mut Unstructured<'_>) -> Result<f64> {
    match u.arbitrary()? {
        true => Ok(f64::from(u.int_in_range(-2..=2)?)),
        false if u.arbitrary()? => Ok(-quantity(u)?),
        false => quantity(u),
    }
}

/// Generates `count` coordinates.
pub fn coordinates(u: &mut Unstructured<'_>, count: usize) -> Result<Vec<f64>> {
    (0..count).map(|_| coordinate(u)).collect()
}
