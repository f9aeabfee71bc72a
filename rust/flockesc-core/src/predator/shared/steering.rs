//! Turning a heading by a limited angle.

use nalgebra::SVector;

use crate::base::vector::{least_aligned_axis, side_of, turn, unit};

/// The unit vector `heading` turned toward the unit vector `sight` by at most `limit` rad, in their plane.
fn turn_toward<const D: usize>(
    heading: &SVector<f64, D>,
    sight: &SVector<f64, D>,
    limit: f64,
) -> SVector<f64, D> {
    let along = heading.dot(sight);
    if libm::atan2((sight - heading * along).norm(), along) <= limit {
        return *sight;
    }
    // For an aim straight behind both sides are equal: it turns to the axis least along the heading.
    let side = side_of(heading, sight).or_else(|| side_of(heading, &least_aligned_axis(heading)));
    side.map_or(*heading, |side| turn(heading, &side, limit))
}

/// The next heading of a predator that turns by at most `limit` rad toward a place at `offset`; `None` if it is there.
/// From rest it sets off straight toward the place.
pub(in crate::predator) fn heading_toward<const D: usize>(
    velocity: &SVector<f64, D>,
    offset: &SVector<f64, D>,
    limit: f64,
) -> Option<SVector<f64, D>> {
    let sight = unit(offset)?;
    let turned = unit(velocity).map(|heading| turn_toward(&heading, &sight, limit));
    Some(turned.unwrap_or(sight))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;
    use std::f64::consts::PI;

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
    fn flies_on_over_its_aim_and_sets_off_from_rest() {
        let (up, none) = (vector![0.0, 2.0], vector![0.0, 0.0]);
        assert_eq!(heading_toward(&up, &none, 1.0), None);
        assert_eq!(heading_toward(&none, &up, 0.0), Some(vector![0.0, 1.0]));
    }
}
