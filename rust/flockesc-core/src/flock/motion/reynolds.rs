//! Reynolds' law: the paper's law plus separation and cohesion, as in C. W. Reynolds' boids (1987).

use super::forces::{Force, Neighbors, ParameterColumns};
use super::law::Reynolds;
use crate::agents::GROUP;
use crate::base::vector::{SHORTEST, squared_norm};
use crate::neighbor::OffsetBuffers;

impl Reynolds {
    /// Adds the separation force and the cohesion force to the agents of a group. The norm of each is its
    /// strength times v0.
    pub(super) fn add_forces<const D: usize>(
        &self,
        neighbors: &Neighbors<'_, D>,
        group: usize,
        columns: &ParameterColumns,
        buffers: &mut OffsetBuffers<D>,
        force: &mut Force<D>,
    ) {
        let Neighbors { pairs, scale, .. } = neighbors;
        let sums = pairs.sum_offsets(group, *scale, self.separation_range, buffers);
        let mut add = |lane: usize, vector: [f64; D], strength: f64| {
            let norm = squared_norm(&vector).sqrt();
            if norm > SHORTEST {
                let factor = strength * columns.speed[lane] / norm;
                for axis in 0..D {
                    force[axis][lane] += vector[axis] * factor;
                }
            }
        };
        for lane in 0..GROUP {
            // The sum of the offsets has the same direction as their mean.
            let center = std::array::from_fn(|axis| scale.value(sums.toward_all[axis][lane]));
            add(lane, center, self.cohesion_strength);
            let away = std::array::from_fn(|axis| sums.from_close[axis][lane]);
            add(lane, away, self.separation_strength);
        }
    }
}
