//! Observations of the learned predators: one row per predator, in its body frame.

use nalgebra::SVector;

use super::Scene;
use super::table::{Row, Table, squash};
use crate::base::frame::Frame;
use crate::base::vector::unit;
use crate::flock::Summary;
use crate::predator::{self, Sighting};

/// The values that a predator's observation is computed from.
pub(super) struct Features<'a, const D: usize> {
    time: f64,
    running_minimum: f64,
    /// Scale of lengths in m.
    length: f64,
    /// Scale of speeds in m/s.
    speed: f64,
    sighting: Sighting<D>,
    frame: Frame<D>,
    flock: &'a Summary<D>,
    /// Fraction of the agents within rho_p of the predator.
    fraction_in_range: f64,
}

/// Adds the entries of a row to `table`.
#[inline(always)]
pub(super) fn table<'a, const D: usize>(table: &mut impl Table<Features<'a, D>>) {
    table.number("time", 0.0, |features| features.time);
    table.number("running_minimum", 0.0, |features| features.running_minimum);
    table.number("speed", 0.0, |features| {
        features.sighting.velocity.norm() / features.sighting.max_speed
    });
    table.vector("nearest_direction", |features| {
        features.direction(&features.sighting.nearest)
    });
    table.number("nearest_distance", 0.0, |features| {
        features.distance(&features.sighting.nearest)
    });
    table.vector("nearest_velocity", |features| {
        features.scaled(&features.sighting.nearest_velocity)
    });
    table.vector("centroid_direction", |features| {
        features.direction(&features.sighting.centroid)
    });
    table.number("centroid_distance", 0.0, |features| {
        features.distance(&features.sighting.centroid)
    });
    table.vector("flock_velocity", |features| {
        features.scaled(&features.sighting.flock_velocity)
    });
    table.number("spread", 0.0, |features| {
        squash(features.flock.dispersion, features.length)
    });
    table.number("polarization", 0.0, |features| features.flock.polarization);
    table.number("fraction_in_range", 0.0, |features| {
        features.fraction_in_range
    });
    table.number("other_present", 0.0, |features| {
        f64::from(features.sighting.other.is_some())
    });
    table.vector("other_direction", |features| {
        features.direction(&features.other())
    });
    table.number("other_distance", 0.0, |features| {
        features.distance(&features.other())
    });
}

impl<const D: usize> Features<'_, D> {
    /// Returns the offset of the nearest other predator in m, or 0 if there is none.
    fn other(&self) -> SVector<f64, D> {
        self.sighting.other.unwrap_or_else(SVector::zeros)
    }

    /// Returns the direction of an offset in the predator's frame.
    fn direction(&self, offset: &SVector<f64, D>) -> [f64; D] {
        let direction = unit(offset).unwrap_or_else(SVector::zeros);
        self.frame.coordinates(&direction)
    }

    /// Returns the length of an offset, scaled to [0, 1).
    fn distance(&self, offset: &SVector<f64, D>) -> f64 {
        squash(offset.norm(), self.length)
    }

    /// Returns a velocity in the predator's frame, scaled to a norm below 1.
    fn scaled(&self, velocity: &SVector<f64, D>) -> [f64; D] {
        let scale = velocity.norm() + self.speed;
        self.frame.coordinates(&(velocity / scale))
    }
}

/// Writes one row per learned predator.
pub(super) fn write<const D: usize>(scene: &Scene<'_, D>, out: &mut [f32]) {
    let (world, scenario) = (scene.world, scene.scenario());
    let predators = world.predators();
    let prey = world.prey();
    let sightings =
        (0..predators.len()).filter_map(|k| Some((k, predator::sighting(predators, k, prey)?)));
    let length = out.len() / scenario.num_learned().max(1);
    for ((index, sighting), row) in sightings.zip(out.chunks_exact_mut(length.max(1))) {
        let position = &predators[index].position;
        let in_range = prey.within(position, scenario.predator_range).count();
        let features = Features {
            time: scene.time(),
            running_minimum: scene.running_minimum(),
            length: scene.length(),
            speed: scene.speed(),
            frame: sighting.frame(),
            sighting,
            flock: scene.summary(),
            fraction_in_range: in_range as f64 / world.agents().len().max(1) as f64,
        };
        table(&mut Row::new(&features, row));
    }
}
