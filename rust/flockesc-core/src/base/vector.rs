//! Vector arithmetic: unit vectors, turns, norms, and minimum and maximum of two numbers.

use nalgebra::SVector;

/// Length up to which a vector counts as 0. Squares of longer vectors do not underflow, and their reciprocals
/// are finite.
pub(crate) const SHORTEST: f64 = 1e-140;

/// Returns the unit vector along `velocity`, or 0 for an agent at rest.
pub(crate) fn heading<const D: usize>(velocity: &SVector<f64, D>) -> SVector<f64, D> {
    unit(velocity).unwrap_or_else(SVector::zeros)
}

/// Returns `vector` scaled to length 1, or `None` if it is not longer than [`SHORTEST`].
pub(crate) fn unit<const D: usize>(vector: &SVector<f64, D>) -> Option<SVector<f64, D>> {
    let norm = vector.norm();
    (norm > SHORTEST).then(|| vector / norm)
}

/// Returns the unit vector along the axis that is least aligned with `vector`.
pub(crate) fn least_aligned_axis<const D: usize>(vector: &SVector<f64, D>) -> SVector<f64, D> {
    let mut axis = SVector::zeros();
    axis[vector.iamin()] = 1.0;
    axis
}

/// Returns the unit vector `heading` turned by `angle` rad toward `side`, a unit vector perpendicular to it.
pub(crate) fn turn<const D: usize>(
    heading: &SVector<f64, D>,
    side: &SVector<f64, D>,
    angle: f64,
) -> SVector<f64, D> {
    heading * libm::cos(angle) + side * libm::sin(angle)
}

/// Returns the unit vector that is perpendicular to the unit vector `heading` and points to the side of
/// `aim`, or `None` if `aim` is straight ahead or behind.
pub(crate) fn side_of<const D: usize>(
    heading: &SVector<f64, D>,
    aim: &SVector<f64, D>,
) -> Option<SVector<f64, D>> {
    let rough = unit(&(aim - heading * heading.dot(aim)))?;
    // If `aim` is almost parallel to `heading`, rounding leaves a component along it. The second projection
    // removes it.
    unit(&(rough - heading * heading.dot(&rough)))
}

/// Returns the vector with these entries. Missing entries are 0.
pub(crate) fn embed<const D: usize>(entries: &[f64]) -> SVector<f64, D> {
    SVector::from_fn(|axis, _| entries.get(axis).copied().unwrap_or(0.0))
}

/// Returns the rows of a flat array as vectors.
pub(crate) fn rows<const D: usize>(flat: &[f64]) -> impl Iterator<Item = SVector<f64, D>> {
    flat.chunks_exact(D).map(SVector::from_column_slice)
}

/// Returns the smaller number, or `a` if `b` is NaN.
#[inline(always)]
pub(crate) fn smaller(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// Returns the larger number, or `a` if `b` is NaN.
#[inline(always)]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// Returns the squared Euclidean norm.
#[inline(always)]
pub(crate) fn squared_norm<const D: usize>(vector: &[f64; D]) -> f64 {
    (1..D).fold(vector[0] * vector[0], |sum, axis| {
        sum + vector[axis] * vector[axis]
    })
}
