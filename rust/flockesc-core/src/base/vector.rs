//! Directions, turns and lengths of vectors, and the smaller and larger of two numbers.

use nalgebra::SVector;

/// Length up to which a vector counts as 0: beyond it, squares keep all their bits and quotients are finite.
pub(crate) const SHORTEST: f64 = 1e-140;

/// The unit vector along `velocity`; 0 for an agent at rest.
pub(crate) fn heading<const D: usize>(velocity: &SVector<f64, D>) -> SVector<f64, D> {
    unit(velocity).unwrap_or_else(SVector::zeros)
}

/// `vector` scaled to length 1; `None` where it counts as 0.
pub(crate) fn unit<const D: usize>(vector: &SVector<f64, D>) -> Option<SVector<f64, D>> {
    let norm = vector.norm();
    (norm > SHORTEST).then(|| vector / norm)
}

/// The unit vector along the axis that is least aligned with `vector`.
pub(crate) fn least_aligned_axis<const D: usize>(vector: &SVector<f64, D>) -> SVector<f64, D> {
    let mut axis = SVector::zeros();
    axis[vector.iamin()] = 1.0;
    axis
}

/// The unit vector `heading` turned by `angle` rad toward `side`, a unit vector across it.
pub(crate) fn turn<const D: usize>(
    heading: &SVector<f64, D>,
    side: &SVector<f64, D>,
    angle: f64,
) -> SVector<f64, D> {
    heading * libm::cos(angle) + side * libm::sin(angle)
}

/// The unit vector across the unit vector `heading` toward `aim`; `None` where that is straight ahead or behind.
pub(crate) fn side_of<const D: usize>(
    heading: &SVector<f64, D>,
    aim: &SVector<f64, D>,
) -> Option<SVector<f64, D>> {
    let rough = unit(&(aim - heading * heading.dot(aim)))?;
    // Of an aim nearly straight ahead or behind little more than rounding is left, and that is not all across.
    unit(&(rough - heading * heading.dot(&rough)))
}

/// The smaller one; `a` where `b` is NaN.
#[inline(always)]
pub(crate) fn smaller(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// The larger one; `a` where `b` is NaN.
#[inline(always)]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// The squared Euclidean norm.
#[inline(always)]
pub(crate) fn squared_norm<const D: usize>(vector: &[f64; D]) -> f64 {
    (1..D).fold(vector[0] * vector[0], |sum, axis| {
        sum + vector[axis] * vector[axis]
    })
}
