//! One row per learned predator, in its own frame.

use nalgebra::SVector;

use super::agent::AXES;
use super::{Writer, entry, running_minimum, squash};
use crate::base::entry::Entry;
use crate::base::vector::unit;
use crate::episode::Episode;
use crate::predator::Sighting;

/// The entries of a row, in order, for dimension 2 or 3.
#[must_use]
pub fn entries(dimension: usize) -> Vec<Entry> {
    let vector = |name: &str| {
        let name = name.to_owned();
        AXES.iter()
            .take(dimension)
            .map(move |axis| entry(format!("{name}_{axis}"), -1.0))
    };
    let scalar = |name| std::iter::once(entry(name, 0.0));
    scalar("time")
        .chain(scalar("running_minimum"))
        .chain(scalar("speed"))
        .chain(vector("nearest_direction"))
        .chain(scalar("nearest_distance"))
        .chain(vector("nearest_velocity"))
        .chain(vector("centroid_direction"))
        .chain(scalar("centroid_distance"))
        .chain(vector("flock_velocity"))
        .chain(scalar("spread"))
        .chain(scalar("polarization"))
        .chain(scalar("fraction_in_range"))
        .chain(scalar("other_present"))
        .chain(vector("other_direction"))
        .chain(scalar("other_distance"))
        .collect()
}

/// Writes a row for every learned predator.
pub(crate) fn write<const D: usize>(episode: &Episode<D>, out: &mut [f32]) {
    let predators = episode.world().predators();
    let learned = predators
        .iter()
        .enumerate()
        .filter_map(|(index, predator)| Some((index, predator.steered_max_speed()?)));
    let length = out.len() / episode.world().config().num_learned().max(1);
    for ((index, max_speed), row) in learned.zip(out.chunks_exact_mut(length.max(1))) {
        write_row(episode, index, max_speed, row);
    }
}

fn write_row<const D: usize>(episode: &Episode<D>, index: usize, max_speed: f64, row: &mut [f32]) {
    let world = episode.world();
    let scenario = world.config();
    let flock = episode.summary();
    let seen = Sighting::of(world.predators(), index, world.prey());
    let frame = seen.frame();
    let direction =
        |offset: &SVector<f64, D>| frame.coordinates(&unit(offset).unwrap_or_else(SVector::zeros));
    let scaled = |velocity: &SVector<f64, D>| {
        frame.coordinates(&(velocity / (velocity.norm() + scenario.speed.largest())))
    };
    let length = |offset: &SVector<f64, D>| squash(offset.norm(), scenario.initial_side);
    let place = world.predators()[index].position;
    let in_range = world.prey().within(&place, scenario.predator_range).count();

    let mut writer = Writer::new(row);
    writer.push(episode.step_count() as f64 / scenario.num_steps as f64);
    writer.push(running_minimum(episode));
    writer.push(seen.velocity.norm() / max_speed);
    writer.extend(&direction(&seen.nearest));
    writer.push(length(&seen.nearest));
    writer.extend(&scaled(&seen.nearest_velocity));
    writer.extend(&direction(&seen.centroid));
    writer.push(length(&seen.centroid));
    writer.extend(&scaled(&seen.flock_velocity));
    writer.push(squash(flock.spread, scenario.initial_side));
    writer.push(flock.polarization);
    writer.push(in_range as f64 / world.agents().len().max(1) as f64);
    let other = seen.other.unwrap_or_else(SVector::zeros);
    writer.push(f64::from(seen.other.is_some()));
    writer.extend(&direction(&other));
    writer.push(length(&other));
}
