//! Directions: unit vectors and the cases where there is none.

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
