//! The paper's law: forces change velocities.

use serde::Deserialize;

use super::Force;
use super::traits::Traits;
use crate::agents::{GROUP, Group};
use crate::base::vector::{SHORTEST, squared_norm};
use crate::flock::scenario::FlockConfig;

/// Steps 3 and 4.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inertial {}

/// r += dt v with the old velocity, v += (dt / m) f, then back to speed v0 (the old v where the new one counts as 0).
#[inline(always)]
pub(super) fn integrate<const D: usize>(
    config: &FlockConfig,
    traits: &Traits,
    force: &Force<D>,
    group: &mut Group<D>,
) {
    let FlockConfig {
        time_step,
        constant_speed,
        ..
    } = *config;
    for lane in 0..GROUP {
        let speed = traits.speed[lane];
        let velocity: [f64; D] = std::array::from_fn(|axis| group.velocity[axis][lane]);
        let pushed: [f64; D] =
            std::array::from_fn(|axis| velocity[axis] + force[axis][lane] * traits.gain[lane]);
        let norm = squared_norm(&pushed).sqrt();
        let is_kept = constant_speed && norm <= SHORTEST;
        let factor = if constant_speed { speed / norm } else { 1.0 };
        for axis in 0..D {
            group.position[axis][lane] += velocity[axis] * time_step;
            group.velocity[axis][lane] = if is_kept {
                velocity[axis]
            } else {
                pushed[axis] * factor
            };
        }
        let new_speed = if constant_speed { speed } else { norm };
        group.speed[lane] = if is_kept {
            group.speed[lane]
        } else {
            new_speed
        };
    }
}
