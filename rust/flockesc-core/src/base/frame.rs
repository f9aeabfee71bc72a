//! Body frames of agents and predators: the axis ahead is the heading; left and, for D = 3, up complete a
//! right-handed orthonormal basis.

use nalgebra::SVector;

use crate::base::vector::{least_aligned_axis, unit};

/// An orthonormal basis; row k is the k-th axis.
pub(crate) struct Frame<const D: usize> {
    axes: [SVector<f64, D>; D],
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

    /// Returns the axes.
    pub(crate) fn axes(&self) -> &[SVector<f64, D>; D] {
        &self.axes
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
}
