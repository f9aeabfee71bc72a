//! Neighbor search over all pairs.

use crate::flock::Point;

/// Writes the sum of the velocities of each agent's neighbors.
pub(crate) fn sum_neighbors(
    positions: &[Point],
    velocities: &[Point],
    range: f64,
    sums: &mut [Point],
) {
    for (position, sums) in positions.iter().zip(sums) {
        *sums = sum_in_range(*position, positions, velocities, range);
    }
}

/// Returns the sum of the velocities of the agents within `range` of `position`.
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
