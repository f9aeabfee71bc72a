//! Observations of the learned predators: one row per predator, in its body frame.

use nalgebra::SVector;

use super::Scene;
use super::row::squash;
use super::scene::Common;
use crate::base::entry::{Entries, Numbers, Row};
use crate::base::vector::{Frame, unit};
use crate::flock::Summary;
use crate::predator::{self, Sighting};

/// The values that a predator's row is computed from.
struct Features<'a, const D: usize> {
    common: Common,
    sighting: Sighting<D>,
    frame: Frame<D>,
    flock: &'a Summary<D>,
    /// Fraction of the agents within rho_p of the predator.
    fraction_in_range: f64,
}

/// Adds all entries to `row`.
fn add<const D: usize>(row: &mut impl Row<f64>, features: &Features<'_, D>) {
    let Features {
        common,
        sighting,
        frame,
        flock,
        ..
    } = features;
    let direction =
        |offset: &SVector<f64, D>| frame.coordinates(&unit(offset).unwrap_or_else(SVector::zeros));
    let distance = |offset: &SVector<f64, D>| squash(offset.norm(), common.length);
    let velocity = |velocity: &SVector<f64, D>| {
        frame.coordinates(&(velocity / (velocity.norm() + common.speed)))
    };
    let other = sighting.other.unwrap_or_else(SVector::zeros);
    let speed = sighting.velocity.norm() / sighting.max_speed;
    row.number("time", 0.0, common.time);
    row.number("running_minimum", 0.0, common.running_minimum);
    row.number("speed", 0.0, speed);
    row.vector("nearest_direction", direction(&sighting.nearest));
    row.number("nearest_distance", 0.0, distance(&sighting.nearest));
    row.vector("nearest_velocity", velocity(&sighting.nearest_velocity));
    row.vector("centroid_direction", direction(&sighting.centroid));
    row.number("centroid_distance", 0.0, distance(&sighting.centroid));
    row.vector("flock_velocity", velocity(&sighting.flock_velocity));
    row.number("spread", 0.0, squash(flock.dispersion, common.length));
    row.number("polarization", 0.0, flock.polarization);
    row.number("fraction_in_range", 0.0, features.fraction_in_range);
    row.number("other_present", 0.0, f64::from(sighting.other.is_some()));
    row.vector("other_direction", direction(&other));
    row.number("other_distance", 0.0, distance(&other));
}

/// Collects the entries of a row.
pub(super) fn name<const D: usize>(entries: &mut Entries) {
    let zero = SVector::zeros();
    let sighting = Sighting::<D> {
        velocity: zero,
        nearest: zero,
        nearest_velocity: zero,
        centroid: zero,
        flock_velocity: zero,
        other: None,
        max_speed: 0.0,
    };
    let features = Features {
        common: Common::default(),
        frame: sighting.frame(),
        sighting,
        flock: &Summary::EMPTY,
        fraction_in_range: 0.0,
    };
    add(entries, &features);
}

/// Writes one row per learned predator.
pub(super) fn write<const D: usize>(scene: &Scene<'_, D>, out: &mut [f32]) {
    let (world, scenario) = (scene.world, scene.world.config());
    let (predators, prey) = (world.predators(), world.prey());
    let sightings = predator::sightings(&scenario.predators, predators, prey);
    let length = out.len() / scenario.num_learned().max(1);
    for ((index, sighting), row) in sightings.zip(out.chunks_exact_mut(length.max(1))) {
        let position = &predators[index].position;
        let in_range = prey.within(position, scenario.predator_range).count();
        let features = Features {
            common: scene.common(),
            frame: sighting.frame(),
            sighting,
            flock: scene.summary(),
            fraction_in_range: in_range as f64 / world.agents().len().max(1) as f64,
        };
        add(&mut Numbers(row.iter_mut()), &features);
    }
}
