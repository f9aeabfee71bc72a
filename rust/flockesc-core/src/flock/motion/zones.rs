//! Zones of repulsion, orientation and attraction, as in I. D. Couzin et al., J. Theor. Biol. 218, 1 (2002).

use nalgebra::SVector;

use super::forces::{Force, Neighbors, ParameterColumns};
use super::law::Zones;
use crate::agents::{GROUP, Group};
use crate::base::vector::{heading_toward, unit};
use crate::flock::scenario::FlockConfig;
use crate::neighbor::OffsetBuffers;

/// Indices of the sums over neighbors.
const AWAY: usize = 0;
const ALONG: usize = 1;

impl Zones {
    /// Sets the force of the agents of a group to a v0 along the direction that the zones give, or to 0 without one.
    pub(super) fn set_forces<const D: usize>(
        &self,
        neighbors: &Neighbors<'_, D>,
        group: usize,
        columns: &ParameterColumns,
        buffers: &mut OffsetBuffers<D>,
        force: &mut Force<D>,
    ) {
        let sums: [_; 2] = neighbors.pairs.sum_terms(group, buffers, |place, offset| {
            let offset = SVector::from(offset);
            let distance = offset.norm();
            if distance <= self.repulsion_radius {
                unit(&-offset).map(|away| (AWAY, away.into()))
            } else if distance <= self.orientation_radius {
                unit(&neighbors.agents.agent(place).velocity).map(|heading| (ALONG, heading.into()))
            } else {
                unit(&offset).map(|toward| (ALONG, toward.into()))
            }
        });
        for lane in 0..GROUP {
            let sum = |index: usize| SVector::<f64, D>::from_fn(|axis, _| sums[index][axis][lane]);
            // Repulsion has priority.
            let direction = unit(&sum(AWAY)).or_else(|| unit(&sum(ALONG)));
            for axis in 0..D {
                let entry = direction.map_or(0.0, |direction| direction[axis]);
                force[axis][lane] = entry * columns.alignment[lane];
            }
        }
    }

    /// Adds dt v to r, and turns v toward f by at most the largest turn. If f has length 0, the old v stays.
    pub(super) fn integrate<const D: usize>(
        &self,
        config: &FlockConfig,
        columns: &ParameterColumns,
        force: &Force<D>,
        group: &mut Group<D>,
    ) {
        let limit = self.max_turn_rate * config.time_step;
        for lane in 0..GROUP {
            let velocity = SVector::<f64, D>::from_fn(|axis, _| group.velocity[axis][lane]);
            let pull = SVector::from_fn(|axis, _| force[axis][lane]);
            let turned = heading_toward(&velocity, &pull, limit);
            for axis in 0..D {
                group.position[axis][lane] += velocity[axis] * config.time_step;
                if let Some(heading) = turned {
                    group.velocity[axis][lane] = heading[axis] * columns.speed[lane];
                }
            }
            if turned.is_some() {
                group.speed[lane] = columns.speed[lane];
            }
        }
    }
}
