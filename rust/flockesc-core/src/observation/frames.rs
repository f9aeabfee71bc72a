//! `Vectors`: what the agents of one group see and hear, along the axes of the world, and their body frames.

use multiversion::multiversion;
use nalgebra::SVector;

use super::Extras;
use super::scene::Common;
use crate::agents::{Column, GROUP, Group};
use crate::base::exact::{Scale, to_float};
use crate::base::vector::{Frame, SHORTEST, squared_norm};
use crate::neighbor::NeighborSums;
use crate::predator::Predator;

/// The values that are the same for all agents of a flock.
pub(super) struct Shared<'a, const D: usize> {
    pub(super) common: Common,
    pub(super) extras: Extras<'a>,
    pub(super) predators: &'a [Predator<D>],
    /// The places of the predators at their closest approach to the flock, in m. Empty unless an entry needs
    /// them.
    pub(super) places: Vec<[f64; D]>,
    /// Units of the sums over the neighbors of the last step and of the candidates, in m/s.
    pub(super) unit: Scale,
    pub(super) candidate_unit: Scale,
}

/// The axes of the body frames of the agents of one group.
pub(super) type Axes<const D: usize> = [[Column<f64>; D]; D];

/// Columns of vectors along the axes of the world, for the agents of one group.
pub(super) struct Vectors<const D: usize> {
    /// v_i in m/s.
    pub(super) own: Velocities<D>,
    /// v_i / ||v_i||. Unspecified if v_i is 0.
    pub(super) heading: [Column<f64>; D],
    /// Mean velocity of the neighbors and the agent itself in m/s.
    pub(super) heard: Velocities<D>,
    /// Whether the agent senses the nearest predator. The vectors below are otherwise 0.
    pub(super) is_sensed: [bool; GROUP],
    /// Unit vector toward the nearest predator, or 0.
    pub(super) predator_direction: [Column<f64>; D],
    /// Velocity of the nearest predator relative to the agent in m/s.
    pub(super) approach: Velocities<D>,
    /// Unit vector from the place of the nearest predator at its closest approach to the flock, or 0.
    pub(super) escape: [Column<f64>; D],
}

impl<const D: usize> Vectors<D> {
    pub(super) const EMPTY: Self = Self {
        own: Velocities::EMPTY,
        heading: [[0.0; GROUP]; D],
        heard: Velocities::EMPTY,
        is_sensed: [false; GROUP],
        predator_direction: [[0.0; GROUP]; D],
        approach: Velocities::EMPTY,
        escape: [[0.0; GROUP]; D],
    };

    /// Computes the axes of the body frames of the agents in the first `filled` lanes. The sums over the
    /// neighbors under every candidate range are further cues of an agent's roll.
    pub(super) fn find_axes(
        &self,
        group: &Group<D>,
        filled: usize,
        candidates: &[NeighborSums<D>],
        axes: &mut Axes<D>,
    ) {
        // PERF: In the plane the heading determines the frame. Only agents at rest need cues, in the loop below.
        if D == 2 {
            axes[0] = self.heading;
            axes[1][1] = self.heading[0];
            for (left, ahead) in axes[1][0].iter_mut().zip(&self.heading[1]) {
                *left = -ahead;
            }
            let moving = self.own.norms[..filled].iter();
            if moving.fold(true, |all, norm| all & (*norm > SHORTEST)) {
                return;
            }
        }
        for lane in 0..filled {
            let at = |columns: &[Column<f64>; D]| -> SVector<f64, D> {
                SVector::from_fn(|axis, _| columns[axis][lane])
            };
            let of_candidate = |sums: &NeighborSums<D>| -> SVector<f64, D> {
                SVector::from_fn(|axis, _| sums.sum[axis][lane] as f64)
            };
            let cues = [
                &self.predator_direction,
                &self.heard.vectors,
                &self.approach.vectors,
            ];
            let cues = cues.into_iter().map(at);
            let cues = cues.chain(candidates.iter().map(of_candidate));
            let frame = if self.own.norms[lane] > SHORTEST {
                Frame::along(at(&self.heading), cues)
            } else {
                Frame::new(&at(&group.velocity), cues)
            };
            for (columns, axis) in axes.iter_mut().zip(&frame.axes) {
                for k in 0..D {
                    columns[k][lane] = axis[k];
                }
            }
        }
    }
}

/// Computes the vectors of one group. `heard` are the sums over its agents' neighbors.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn perceive<const D: usize>(
    group: &Group<D>,
    heard: &NeighborSums<D>,
    shared: &Shared<'_, D>,
    vectors: &mut Vectors<D>,
) {
    find_nearest_predator(group, shared, vectors);
    for lane in 0..GROUP {
        let length = group.distance[lane];
        let is_sensed = length < f64::INFINITY && length <= shared.common.sensing_length;
        vectors.is_sensed[lane] = is_sensed;
        let has_direction = is_sensed && length > SHORTEST;
        for axis in 0..D {
            let direction = &mut vectors.predator_direction[axis][lane];
            let unit = *direction / length;
            *direction = if has_direction { unit } else { 0.0 };
            let velocity = &mut vectors.approach.vectors[axis][lane];
            *velocity = if is_sensed { *velocity } else { 0.0 };
        }
    }
    vectors.approach.measure();
    vectors.own.vectors = group.velocity;
    vectors.own.measure();
    vectors.heard.set_to_means(heard, shared.unit);
    for lane in 0..GROUP {
        for axis in 0..D {
            vectors.heading[axis][lane] = group.velocity[axis][lane] / vectors.own.norms[lane];
        }
    }
    if shared.extras.has_escape() {
        for lane in 0..GROUP {
            let offset: [f64; D] = std::array::from_fn(|axis| vectors.escape[axis][lane]);
            let length = squared_norm(&offset).sqrt();
            let has_direction = vectors.is_sensed[lane] && length > SHORTEST;
            for axis in 0..D {
                let unit = offset[axis] / length;
                vectors.escape[axis][lane] = if has_direction { unit } else { 0.0 };
            }
        }
    }
}

/// Computes the offset and the relative velocity of the predator nearest to every agent, and the offset from
/// its place at the closest approach to the flock. They keep their values without predators.
#[inline(always)]
fn find_nearest_predator<const D: usize>(
    group: &Group<D>,
    shared: &Shared<'_, D>,
    vectors: &mut Vectors<D>,
) {
    let mut nearest = [f64::INFINITY; GROUP];
    for (index, predator) in shared.predators.iter().enumerate() {
        let place = shared.places.get(index).copied();
        let place = place.unwrap_or(predator.position.into());
        for lane in 0..GROUP {
            let offset: [f64; D] =
                std::array::from_fn(|axis| predator.position[axis] - group.position[axis][lane]);
            let square = squared_norm(&offset);
            // PERF: Selections instead of a branch, so that all lanes are computed together.
            let is_nearer = square < nearest[lane];
            nearest[lane] = if is_nearer { square } else { nearest[lane] };
            for axis in 0..D {
                let velocity = predator.velocity[axis] - group.velocity[axis][lane];
                let away = group.position[axis][lane] - place[axis];
                for (column, value) in [
                    (&mut vectors.predator_direction, offset[axis]),
                    (&mut vectors.approach.vectors, velocity),
                    (&mut vectors.escape, away),
                ] {
                    let before = column[axis][lane];
                    column[axis][lane] = if is_nearer { value } else { before };
                }
            }
        }
    }
}

/// Computes the coordinates of vectors in body frames with these `axes`.
#[inline(always)]
pub(super) fn put_in_frames<const D: usize>(
    axes: &Axes<D>,
    vectors: &[Column<f64>; D],
    coordinates: &mut [Column<f64>; D],
) {
    for k in 0..D {
        for lane in 0..GROUP {
            let first = axes[k][0][lane] * vectors[0][lane];
            coordinates[k][lane] = (1..D).fold(first, |sum, axis| {
                sum + axes[k][axis][lane] * vectors[axis][lane]
            });
        }
    }
}

/// Columns of velocities in m/s, along the axes of the world, and their norms.
pub(super) struct Velocities<const D: usize> {
    pub(super) vectors: [Column<f64>; D],
    pub(super) norms: Column<f64>,
}

impl<const D: usize> Velocities<D> {
    pub(super) const EMPTY: Self = Self {
        vectors: [[0.0; GROUP]; D],
        norms: [0.0; GROUP],
    };

    /// Sets the velocities to the means of sums over neighbors; `unit` is the unit of the sums.
    #[inline(always)]
    pub(super) fn set_to_means(&mut self, sums: &NeighborSums<D>, unit: Scale) {
        for axis in 0..D {
            for lane in 0..GROUP {
                let sum = unit.value(sums.sum[axis][lane]);
                self.vectors[axis][lane] = sum / to_float(sums.count[lane]);
            }
        }
        self.measure();
    }

    /// Computes the norms.
    #[inline(always)]
    pub(super) fn measure(&mut self) {
        for lane in 0..GROUP {
            let vector: [f64; D] = std::array::from_fn(|axis| self.vectors[axis][lane]);
            self.norms[lane] = squared_norm(&vector).sqrt();
        }
    }

    /// Returns every velocity w scaled to w / (||w|| + `speed`).
    #[inline(always)]
    pub(super) fn scaled(&self, speed: f64) -> [Column<f64>; D] {
        let mut scaled = self.vectors;
        for lane in 0..GROUP {
            let divisor = self.norms[lane] + speed;
            for column in &mut scaled {
                column[lane] /= divisor;
            }
        }
        scaled
    }

    /// Computes the cosines of the angles between the velocities and unit vectors; 0 for a velocity of 0.
    #[inline(always)]
    pub(super) fn cosines(&self, units: &[Column<f64>; D], cosines: &mut Column<f64>) {
        for lane in 0..GROUP {
            let product = (0..D).fold(0.0, |sum, axis| {
                sum + self.vectors[axis][lane] * units[axis][lane]
            });
            let norm = self.norms[lane];
            cosines[lane] = if norm > SHORTEST { product / norm } else { 0.0 };
        }
    }
}
