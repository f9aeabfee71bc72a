//! Reynolds' law: the paper's law plus separation and cohesion, as in C. W. Reynolds' boids (1987).

use serde::{Deserialize, Serialize};

use super::columns::ParameterColumns;
use super::forces::Force;
use super::inertial::integrate;
use super::law::{GroupPairs, Law};
use super::parameters::Parameters;
use crate::agents::{GROUP, Group};
use crate::base::check::{not_negative, quantity};
use crate::base::error::Result;
use crate::base::vector::{SHORTEST, squared_norm};
use crate::neighbor::OffsetBuffers;

/// Forces change velocities, and neighbors also attract and repel each other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reynolds {
    /// Weight of the force away from close neighbors, at least 0.
    pub separation_strength: f64,
    /// Weight of the force toward the center of the neighbors, at least 0.
    pub cohesion_strength: f64,
    /// Distance in m up to which a neighbor is close, at least 0.
    pub separation_range: f64,
}

impl Law for Reynolds {
    fn check(&self, path: &str, _constant_speed: bool) -> Result<()> {
        let field = |name: &str| format!("{path}.{name}");
        quantity(&field("separation_strength"), self.separation_strength)?;
        quantity(&field("cohesion_strength"), self.cohesion_strength)?;
        not_negative(&field("separation_range"), self.separation_range)
    }

    fn needs_pairs(&self) -> bool {
        true
    }

    /// Adds the separation force and the cohesion force. The norm of each is its strength times v0.
    fn add_pair_forces<const D: usize>(
        &self,
        pairs: &GroupPairs<'_, D>,
        buffers: &mut OffsetBuffers<D>,
        force: &mut Force<D>,
    ) {
        let GroupPairs {
            pairs,
            group,
            columns,
            scale,
        } = *pairs;
        let sums = pairs.sum_offsets(group, scale, self.separation_range, buffers);
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

    #[inline(always)]
    fn integrate<const D: usize>(
        &self,
        parameters: &Parameters<'_>,
        columns: &ParameterColumns,
        force: &Force<D>,
        group: &mut Group<D>,
    ) {
        integrate(parameters, columns, force, group);
    }
}
