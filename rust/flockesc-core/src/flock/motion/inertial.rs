//! The laws without forces between pairs: the paper's (steps 3 and 4) and Vicsek's.

use super::forces::{Force, ParameterColumns};
use crate::agents::{GROUP, Group};
use crate::base::vector::{SHORTEST, squared_norm};
use crate::flock::scenario::FlockConfig;

/// Adds dt v to r, adds (dt / m) f to v, and scales v to the speed v0 if the speed is constant. If the new v
/// has length 0, the old v stays.
#[inline(always)]
pub(super) fn integrate<const D: usize>(
    config: &FlockConfig,
    columns: &ParameterColumns,
    force: &Force<D>,
    group: &mut Group<D>,
) {
    let (time_step, constant_speed) = (config.time_step, config.constant_speed);
    let mut speeds = [0.0; GROUP];
    for lane in 0..GROUP {
        let speed = columns.speed[lane];
        let velocity: [f64; D] = std::array::from_fn(|axis| group.velocity[axis][lane]);
        let pushed: [f64; D] =
            std::array::from_fn(|axis| velocity[axis] + force[axis][lane] * columns.gain[lane]);
        let norm = squared_norm(&pushed).sqrt();
        let is_kept = constant_speed && norm <= SHORTEST;
        let factor = if constant_speed { speed / norm } else { 1.0 };
        // Values that stay are multiplied by 1 or go to a new column. The compiler would otherwise skip them with
        // masked stores, which take some processors with AVX2 tens of operations.
        let factor = if is_kept { 1.0 } else { factor };
        for axis in 0..D {
            group.position[axis][lane] += group.velocity[axis][lane] * time_step;
            let velocity = if is_kept {
                velocity[axis]
            } else {
                pushed[axis]
            };
            group.velocity[axis][lane] = velocity * factor;
        }
        let new_speed = if constant_speed { speed } else { norm };
        speeds[lane] = if is_kept {
            group.speed[lane]
        } else {
            new_speed
        };
    }
    group.speed = speeds;
}

/// Vicsek's law: adds dt v to r and sets v to v0 f / ||f||, as in T. Vicsek et al., PRL 75, 1226 (1995). If f has
/// length 0, the old v stays.
#[inline(always)]
pub(super) fn integrate_vicsek<const D: usize>(
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
