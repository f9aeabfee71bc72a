//! The forces of step 2: consensus (Eq. 11) and escape.

use super::traits::Traits;
use crate::agents::{Column, GROUP, Group};
use crate::base::vector::{SHORTEST, squared_norm};
use crate::neighbor::NeighborSums;

/// A force on every agent of a group.
pub(super) type Force<const D: usize> = [Column<f64>; D];

/// a v0 <v>_i / ||<v>_i|| (Eq. 11), along the sum of velocities; 0 if the sum is exactly 0.
#[inline(always)]
pub(super) fn consensus_force<const D: usize>(
    traits: &Traits,
    sums: &mut NeighborSums<D>,
) -> Force<D> {
    let mut force = [[0.0; GROUP]; D];
    for lane in 0..GROUP {
        let sum: [f64; D] = std::array::from_fn(|axis| sums.sum[axis][lane] as f64);
        let norm = squared_norm(&sum).sqrt();
        let factor = if norm > 0.0 {
            traits.alignment[lane] / norm
        } else {
            0.0
        };
        sums.norm[lane] = norm;
        for axis in 0..D {
            force[axis][lane] = sum[axis] * factor;
        }
    }
    force
}

/// Adds s (r_i - r_p) / ||r_i - r_p|| to agents whose `distance` to the predator is at most `range`, rho_p in m, and not 0.
#[inline(always)]
pub(super) fn add_escape_force<const D: usize>(
    range: f64,
    traits: &Traits,
    group: &Group<D>,
    predator: &[f64; D],
    distance: &Column<f64>,
    force: &mut Force<D>,
) {
    for lane in 0..GROUP {
        let is_felt = distance[lane] <= range && distance[lane] > SHORTEST;
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
