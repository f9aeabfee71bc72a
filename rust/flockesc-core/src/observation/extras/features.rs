//! The values of the optional entries of the agents' observations, computed for the agents of one group.

use multiversion::multiversion;

use super::{ExtraEntries, Extras};
use crate::agents::{Column, GROUP, Group};
use crate::base::exact::{Scale, to_float};
use crate::base::vector::{SHORTEST, squared_norm};
use crate::flock::{HALF_COUNT, Straight, approaches};
use crate::neighbor::NeighborSums;
use crate::observation::columns::put_in_frames;
use crate::observation::table::squash;

/// Columns of values of the agents of one group, scaled as in their rows. Vectors are in the agents' body
/// frames. Values in empty lanes are unspecified.
#[derive(Debug)]
pub(in crate::observation) struct Features<const D: usize> {
    /// Unit vector away from the place of the predator at its closest approach to the flock.
    pub(super) escape: [Column<f64>; D],
    /// Half the cosine between the heard velocity and `escape`, minus half the one of the own heading.
    pub(super) heard_escape_gain: Column<f64>,
    pub(super) distance: Column<f64>,
    pub(super) time: Column<f64>,
    /// `distance` with the heading of the heard velocity.
    pub(super) heard_distance: Column<f64>,
    pub(super) candidates: Vec<Candidate<D>>,
}

/// The same under one candidate range.
#[derive(Debug, Clone)]
pub(super) struct Candidate<const D: usize> {
    pub(super) velocity: [Column<f64>; D],
    pub(super) neighbor_count: Column<f64>,
    pub(super) escape_cosine: Column<f64>,
    pub(super) distance: Column<f64>,
}

/// The values that are the same for all agents of a flock.
pub(super) struct Common<const D: usize> {
    pub(super) predators: Vec<Straight<D>>,
    /// The places of the predators at their closest approach to the flock, in m. Empty unless an entry needs
    /// them.
    pub(super) places: Vec<[f64; D]>,
    /// Distance in m up to which a predator is sensed.
    pub(super) sensing_length: f64,
    /// Scale of lengths in m.
    pub(super) length: f64,
    /// Scale of speeds in m/s.
    pub(super) speed: f64,
    /// Units of the sums over the neighbors of the last step and of the candidates, in m/s.
    pub(super) units: [Scale; 2],
}

/// The mean velocities that the agents of a group hear from their neighbors and themselves.
struct Heard<const D: usize> {
    /// In m/s.
    velocity: [Column<f64>; D],
    /// Norm of `velocity`.
    norm: Column<f64>,
}

impl<const D: usize> Features<D> {
    pub(super) fn new(num_candidates: usize) -> Self {
        let candidate = Candidate {
            velocity: [[0.0; GROUP]; D],
            neighbor_count: [0.0; GROUP],
            escape_cosine: [0.0; GROUP],
            distance: [0.0; GROUP],
        };
        Self {
            escape: [[0.0; GROUP]; D],
            heard_escape_gain: [0.0; GROUP],
            distance: [0.0; GROUP],
            time: [0.0; GROUP],
            heard_distance: [0.0; GROUP],
            candidates: vec![candidate; num_candidates],
        }
    }
}

/// Computes the features of a group that the entries of `extras` need. `axes` are the axes of the agents' body
/// frames, `heard` the sums over their neighbors in the last step, and `candidates` those under every candidate
/// range.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
pub(super) fn compute<const D: usize>(
    extras: Extras<'_>,
    group: &Group<D>,
    axes: &[[Column<f64>; D]; D],
    heard: &NeighborSums<D>,
    candidates: &[NeighborSums<D>],
    common: &Common<D>,
    features: &mut Features<D>,
) {
    let has_escape = extras.has(ExtraEntries::EscapeDirection);
    let has_approach = extras.has(ExtraEntries::ClosestApproach);
    let mut escape = [[0.0; GROUP]; D];
    let mut velocity = Heard::EMPTY;
    if has_escape || has_approach {
        velocity.load(heard, common.units[0]);
    }
    if has_escape {
        escape_directions(group, common, &mut escape);
        put_in_frames(axes, &escape, &mut features.escape);
        let (mut own, mut cosine) = ([0.0; GROUP], [0.0; GROUP]);
        Heard::of(group).cosines(&escape, &mut own);
        velocity.cosines(&escape, &mut cosine);
        for lane in 0..GROUP {
            features.heard_escape_gain[lane] = 0.5 * (cosine[lane] - own[lane]);
        }
    }
    if has_approach {
        let found = approaches(
            group,
            &group.velocity,
            &common.predators,
            common.sensing_length,
        );
        let scale = common.length / common.speed;
        for lane in 0..GROUP {
            features.distance[lane] = scaled(found.distance[lane], common.length);
            features.time[lane] = squash(found.time[lane], scale);
        }
        velocity.distances(group, common, &mut features.heard_distance);
    }
    for (sums, candidate) in candidates.iter().zip(&mut features.candidates) {
        velocity.load(sums, common.units[1]);
        if has_escape {
            velocity.cosines(&escape, &mut candidate.escape_cosine);
        }
        if has_approach {
            velocity.distances(group, common, &mut candidate.distance);
        }
        for lane in 0..GROUP {
            candidate.neighbor_count[lane] = squash(to_float(sums.count[lane]) - 1.0, HALF_COUNT);
            let divisor = velocity.norm[lane] + common.speed;
            for axis in 0..D {
                velocity.velocity[axis][lane] /= divisor;
            }
        }
        put_in_frames(axes, &velocity.velocity, &mut candidate.velocity);
    }
}

impl<const D: usize> Heard<D> {
    const EMPTY: Self = Self {
        velocity: [[0.0; GROUP]; D],
        norm: [0.0; GROUP],
    };

    /// Loads the velocities of the agents themselves.
    #[inline(always)]
    fn of(group: &Group<D>) -> Self {
        let mut own = Self {
            velocity: group.velocity,
            ..Self::EMPTY
        };
        own.measure();
        own
    }

    /// Computes the mean velocities from their sums.
    #[inline(always)]
    fn load(&mut self, sums: &NeighborSums<D>, unit: Scale) {
        for axis in 0..D {
            for lane in 0..GROUP {
                let sum = unit.value(sums.sum[axis][lane]);
                self.velocity[axis][lane] = sum / to_float(sums.count[lane]);
            }
        }
        self.measure();
    }

    #[inline(always)]
    fn measure(&mut self) {
        for lane in 0..GROUP {
            let velocity: [f64; D] = std::array::from_fn(|axis| self.velocity[axis][lane]);
            self.norm[lane] = squared_norm(&velocity).sqrt();
        }
    }

    /// Computes the cosines of the angles between the velocities and unit vectors; 0 for a velocity of 0.
    #[inline(always)]
    fn cosines(&self, units: &[Column<f64>; D], cosines: &mut Column<f64>) {
        for lane in 0..GROUP {
            let product = (0..D).fold(0.0, |sum, axis| {
                sum + self.velocity[axis][lane] * units[axis][lane]
            });
            let norm = self.norm[lane];
            cosines[lane] = if norm > SHORTEST { product / norm } else { 0.0 };
        }
    }

    /// Computes the closest approaches with the agents' speeds and the headings of the velocities, scaled to
    /// [0, 1). An agent keeps its heading where the velocity is 0.
    #[inline(always)]
    fn distances(&self, group: &Group<D>, common: &Common<D>, distances: &mut Column<f64>) {
        let mut turned = group.velocity;
        for lane in 0..GROUP {
            let norm = self.norm[lane];
            let factor = group.speed[lane] / norm;
            for axis in 0..D {
                let own = group.velocity[axis][lane];
                let aim = self.velocity[axis][lane] * factor;
                turned[axis][lane] = if norm > SHORTEST { aim } else { own };
            }
        }
        let found = approaches(group, &turned, &common.predators, common.sensing_length);
        for lane in 0..GROUP {
            distances[lane] = scaled(found.distance[lane], common.length);
        }
    }
}

/// Computes the unit vectors from the place of the nearest predator at its closest approach to the flock to the
/// agents, or 0 for agents that sense no predator.
#[inline(always)]
fn escape_directions<const D: usize>(
    group: &Group<D>,
    common: &Common<D>,
    away: &mut [Column<f64>; D],
) {
    let mut nearest = [f64::INFINITY; GROUP];
    for (predator, place) in common.predators.iter().zip(&common.places) {
        for lane in 0..GROUP {
            let offset: [f64; D] =
                std::array::from_fn(|axis| group.position[axis][lane] - predator.position[axis]);
            let length = squared_norm(&offset).sqrt();
            let is_nearer = length < nearest[lane];
            nearest[lane] = if is_nearer { length } else { nearest[lane] };
            for axis in 0..D {
                let offset = group.position[axis][lane] - place[axis];
                away[axis][lane] = if is_nearer { offset } else { away[axis][lane] };
            }
        }
    }
    for lane in 0..GROUP {
        let offset: [f64; D] = std::array::from_fn(|axis| away[axis][lane]);
        let length = squared_norm(&offset).sqrt();
        let senses = nearest[lane] < f64::INFINITY && nearest[lane] <= common.sensing_length;
        for axis in 0..D {
            let has_direction = senses && length > SHORTEST;
            away[axis][lane] = if has_direction {
                offset[axis] / length
            } else {
                0.0
            };
        }
    }
}

/// Returns a distance to a predator, scaled to [0, 1), or 0 for an infinite one.
#[inline(always)]
fn scaled(distance: f64, length: f64) -> f64 {
    if distance < f64::INFINITY {
        distance / (distance + length)
    } else {
        0.0
    }
}
