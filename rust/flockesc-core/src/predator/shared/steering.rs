//! Turns of a heading toward a point by a limited angle.

use nalgebra::SVector;

use crate::base::vector::{least_aligned_axis, side_of, turn, unit};

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
    // If the aim is straight behind, the side is ambiguous: turn toward the axis that is least aligned with
    // the heading.
    let side =
        side_of(heading, direction).or_else(|| side_of(heading, &least_aligned_axis(heading)));
    side.map_or(*heading, |side| turn(heading, &side, limit))
}

/// Returns the next heading of a predator that turns toward a point at `offset` by at most `limit` rad, or
/// `None` if the offset is 0. A predator at rest starts straight toward the point.
pub(in crate::predator) fn heading_toward<const D: usize>(
    velocity: &SVector<f64, D>,
    offset: &SVector<f64, D>,
    limit: f64,
) -> Option<SVector<f64, D>> {
    let direction = unit(offset)?;
    let turned = unit(velocity).map(|heading| turn_toward(&heading, &direction, limit));
    Some(turned.unwrap_or(direction))
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
    fn flies_straight_on_at_its_aim_and_starts_from_rest() {
        let (up, none) = (vector![0.0, 2.0], vector![0.0, 0.0]);
        assert_eq!(heading_toward(&up, &none, 1.0), None);
        assert_eq!(heading_toward(&none, &up, 0.0), Some(vector![0.0, 1.0]));
    }
}
