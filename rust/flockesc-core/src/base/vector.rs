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

/// Returns the unit vector `heading` turned toward the unit vector `direction` by at most `limit` rad, in
/// their plane.
fn turn_toward<const D: usize>(
    heading: &SVector<f64, D>,
    direction: &SVector<f64, D>,
    limit: f64,
) -> SVector<f64, D> {
    let along = heading.dot(direction);
    if libm::atan2((direction - heading * along).norm(), along) <= limit {
        return *direction;
    }
    // If the direction is straight behind, the side is ambiguous: turn toward the axis that is least aligned with
    // the heading.
    let side =
        side_of(heading, direction).or_else(|| side_of(heading, &least_aligned_axis(heading)));
    side.map_or(*heading, |side| turn(heading, &side, limit))
}

/// Returns the unit vector along `velocity` turned toward `offset` by at most `limit` rad, or `None` if the offset is 0.
/// If the velocity is 0, the unit vector along `offset` is returned.
pub(crate) fn heading_toward<const D: usize>(
    velocity: &SVector<f64, D>,
    offset: &SVector<f64, D>,
    limit: f64,
) -> Option<SVector<f64, D>> {
    let direction = unit(offset)?;
    let turned = unit(velocity).map(|heading| turn_toward(&heading, &direction, limit));
    Some(turned.unwrap_or(direction))
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

/// Returns the Euclidean norm, also if the squares overflow.
pub(crate) fn norm<const D: usize>(vector: &[f64; D]) -> f64 {
    let norm = squared_norm(vector).sqrt();
    if norm < f64::INFINITY {
        return norm;
    }
    let largest = vector
        .iter()
        .fold(0.0, |most, entry| larger(most, entry.abs()));
    largest * squared_norm(&vector.map(|entry| entry / largest)).sqrt()
}

/// An orthonormal basis; row k is the k-th axis.
pub(crate) struct Frame<const D: usize> {
    pub(crate) axes: [SVector<f64, D>; D],
}

impl<const D: usize> Frame<D> {
    /// Creates the frame of an agent with this velocity.
    ///
    /// For D = 3 the heading does not determine the roll. The axis left then points along the component
    /// across the heading of the first of `cues` that is not parallel to it. If all are parallel, any roll
    /// gives the same observation.
    pub(crate) fn new(
        velocity: &SVector<f64, D>,
        cues: impl IntoIterator<Item = SVector<f64, D>>,
    ) -> Self {
        let ahead = unit(velocity).unwrap_or_else(|| least_aligned_axis(velocity));
        Self::along(ahead, cues)
    }

    /// As [`Self::new`], from the heading, a unit vector.
    pub(crate) fn along(
        ahead: SVector<f64, D>,
        cues: impl IntoIterator<Item = SVector<f64, D>>,
    ) -> Self {
        let mut axes = [ahead; D];
        if D == 2 {
            axes[1][0] = -ahead[1];
            axes[1][1] = ahead[0];
        } else {
            let fallback = least_aligned_axis(&ahead);
            let left = cues
                .into_iter()
                .chain(std::iter::once(fallback))
                .find_map(|cue| {
                    let across = cue - ahead * ahead.dot(&cue);
                    // A component of the size of the rounding error has an arbitrary direction.
                    (across.norm() > 1e-9 * cue.norm()).then(|| unit(&across))?
                })
                .unwrap_or(fallback);
            axes[1] = left;
            axes[2][0] = ahead[1] * left[2] - ahead[2] * left[1];
            axes[2][1] = ahead[2] * left[0] - ahead[0] * left[2];
            axes[2][2] = ahead[0] * left[1] - ahead[1] * left[0];
        }
        Self { axes }
    }

    /// Returns the vector that has these coordinates in this frame.
    pub(crate) fn vector(&self, coordinates: &SVector<f64, D>) -> SVector<f64, D> {
        let parts = self.axes.iter().zip(coordinates.iter());
        parts.fold(SVector::zeros(), |sum, (axis, part)| sum + axis * *part)
    }

    /// Returns the coordinates of `vector` in this frame.
    pub(crate) fn coordinates(&self, vector: &SVector<f64, D>) -> [f64; D] {
        std::array::from_fn(|k| self.axes[k].dot(vector))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;
    use std::f64::consts::PI;

    #[test]
    fn coordinates_in_plane_and_space() {
        let plane = Frame::new(&vector![0.0, 2.0], []);
        assert_eq!(plane.coordinates(&vector![-3.0, 4.0]), [4.0, 3.0]);
        assert_eq!(plane.vector(&vector![4.0, 3.0]), vector![-3.0, 4.0]);
        let space = Frame::new(
            &vector![0.0, 0.0, 5.0],
            [vector![0.0, 0.0, 1.0], vector![0.0, 7.0, 1.0]],
        );
        assert_eq!(space.coordinates(&vector![1.0, 2.0, 3.0]), [3.0, 2.0, -1.0]);
    }

    #[test]
    fn turns_at_the_limit_and_keeps_its_length() {
        let turned = turn_toward(&vector![1.0, 0.0], &vector![0.0, 1.0], PI / 6.0);
        assert!((turned - vector![(PI / 6.0).cos(), 0.5]).norm() < 1e-15);
        let direct = turn_toward(&vector![1.0, 0.0], &vector![0.0, 1.0], PI);
        assert_eq!(direct, vector![0.0, 1.0]);
    }

    #[test]
    fn keeps_its_length_although_the_aim_is_nearly_straight_behind() {
        let heading = unit(&vector![0.6, -0.3, 0.7]).expect("a direction");
        for offset in [1e-6, 1e-9, 1e-12, 1e-15] {
            let aim = unit(&(vector![offset, 0.0, 0.0] - heading)).expect("a direction");
            let turned = turn_toward(&heading, &aim, 0.1);
            assert!((turned.norm() - 1.0).abs() < 1e-15, "{offset}");
            assert!(
                (heading.dot(&turned) - libm::cos(0.1)).abs() < 1e-15,
                "{offset}"
            );
        }
    }

    #[test]
    fn turns_although_the_aim_is_straight_behind() {
        let turned = turn_toward(&vector![1.0, 0.0, 0.0], &vector![-1.0, 0.0, 0.0], 0.1);
        assert!((turned.norm() - 1.0).abs() < 1e-15);
        assert!((turned.x - libm::cos(0.1)).abs() < 1e-15);
    }

    #[test]
    fn flies_straight_on_at_its_aim_and_starts_from_rest() {
        let (up, none) = (vector![0.0, 2.0], vector![0.0, 0.0]);
        assert_eq!(heading_toward(&up, &none, 1.0), None);
        assert_eq!(heading_toward(&none, &up, 0.0), Some(vector![0.0, 1.0]));
    }
}
