//! Separation and cohesion, the two of the three rules of C. W. Reynolds' boids (1987) that the paper's law has not.

use serde::Deserialize;

use super::Force;
use super::traits::Traits;
use crate::agents::GROUP;
use crate::config::not_negative;
use crate::error::Result;
use crate::exact::Scale;
use crate::metrics::squared_norm;
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
    /// Lane of an agent and the way to a neighbor in m, agent by agent.
    offsets: Vec<(usize, [f64; D])>,
    /// One agent's vectors to be summed.
    terms: Vec<[f64; D]>,
}

impl<const D: usize> Lists<D> {
    pub(super) fn new() -> Self {
        Self {
            tiles: Vec::new(),
            offsets: Vec::new(),
            terms: Vec::new(),
        }
    }
}

impl Reynolds {
    pub(super) fn check(&self) -> Result<()> {
        not_negative(
            "motion.reynolds.separation_strength",
            self.separation_strength,
        )?;
        not_negative("motion.reynolds.cohesion_strength", self.cohesion_strength)?;
        not_negative("motion.reynolds.separation_range", self.separation_range)
    }

    /// Adds both forces on the agents of a group, each of the norm of its weight times v0.
    pub(super) fn add_forces<const D: usize>(
        &self,
        pairs: &Pairs<'_, D>,
        group: usize,
        traits: &Traits,
        lists: &mut Lists<D>,
        force: &mut Force<D>,
    ) {
        let Lists {
            tiles,
            offsets,
            terms,
        } = lists;
        offsets.clear();
        pairs.visit(group, tiles, |lane, place| {
            if place != group * GROUP + lane {
                offsets.push((lane, pairs.offset(group, lane, place).0));
            }
        });
        let close = self.separation_range * self.separation_range;
        for neighbors in offsets.chunk_by(|a, b| a.0 == b.0) {
            let lane = neighbors[0].0;
            let mut add = |terms: &[[f64; D]], strength: f64| {
                let sum = sum(terms);
                let norm = squared_norm(&sum).sqrt();
                if norm > 0.0 {
                    let factor = strength * traits.speed[lane] / norm;
                    for axis in 0..D {
                        force[axis][lane] += sum[axis] * factor;
                    }
                }
            };
            terms.clear();
            terms.extend(neighbors.iter().map(|(_, offset)| *offset));
            add(terms, self.cohesion_strength);
            terms.retain_mut(|offset| {
                let square = squared_norm(offset);
                let is_close = square > 0.0 && square <= close;
                if is_close {
                    *offset = offset.map(|entry| -entry / square);
                }
                is_close
            });
            add(terms, self.separation_strength);
        }
    }
}

/// The sum of some vectors, free of their order: as multiples of what the largest of their entries allows for.
fn sum<const D: usize>(terms: &[[f64; D]]) -> [f64; D] {
    let entries = terms.iter().flatten();
    let largest = entries.fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
    let scale = Scale::new(largest, terms.len().max(1));
    let mut units = [0; D];
    for term in terms {
        for axis in 0..D {
            units[axis] += scale.truncate(term[axis]);
        }
    }
    units.map(|sum: i64| scale.value(sum))
}
