//! Observation of the whole flock: one row of scalars that are invariant under rotations, translations and
//! permutations of the agents.

use nalgebra::SVector;

use super::row::squash;
use super::scene::Common;
use super::{Extras, Scene};
use crate::base::entry::{Entries, Numbers, Row};
use crate::base::vector::heading;
use crate::flock::{Approach, Drift, PredatorDistance, Summary, approach, heading_escape};

/// The values that a flock's row is computed from.
struct Features<'a, const D: usize> {
    common: Common,
    /// Mean range of the last action in m.
    mean_range: f64,
    flock: &'a Summary<D>,
    distance: PredatorDistance,
    /// The predator nearest to the centroid, if at least one agent senses a predator.
    predator: Option<Nearest<D>>,
    heading_escape: f64,
    approach: Approach,
}

/// A predator relative to the centroid.
struct Nearest<const D: usize> {
    /// Distance from the predator to the centroid in m.
    distance: f64,
    /// Unit vector from the predator to the centroid.
    away: SVector<f64, D>,
    /// v_p in m/s.
    velocity: SVector<f64, D>,
}

/// Adds all entries to `row`.
fn add<const D: usize>(row: &mut impl Row<f64>, extras: Extras<'_>, features: &Features<'_, D>) {
    let Features {
        flock, distance, ..
    } = features;
    let Common { length, speed, .. } = features.common;
    let sensed = |value| features.sensed(value);
    let sensed_distance = |distance| features.sensed_distance(distance);
    let last_range = features.mean_range / features.common.max_range;
    let velocity = SVector::from(flock.velocity);
    let (mut centroid_distance, mut velocity_away) = (0.0, 0.0);
    let (mut predator_speed, mut predator_aim) = (0.0, 0.0);
    if let Some(predator) = &features.predator {
        centroid_distance = squash(predator.distance, length);
        velocity_away = velocity.dot(&predator.away) / (velocity.norm() + speed);
        predator_speed = squash(predator.velocity.norm(), speed);
        predator_aim = heading(&predator.velocity).dot(&predator.away);
    }
    row.number("time", 0.0, features.common.time);
    row.number("running_minimum", 0.0, features.common.running_minimum);
    row.number("last_range", 0.0, last_range);
    row.number("speed", 0.0, squash(flock.speed, speed));
    row.number("polarization", 0.0, flock.polarization);
    row.number("spread", 0.0, squash(flock.dispersion, length));
    row.number("neighbor_count", 0.0, flock.neighbor_count);
    row.number("heard_alignment", 0.0, flock.heard_alignment);
    row.number("predator_sensed", 0.0, sensed(1.0));
    row.number("mean_distance", 0.0, sensed_distance(distance.mean));
    row.number("min_distance", 0.0, sensed_distance(distance.minimum));
    row.number("centroid_distance", 0.0, centroid_distance);
    row.number("fraction_in_range", 0.0, sensed(flock.fraction_in_range));
    row.number("heading_away", -1.0, sensed(flock.heading_away));
    let heading_away_in_range = sensed(flock.heading_away_in_range);
    row.number("heading_away_in_range", -1.0, heading_away_in_range);
    row.number("velocity_away", -1.0, velocity_away);
    row.number("predator_speed", 0.0, predator_speed);
    row.number("predator_aim", -1.0, predator_aim);
    if extras.has_escape() {
        row.number("heading_escape", -1.0, sensed(features.heading_escape));
    }
    if extras.has_approach() {
        let approach = features.approach;
        let mean = sensed_distance(approach.mean_distance);
        row.number("closest_mean_distance", 0.0, mean);
        let minimum = sensed_distance(approach.min_distance);
        row.number("closest_min_distance", 0.0, minimum);
        let time = squash(approach.time, length / speed);
        row.number("closest_approach_time", 0.0, sensed(time));
    }
}

impl<const D: usize> Features<'_, D> {
    /// Returns `value`, or 0 if no agent senses a predator.
    fn sensed(&self, value: f64) -> f64 {
        self.predator.as_ref().map_or(0.0, |_| value)
    }

    /// Returns a distance to a predator, scaled to [0, 1), or 0 if no agent senses one.
    fn sensed_distance(&self, distance: f64) -> f64 {
        self.sensed(squash(distance, self.common.length))
    }
}

/// Collects the entries of a row.
pub(super) fn name<const D: usize>(extras: Extras<'_>, entries: &mut Entries) {
    let features = Features::<D> {
        common: Common::default(),
        mean_range: 0.0,
        flock: &Summary::EMPTY,
        distance: PredatorDistance::default(),
        predator: None,
        heading_escape: 0.0,
        approach: Approach::default(),
    };
    add(entries, extras, &features);
}

/// Writes one row.
pub(super) fn write<const D: usize>(scene: &Scene<'_, D>, out: &mut [f32]) {
    let (world, flock, common) = (scene.world, scene.summary(), scene.common());
    let distance = world.predator_distance();
    let centroid = SVector::from(flock.centroid);
    let predators = world.predators().iter();
    let nearest = predators
        .map(|predator| (predator, (predator.position - centroid).norm()))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(predator, distance)| Nearest {
            distance,
            away: heading(&(centroid - predator.position)),
            velocity: predator.velocity,
        });
    let is_sensed = world.fraction_surviving() > 0.0 && distance.minimum <= common.sensing_length;
    let (agents, extras) = (world.agents(), scene.extras);
    let (mut escape, mut closest) = (0.0, Approach::default());
    if !extras.is_empty() && agents.len() > 0 {
        let drift = Drift::of(agents);
        if extras.has_escape() {
            escape = heading_escape(world, &drift);
        }
        if extras.has_approach() {
            closest = approach(world, &drift);
        }
    }
    let features = Features {
        mean_range: scene.ranges.iter().sum::<f64>() / scene.ranges.len() as f64,
        flock,
        distance,
        predator: nearest.filter(|_| is_sensed),
        heading_escape: escape,
        approach: closest,
        common,
    };
    add(&mut Numbers(out.iter_mut()), extras, &features);
}
