//! First-order law: forces are velocities, as in Y. Chen and T. Kolokolnikov, J. R. Soc. Interface 11 (2014).

use super::forces::{Force, Neighbors, ParameterColumns};
use super::law::FirstOrder;
use crate::agents::{GROUP, Group};
use crate::base::vector::{SHORTEST, norm, squared_norm};
use crate::flock::scenario::FlockConfig;
use crate::neighbor::OffsetBuffers;

impl FirstOrder {
    /// Adds repulsion from the neighbors and attraction to them to the agents of a group.
    pub(super) fn add_forces<const D: usize>(
        &self,
        neighbors: &Neighbors<'_, D>,
        group: usize,
        buffers: &mut OffsetBuffers<D>,
        force: &mut Force<D>,
    ) {
        let [sums] = neighbors.pairs.sum_terms(group, buffers, |_, offset| {
            let squared = squared_norm(&offset);
            let factor = self.attraction - self.repulsion / squared;
            (squared > SHORTEST * SHORTEST).then(|| (0, offset.map(|entry| entry * factor)))
        });
        let n = neighbors.agents.len() as f64;
        for axis in 0..D {
            for lane in 0..GROUP {
                force[axis][lane] += sums[axis][lane] / n;
            }
        }
    }

    /// Sets v to f, scaled to the speed v0 if the speed is constant or f is longer, and adds dt v to r. If the speed
    /// is constant and f has length 0, the old v stays.
    pub(super) fn integrate<const D: usize>(
        config: &FlockConfig,
        columns: &ParameterColumns,
        force: &Force<D>,
        group: &mut Group<D>,
    ) {
        for lane in 0..GROUP {
            let pull: [f64; D] = std::array::from_fn(|axis| force[axis][lane]);
            let norm = norm(&pull); // at 1e-140 m from a neighbor, its square overflows
            let speed = columns.speed[lane];
            let is_scaled = config.constant_speed || norm > speed;
            let factor = if is_scaled { speed / norm } else { 1.0 };
            let is_kept = config.constant_speed && norm <= SHORTEST;
            for axis in 0..D {
                if !is_kept {
                    group.velocity[axis][lane] = pull[axis] * factor;
                }
                group.position[axis][lane] += group.velocity[axis][lane] * config.time_step;
            }
            if !is_kept {
                group.speed[lane] = if is_scaled { speed } else { norm };
            }
        }
    }
}
