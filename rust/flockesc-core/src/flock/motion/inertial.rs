//! The paper's law: forces change velocities (steps 3 and 4).

use serde::{Deserialize, Serialize};

use super::forces::Force;
use super::law::Law;
use super::parameters::Parameters;
use super::traits::Traits;
use crate::agents::{GROUP, Group};
use crate::base::vector::{SHORTEST, squared_norm};

/// Forces change velocities.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Inertial {}

impl Law for Inertial {
    #[inline(always)]
    fn integrate<const D: usize>(
        &self,
        parameters: &Parameters<'_>,
        traits: &Traits,
        force: &Force<D>,
        group: &mut Group<D>,
    ) {
        integrate(parameters, traits, force, group);
    }
}

/// r += dt v with the old velocity, v += (dt / m) f, then v is scaled to speed v0 (a v of length 0 is not applied).
#[inline(always)]
pub(super) fn integrate<const D: usize>(
    parameters: &Parameters<'_>,
    traits: &Traits,
    force: &Force<D>,
    group: &mut Group<D>,
) {
    let Parameters {
        time_step,
        constant_speed,
        ..
    } = *parameters;
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
