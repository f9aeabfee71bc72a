//! Vicsek's law: the force replaces the heading at once, as in T. Vicsek et al., PRL 75, 1226 (1995).

use serde::{Deserialize, Serialize};

use super::forces::Force;
use super::law::Law;
use super::parameters::Parameters;
use super::traits::Traits;
use crate::agents::{GROUP, Group};
use crate::base::error::{Error, Result};
use crate::base::vector::{SHORTEST, squared_norm};

/// Agents without mass: the force is the new heading.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vicsek {}

impl Law for Vicsek {
    fn check(&self, _path: &str, constant_speed: bool) -> Result<()> {
        if constant_speed {
            return Ok(());
        }
        let expected = "true, as motion is vicsek";
        Err(Error::config("constant_speed", expected, constant_speed))
    }

    /// r += dt v with the old velocity, then v = v0 f / ||f|| (the old v if f has length 0).
    #[inline(always)]
    fn integrate<const D: usize>(
        &self,
        parameters: &Parameters<'_>,
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
                group.position[axis][lane] += velocity * parameters.time_step;
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
}
