//! One row per agent, in the agent's own frame.

use nalgebra::SVector;

use super::{Writer, entry, running_minimum, squash};
use crate::agents::GROUP;
use crate::base::entry::Entry;
use crate::base::frame::Frame;
use crate::base::vector::unit;
use crate::episode::Episode;
use crate::flock::HALF_COUNT;
use crate::predator::Predator;

pub(super) const AXES: [&str; 3] = ["ahead", "left", "up"];

pub(super) fn entries(dimension: usize) -> Vec<Entry> {
    let vector = |name: &str| {
        let name = name.to_owned();
        AXES.iter()
            .take(dimension)
            .map(move |axis| entry(format!("{name}_{axis}"), -1.0))
    };
    let scalar = |name| std::iter::once(entry(name, 0.0));
    scalar("time")
        .chain(scalar("running_minimum"))
        .chain(scalar("last_range"))
        .chain(scalar("speed"))
        .chain(scalar("neighbor_count"))
        .chain(vector("heard_velocity"))
        .chain(scalar("predator_sensed"))
        .chain(scalar("predator_distance"))
        .chain(vector("predator_direction"))
        .chain(vector("predator_velocity"))
        .collect()
}

/// Writes n rows; zeros for agents that were caught.
pub(crate) fn write<const D: usize>(episode: &Episode<D>, out: &mut [f32]) {
    let world = episode.world();
    let scenario = world.config();
    let options = episode.config();
    let speed = scenario.speed.largest();
    let (heard, scale) = (world.neighborhood().heard(), world.neighborhood().scale());
    let time = episode.step_count() as f64 / scenario.num_steps as f64;
    let running_minimum = running_minimum(episode);
    let length = out.len() / scenario.num_agents;
    for agent in world.caught() {
        out[agent * length..(agent + 1) * length].fill(0.0);
    }
    for (place, (agent, position, velocity)) in world.agents().iter().enumerate() {
        let (heard, lane) = (&heard[place / GROUP], place % GROUP);
        let count = heard.count[lane] as f64;
        let heard_velocity: SVector<f64, D> =
            SVector::from_fn(|axis, _| scale.value(heard.sum[axis][lane]) / count);
        let mut writer = Writer::new(&mut out[agent * length..(agent + 1) * length]);
        let sensed = nearest(&position, world.predators())
            .filter(|(_, distance)| options.is_sensed(*distance, scenario));
        let sight: SVector<f64, D> = sensed
            .and_then(|(predator, _)| unit(&(predator.position - position)))
            .unwrap_or_else(SVector::zeros);
        let approach: SVector<f64, D> =
            sensed.map_or_else(SVector::zeros, |(predator, _)| predator.velocity - velocity);
        let frame = Frame::new(&velocity, &[sight, heard_velocity, approach]);
        let scaled =
            |vector: &SVector<f64, D>| frame.coordinates(&(vector / (vector.norm() + speed)));

        writer.push(time);
        writer.push(running_minimum);
        writer.push(episode.ranges()[agent] / options.max_range);
        writer.push(squash(velocity.norm(), speed));
        writer.push(squash(count - 1.0, HALF_COUNT));
        writer.extend(&scaled(&heard_velocity));
        writer.push(f64::from(sensed.is_some()));
        writer.push(sensed.map_or(0.0, |(_, distance)| squash(distance, scenario.initial_side)));
        writer.extend(&frame.coordinates(&sight));
        writer.extend(&scaled(&approach));
    }
}

/// The predator nearest to `position`, with its distance in m.
pub(super) fn nearest<'a, const D: usize>(
    position: &SVector<f64, D>,
    predators: &'a [Predator<D>],
) -> Option<(&'a Predator<D>, f64)> {
    predators
        .iter()
        .map(|predator| (predator, (predator.position - position).norm()))
        .min_by(|a, b| a.1.total_cmp(&b.1))
}
