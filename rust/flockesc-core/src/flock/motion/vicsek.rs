//! Vicsek's law: the heading is the direction of the force, as in T. Vicsek et al., PRL 75, 1226 (1995).

use serde::{Deserialize, Serialize};

use super::columns::ParameterColumns;
use super::forces::Force;
use super::law::Law;
use super::parameters::Parameters;
use crate::agents::{GROUP, Group};
use crate::base::error::{Error, Result};
use crate::base::vector::{SHORTEST, squared_norm};

/// The direction of the force is the new heading; the mass has no effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vicsek {}

impl Law for Vicsek {
    fn check(&self, _path: &str, constant_speed: bool) -> Result<()> {
        if constant_speed {
            return Ok(());
        }
        let expected = "true if motion is vicsek";
        Err(Error::config("constant_speed", expected, constant_speed))
    }

    /// Adds dt v to r and sets v to v0 f / ||f||. If f has length 0, the old v stays.
    #[inline(always)]
    fn integrate<const D: usize>(
        &self,
        parameters: &Parameters<'_>,
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
                group.position[axis][lane] += velocity * parameters.time_step;
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
}
