//! Vicsek's law: the heading is the direction of the force, as in T. Vicsek et al., PRL 75, 1226 (1995).

use super::columns::ParameterColumns;
use super::forces::Force;
use crate::agents::{GROUP, Group};
use crate::base::vector::{SHORTEST, squared_norm};
use crate::flock::scenario::FlockConfig;

/// Adds dt v to r and sets v to v0 f / ||f||. If f has length 0, the old v stays.
#[inline(always)]
pub(super) fn integrate<const D: usize>(
    config: &FlockConfig,
    columns: &ParameterColumns,
    force: &Force<D>,
    group: &mut Group<D>,
) {
    for lane in 0..GROUP {
        let pull: [f64; D] = std::array::from_fn(|axis| force[axis][lane]);
        let norm = squared_norm(&pull).sqrt();
        let factor = columns.speed[lane] / norm;
        for axis in 0..D {
            let velocity = group.velocity[axis][lane];
            group.position[axis][lane] += velocity * config.time_step;
            group.velocity[axis][lane] = if norm > SHORTEST {
                pull[axis] * factor
            } else {
                velocity
            };
        }
        if norm > SHORTEST {
            group.speed[lane] = columns.speed[lane];
        }
    }
}
