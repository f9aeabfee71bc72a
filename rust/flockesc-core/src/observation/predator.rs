//! One row per predator that is steered from outside, in its own frame.

use nalgebra::SVector;

use super::Scene;
use super::table::{Row, Table, squash};
use crate::base::frame::Frame;
use crate::base::vector::unit;
use crate::flock::Summary;
use crate::predator::{self, Sighting};

/// What one predator sees.
pub(super) struct Seen<'a, const D: usize> {
    time: f64,
    running_minimum: f64,
    /// Scales of lengths in m and speeds in m/s.
    length: f64,
    speed: f64,
    sighting: Sighting<D>,
    frame: Frame<D>,
    flock: &'a Summary<D>,
    /// Share of the agents within the predator's range.
    fraction_in_range: f64,
}

/// The entries of a row.
#[inline(always)]
pub(super) fn table<'a, const D: usize>(table: &mut impl Table<Seen<'a, D>>) {
    table.number("time", 0.0, |seen| seen.time);
    table.number("running_minimum", 0.0, |seen| seen.running_minimum);
    table.number("speed", 0.0, |seen| {
        seen.sighting.velocity.norm() / seen.sighting.max_speed
    });
    table.vector("nearest_direction", |seen| {
        seen.direction(&seen.sighting.nearest)
    });
    table.number("nearest_distance", 0.0, |seen| {
        seen.distance(&seen.sighting.nearest)
    });
    table.vector("nearest_velocity", |seen| {
        seen.scaled(&seen.sighting.nearest_velocity)
    });
    table.vector("centroid_direction", |seen| {
        seen.direction(&seen.sighting.centroid)
    });
    table.number("centroid_distance", 0.0, |seen| {
        seen.distance(&seen.sighting.centroid)
    });
    table.vector("flock_velocity", |seen| {
        seen.scaled(&seen.sighting.flock_velocity)
    });
    table.number("spread", 0.0, |seen| {
        squash(seen.flock.dispersion, seen.length)
    });
    table.number("polarization", 0.0, |seen| seen.flock.polarization);
    table.number("fraction_in_range", 0.0, |seen| seen.fraction_in_range);
    table.number("other_present", 0.0, |seen| {
        f64::from(seen.sighting.other.is_some())
    });
    table.vector("other_direction", |seen| seen.direction(&seen.other()));
    table.number("other_distance", 0.0, |seen| seen.distance(&seen.other()));
}

impl<const D: usize> Seen<'_, D> {
    /// Offset of the nearest other predator in m; 0 without one.
    fn other(&self) -> SVector<f64, D> {
        self.sighting.other.unwrap_or_else(SVector::zeros)
    }

    /// The direction of an offset in the predator's frame.
    fn direction(&self, offset: &SVector<f64, D>) -> [f64; D] {
        let direction = unit(offset).unwrap_or_else(SVector::zeros);
        self.frame.coordinates(&direction)
    }

    /// The length of an offset, scaled.
    fn distance(&self, offset: &SVector<f64, D>) -> f64 {
        squash(offset.norm(), self.length)
    }

    /// A velocity in the predator's frame, scaled.
    fn scaled(&self, velocity: &SVector<f64, D>) -> [f64; D] {
        let scale = velocity.norm() + self.speed;
        self.frame.coordinates(&(velocity / scale))
    }
}

/// Writes a row for every predator that is steered from outside.
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
        let seen = Seen {
            time: scene.time(),
            running_minimum: scene.running_minimum(),
            length: scene.length(),
            speed: scene.speed(),
            frame: sighting.frame(),
            sighting,
            flock: scene.summary,
            fraction_in_range: in_range as f64 / world.agents().len().max(1) as f64,
        };
        table(&mut Row::new(&seen, row));
    }
}
