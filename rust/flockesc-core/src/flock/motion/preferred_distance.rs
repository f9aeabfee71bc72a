//! The paper's law plus attraction and repulsion with a preferred distance.

use super::forces::{Force, Neighbors, ParameterColumns};
use super::law::PreferredDistance;
use crate::agents::GROUP;
use crate::base::vector::{SHORTEST, squared_norm};
use crate::neighbor::OffsetBuffers;

impl PreferredDistance {
    /// Adds the mean over the other neighbors of the attraction to the agents of a group.
    pub(super) fn add_forces<const D: usize>(
        &self,
        neighbors: &Neighbors<'_, D>,
        group: usize,
        columns: &ParameterColumns,
        buffers: &mut OffsetBuffers<D>,
        force: &mut Force<D>,
    ) {
        let [pull] = neighbors.pairs.sum_terms(group, buffers, |_, offset| {
            let distance = squared_norm(&offset).sqrt();
            let factor = libm::tanh((distance - self.distance) / self.width) / distance;
            (distance > SHORTEST).then(|| (0, offset.map(|entry| entry * factor)))
        });
        for lane in 0..GROUP {
            let others = (neighbors.sums[group].count[lane] - 1).max(1) as f64;
            let factor = self.strength * columns.speed[lane] / others;
            for axis in 0..D {
                force[axis][lane] += pull[axis][lane] * factor;
            }
        }
    }
}
