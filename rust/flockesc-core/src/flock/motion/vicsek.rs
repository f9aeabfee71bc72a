//! Heading replaced at once, as in T. Vicsek et al., PRL 75, 1226 (1995).

use serde::Deserialize;

use super::Force;
use super::traits::Traits;
use crate::agents::{GROUP, Group};
use crate::base::vector::{SHORTEST, squared_norm};
use crate::flock::scenario::FlockConfig;

/// Agents without mass: the force is the new heading.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vicsek {}

/// r += dt v with the old velocity, then v = v0 f / ||f|| (the old v where f counts as 0).
#[inline(always)]
pub(super) fn integrate<const D: usize>(
    config: &FlockConfig,
    traits: &Traits,
    force: &Force<D>,
    group: &mut Group<D>,
) {
    for lane in 0..GROUP {
        let pull: [f64; D] = std::array::from_fn(|axis| force[axis][lane]);
        let norm = squared_norm(&pull).sqrt();
        let factor = traits.speed[lane] / norm;
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
            group.speed[lane] = traits.speed[lane];
        }
    }
}
