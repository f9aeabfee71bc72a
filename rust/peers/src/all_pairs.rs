//! Neighbors by testing all pairs.

use crate::flock::Point;

pub(crate) fn listen(positions: &[Point], velocities: &[Point], range: f64, heard: &mut [Point]) {
    for (position, heard) in positions.iter().zip(heard) {
        *heard = sum_in_range(*position, positions, velocities, range);
    }
}

/// Sum of the velocities of the candidates within `range` of `position`.
pub(crate) fn sum_in_range(
    position: Point,
    positions: &[Point],
    velocities: &[Point],
    range: f64,
) -> Point {
    let mut sum = [0.0; 2];
    for (other, velocity) in positions.iter().zip(velocities) {
        let (dx, dy) = (other[0] - position[0], other[1] - position[1]);
        if dx * dx + dy * dy <= range * range {
            sum[0] += velocity[0];
            sum[1] += velocity[1];
        }
    }
    sum
}
