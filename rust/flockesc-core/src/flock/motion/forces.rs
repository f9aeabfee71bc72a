//! The forces of step 2.

use super::Force;
use super::traits::Traits;
use crate::agents::{Column, GROUP, Group};
use crate::base::vector::{SHORTEST, squared_norm};
use crate::flock::scenario::FlockConfig;
use crate::neighbor::Heard;

/// a v0 <v>_i / ||<v>_i|| (Eq. 11), the direction of the sum; 0 where that is exactly 0.
#[inline(always)]
pub(super) fn consensus_force<const D: usize>(traits: &Traits, heard: &mut Heard<D>) -> Force<D> {
    let mut force = [[0.0; GROUP]; D];
    for lane in 0..GROUP {
        let sum: [f64; D] = std::array::from_fn(|axis| heard.sum[axis][lane] as f64);
        let norm = squared_norm(&sum).sqrt();
        let factor = if norm > 0.0 {
            traits.alignment[lane] / norm
        } else {
            0.0
        };
        heard.norm[lane] = norm;
        for axis in 0..D {
            force[axis][lane] = sum[axis] * factor;
        }
    }
    force
}

/// s (r_i - r_p) / ||r_i - r_p|| where that `distance` is at most rho_p; 0 where it counts as 0.
#[inline(always)]
pub(super) fn add_escape_force<const D: usize>(
    config: &FlockConfig,
    traits: &Traits,
    group: &Group<D>,
    predator: &[f64; D],
    distance: &Column<f64>,
    force: &mut Force<D>,
) {
    for lane in 0..GROUP {
        let is_felt = distance[lane] <= config.predator_range && distance[lane] > SHORTEST;
        let factor = if is_felt {
            traits.repulsion[lane] / distance[lane]
        } else {
            0.0
        };
        for axis in 0..D {
            force[axis][lane] += (group.position[axis][lane] - predator[axis]) * factor;
        }
    }
}
