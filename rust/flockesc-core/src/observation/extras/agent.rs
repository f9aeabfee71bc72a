//! Optional entries of the agents' observations.

use multiversion::multiversion;
use nalgebra::SVector;

use super::{ExtraEntries, Extras};
use crate::agents::{Column, GROUP, Group};
use crate::base::exact::Scale;
use crate::base::vector::{SHORTEST, squared_norm};
use crate::flock::{Drift, HALF_COUNT, Straight, approaches};
use crate::neighbor::{NeighborSums, Profile};
use crate::observation::Scene;
use crate::observation::columns::{ColumnTable, GroupRows, Rows, put_in_frames};
use crate::observation::table::squash;

/// Columns of values of the agents of one group, scaled as in their rows. Vectors are in the agents' body
/// frames. Values in empty lanes are unspecified.
#[derive(Debug)]
pub(in crate::observation) struct Features<const D: usize> {
    /// Unit vector away from the place of the predator at its closest approach to the flock.
    escape: [Column<f64>; D],
    /// Half the cosine between the heard velocity and `escape`, minus half the one of the own heading.
    heard_escape_gain: Column<f64>,
    distance: Column<f64>,
    time: Column<f64>,
    /// `distance` with the heading of the heard velocity.
    heard_distance: Column<f64>,
    candidates: Vec<Candidate<D>>,
}

/// The same under one candidate range.
#[derive(Debug, Clone)]
struct Candidate<const D: usize> {
    velocity: [Column<f64>; D],
    neighbor_count: Column<f64>,
    escape_cosine: Column<f64>,
    distance: Column<f64>,
}

/// Adds the entries of a row to `table`.
#[inline(always)]
pub(in crate::observation) fn table<const D: usize>(
    extras: Extras<'_>,
    table: &mut impl ColumnTable<Features<D>>,
) {
    let has_escape = extras.has(ExtraEntries::EscapeDirection);
    let has_approach = extras.has(ExtraEntries::ClosestApproach);
    if has_escape {
        table.vectors("escape_direction", |features| &features.escape);
        table.numbers("heard_escape_gain", -1.0, |features| {
            &features.heard_escape_gain
        });
    }
    if has_approach {
        table.numbers("closest_approach", 0.0, |features| &features.distance);
        table.numbers("closest_approach_time", 0.0, |features| &features.time);
        table.numbers("heard_closest_approach", 0.0, |features| {
            &features.heard_distance
        });
    }
    for k in 0..extras.ranges.len() {
        table.begin_candidate(k);
        table.vectors("velocity", |features| &features.candidates[k].velocity);
        table.numbers("neighbor_count", 0.0, |features| {
            &features.candidates[k].neighbor_count
        });
        if has_escape {
            table.numbers("escape_cosine", -1.0, |features| {
                &features.candidates[k].escape_cosine
            });
        }
        if has_approach {
            table.numbers("closest_approach", 0.0, |features| {
                &features.candidates[k].distance
            });
        }
    }
}

/// Writes the optional entries of one flock, group by group.
pub(in crate::observation) struct Writer<'a, const D: usize> {
    extras: Extras<'a>,
    profile: Profile<'a, D>,
    common: Common<D>,
    features: Features<D>,
}

/// The values that are the same for all agents of a flock.
struct Common<const D: usize> {
    predators: Vec<Straight<D>>,
    /// The places of the predators at their closest approach to the flock, in m. Empty unless an entry needs
    /// them.
    places: Vec<[f64; D]>,
    /// Distance in m up to which a predator is sensed.
    sensing_length: f64,
    /// Scale of lengths in m.
    length: f64,
    /// Scale of speeds in m/s.
    speed: f64,
    /// Units of the sums over the neighbors of the last step and of the candidates, in m/s.
    units: [Scale; 2],
}

impl<'a, const D: usize> Writer<'a, D> {
    /// Creates the writer of a scene; `None` without optional entries.
    pub(in crate::observation) fn new(scene: &Scene<'a, D>) -> Option<Self> {
        let (extras, world) = (scene.extras, scene.world);
        let num_agents = world.agents().len();
        if extras.is_empty() || num_agents == 0 {
            return None;
        }
        let predators: Vec<Straight<D>> = world.predators().iter().map(Straight::from).collect();
        let places = if extras.has(ExtraEntries::EscapeDirection) {
            let drift = Drift::of(&world.agents().groups, num_agents);
            let place = |predator: &Straight<D>| predator.after(drift.time_of_approach(predator));
            predators.iter().map(place).collect()
        } else {
            Vec::new()
        };
        let profile = Profile::new(world.neighborhood(), world.agents(), extras.ranges);
        Some(Self {
            common: Common {
                places,
                predators,
                sensing_length: scene.sensing_length(),
                length: scene.length(),
                speed: scene.speed(),
                units: [world.neighborhood().scale(), profile.scale()],
            },
            extras,
            profile,
            features: Features::new(extras.ranges.len()),
        })
    }

    /// Computes the sums over the neighbors of a group's agents under every candidate range.
    pub(in crate::observation) fn listen(&mut self, group: usize) {
        self.profile.of_group(group);
    }

    /// Adds the sums of the velocities of an agent's neighbors under every candidate range to `cues`.
    pub(in crate::observation) fn add_cues(&self, lane: usize, cues: &mut Vec<SVector<f64, D>>) {
        let sum = |sums: &NeighborSums<D>| SVector::from_fn(|axis, _| sums.sum[axis][lane] as f64);
        cues.extend(self.profile.sums().iter().map(sum));
    }

    /// Adds the entries of the group of the last call of [`Self::listen`] to `rows`. `axes` are the axes of the
    /// agents' body frames, and `heard` the sums over their neighbors in the last step.
    pub(in crate::observation) fn add_entries(
        &mut self,
        group: &Group<D>,
        axes: &[[Column<f64>; D]; D],
        heard: &NeighborSums<D>,
        rows: &mut GroupRows,
    ) {
        let candidates = self.profile.sums();
        let features = &mut self.features;
        if self.extras.has(ExtraEntries::EscapeDirection) {
            add_escapes(group, axes, heard, candidates, &self.common, features);
        }
        if self.extras.has(ExtraEntries::ClosestApproach) {
            add_approaches(group, heard, candidates, &self.common, features);
        }
        add_candidates(axes, candidates, &self.common, features);
        add_entries(self.extras, &self.features, rows);
    }
}

impl<const D: usize> Features<D> {
    fn new(num_candidates: usize) -> Self {
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

/// Adds all entries to `rows`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_entries<const D: usize>(extras: Extras<'_>, features: &Features<D>, rows: &mut GroupRows) {
    table(extras, &mut Rows { features, rows });
}

/// Computes the escape directions of a group, and the cosines with them.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_escapes<const D: usize>(
    group: &Group<D>,
    axes: &[[Column<f64>; D]; D],
    heard: &NeighborSums<D>,
    candidates: &[NeighborSums<D>],
    common: &Common<D>,
    features: &mut Features<D>,
) {
    let escape = escape_directions(group, common);
    put_in_frames(axes, &escape, &mut features.escape);
    let own = cosines(&group.velocity, &escape);
    let cosine = cosines(&mean_velocities(heard, common.units[0]), &escape);
    for lane in 0..GROUP {
        features.heard_escape_gain[lane] = 0.5 * (cosine[lane] - own[lane]);
    }
    for (sums, candidate) in candidates.iter().zip(&mut features.candidates) {
        candidate.escape_cosine = cosines(&mean_velocities(sums, common.units[1]), &escape);
    }
}

/// Computes the closest approaches of a group.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_approaches<const D: usize>(
    group: &Group<D>,
    heard: &NeighborSums<D>,
    candidates: &[NeighborSums<D>],
    common: &Common<D>,
    features: &mut Features<D>,
) {
    let range = common.sensing_length;
    let found = approaches(group, &group.velocity, &common.predators, range);
    let scale = common.length / common.speed;
    for lane in 0..GROUP {
        features.distance[lane] = scaled(found.distance[lane], common.length);
        features.time[lane] = squash(found.time[lane], scale);
    }
    let velocity = mean_velocities(heard, common.units[0]);
    features.heard_distance = distances(group, &velocity, common);
    for (sums, candidate) in candidates.iter().zip(&mut features.candidates) {
        let velocity = mean_velocities(sums, common.units[1]);
        candidate.distance = distances(group, &velocity, common);
    }
}

/// Computes what a group would hear under every candidate range.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_candidates<const D: usize>(
    axes: &[[Column<f64>; D]; D],
    candidates: &[NeighborSums<D>],
    common: &Common<D>,
    features: &mut Features<D>,
) {
    for (sums, candidate) in candidates.iter().zip(&mut features.candidates) {
        let mut velocity = mean_velocities(sums, common.units[1]);
        for lane in 0..GROUP {
            let heard: [f64; D] = std::array::from_fn(|axis| velocity[axis][lane]);
            let divisor = squared_norm(&heard).sqrt() + common.speed;
            for axis in 0..D {
                velocity[axis][lane] = heard[axis] / divisor;
            }
            candidate.neighbor_count[lane] = squash(sums.count[lane] as f64 - 1.0, HALF_COUNT);
        }
        put_in_frames(axes, &velocity, &mut candidate.velocity);
    }
}

/// Returns the unit vectors from the place of the nearest predator at its closest approach to the flock to the
/// agents, or 0 for agents that sense no predator.
#[inline(always)]
fn escape_directions<const D: usize>(group: &Group<D>, common: &Common<D>) -> [Column<f64>; D] {
    let mut nearest = [f64::INFINITY; GROUP];
    let mut away = [[0.0; GROUP]; D];
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
    away
}

/// Returns the mean velocities in m/s of the neighbors and the agents themselves.
#[inline(always)]
fn mean_velocities<const D: usize>(sums: &NeighborSums<D>, unit: Scale) -> [Column<f64>; D] {
    let mut velocity = [[0.0; GROUP]; D];
    for axis in 0..D {
        for lane in 0..GROUP {
            velocity[axis][lane] = unit.value(sums.sum[axis][lane]) / sums.count[lane] as f64;
        }
    }
    velocity
}

/// Returns the closest approaches with the agents' speeds and the headings of `velocity`, scaled to [0, 1). An
/// agent keeps its heading where `velocity` is 0.
#[inline(always)]
fn distances<const D: usize>(
    group: &Group<D>,
    velocity: &[Column<f64>; D],
    common: &Common<D>,
) -> Column<f64> {
    let mut turned = group.velocity;
    for lane in 0..GROUP {
        let velocity: [f64; D] = std::array::from_fn(|axis| velocity[axis][lane]);
        let norm = squared_norm(&velocity).sqrt();
        for axis in 0..D {
            let own = group.velocity[axis][lane];
            let aim = velocity[axis] * (group.speed[lane] / norm);
            turned[axis][lane] = if norm > SHORTEST { aim } else { own };
        }
    }
    let mut distance =
        approaches(group, &turned, &common.predators, common.sensing_length).distance;
    for lane in 0..GROUP {
        distance[lane] = scaled(distance[lane], common.length);
    }
    distance
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

/// Returns the cosines of the angles between vectors and unit vectors; 0 for a vector of length 0.
#[inline(always)]
fn cosines<const D: usize>(vectors: &[Column<f64>; D], units: &[Column<f64>; D]) -> Column<f64> {
    let mut cosines = [0.0; GROUP];
    for lane in 0..GROUP {
        let vector: [f64; D] = std::array::from_fn(|axis| vectors[axis][lane]);
        let norm = squared_norm(&vector).sqrt();
        let product = (0..D).fold(0.0, |sum, axis| sum + vector[axis] * units[axis][lane]);
        cosines[lane] = if norm > SHORTEST { product / norm } else { 0.0 };
    }
    cosines
}
