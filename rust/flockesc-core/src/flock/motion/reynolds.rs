//! Separation and cohesion, the two of the three rules of C. W. Reynolds' boids (1987) that the paper's law has not.

use serde::Deserialize;

use super::Force;
use super::traits::Traits;
use crate::agents::GROUP;
use crate::base::check::{not_negative, quantity};
use crate::base::error::Result;
use crate::base::exact::Scale;
use crate::base::vector::{SHORTEST, squared_norm};
use crate::neighbor::Pairs;

/// Agents that also keep together and apart.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reynolds {
    /// Weight of the force away from close neighbors, at least 0.
    pub separation_strength: f64,
    /// Weight of the force toward the center of the neighbors, at least 0.
    pub cohesion_strength: f64,
    /// Distance in m up to which a neighbor is close, at least 0.
    pub separation_range: f64,
}

/// Lists that keep their memory from step to step.
#[derive(Debug, Clone)]
pub(super) struct Lists<const D: usize> {
    tiles: Vec<u32>,
    /// Lane of an agent and what a close neighbor adds to its separation, in 1/m, agent by agent.
    close: Vec<(usize, [f64; D])>,
}

impl<const D: usize> Lists<D> {
    pub(super) fn new() -> Self {
        Self {
            tiles: Vec::new(),
            close: Vec::new(),
        }
    }
}

impl Reynolds {
    pub(super) fn check(&self) -> Result<()> {
        quantity(
            "motion.reynolds.separation_strength",
            self.separation_strength,
        )?;
        quantity("motion.reynolds.cohesion_strength", self.cohesion_strength)?;
        not_negative("motion.reynolds.separation_range", self.separation_range)
    }

    /// Adds both forces on the agents of a group, each of the norm of its weight times v0. No coordinate of a way from one
    /// agent to another is beyond what `scale` is for.
    pub(super) fn add_forces<const D: usize>(
        &self,
        pairs: &Pairs<'_, D>,
        scale: Scale,
        group: usize,
        traits: &Traits,
        lists: &mut Lists<D>,
        force: &mut Force<D>,
    ) {
        let Lists { tiles, close } = lists;
        close.clear();
        let range = self.separation_range * self.separation_range;
        let mut ways = [[0; D]; GROUP];
        pairs.visit(group, tiles, |lane, place| {
            let (offset, squared) = pairs.offset(group, lane, place);
            for axis in 0..D {
                ways[lane][axis] += scale.quantize(offset[axis]);
            }
            if squared > SHORTEST * SHORTEST && squared <= range {
                close.push((lane, offset.map(|entry| -entry / squared)));
            }
        });
        let mut add = |lane: usize, vector: [f64; D], strength: f64| {
            let norm = squared_norm(&vector).sqrt();
            if norm > SHORTEST {
                let factor = strength * traits.speed[lane] / norm;
                for axis in 0..D {
                    force[axis][lane] += vector[axis] * factor;
                }
            }
        };
        for (lane, way) in ways.iter().enumerate() {
            // The direction of the sum is that of the mean.
            add(
                lane,
                way.map(|sum| scale.value(sum)),
                self.cohesion_strength,
            );
        }
        for neighbors in close.chunk_by(|a, b| a.0 == b.0) {
            add(neighbors[0].0, sum(neighbors), self.separation_strength);
        }
    }
}

/// The sum of some vectors, free of their order: as multiples of what the largest of their entries allows for.
fn sum<const D: usize>(terms: &[(usize, [f64; D])]) -> [f64; D] {
    let entries = terms.iter().flat_map(|(_, term)| term);
    let largest = entries.fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
    let scale = Scale::new(largest, terms.len());
    let mut units = [0; D];
    for (_, term) in terms {
        for axis in 0..D {
            units[axis] += scale.truncate(term[axis]);
        }
    }
    units.map(|sum: i64| scale.value(sum))
}
