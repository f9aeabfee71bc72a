//! One row per agent, in the agent's own frame.

use nalgebra::SVector;

use super::Scene;
use super::table::{Row, Table, squash};
use crate::agents::GROUP;
use crate::base::frame::Frame;
use crate::base::vector::unit;
use crate::flock::HALF_COUNT;
use crate::predator::Predator;

/// What all agents of a flock share.
struct Common {
    time: f64,
    running_minimum: f64,
    /// In m.
    max_range: f64,
    /// Scales of speeds in m/s and lengths in m.
    speed: f64,
    length: f64,
}

/// What one agent sees.
pub(super) struct Seen<'a, const D: usize> {
    common: &'a Common,
    /// Its last range in m.
    range: f64,
    /// ||v_i|| in m/s.
    speed: f64,
    /// Neighbors heard in the last step, the agent itself excluded.
    neighbor_count: f64,
    /// Their mean velocity and its own, in m/s.
    heard_velocity: SVector<f64, D>,
    /// Distance in m of the nearest predator, if it is sensed.
    predator_distance: Option<f64>,
    /// The direction toward that predator, and its velocity relative to the agent's in m/s; 0 without one.
    sight: SVector<f64, D>,
    approach: SVector<f64, D>,
    frame: Frame<D>,
}

/// The entries of a row.
#[inline(always)]
pub(super) fn table<'a, const D: usize>(table: &mut impl Table<Seen<'a, D>>) {
    table.number("time", 0.0, |seen| seen.common.time);
    table.number("running_minimum", 0.0, |seen| seen.common.running_minimum);
    table.number("last_range", 0.0, |seen| seen.range / seen.common.max_range);
    table.number("speed", 0.0, |seen| squash(seen.speed, seen.common.speed));
    table.number("neighbor_count", 0.0, |seen| {
        squash(seen.neighbor_count, HALF_COUNT)
    });
    table.vector("heard_velocity", |seen| seen.scaled(&seen.heard_velocity));
    table.number("predator_sensed", 0.0, |seen| {
        f64::from(seen.predator_distance.is_some())
    });
    table.number("predator_distance", 0.0, |seen| {
        let distance = seen.predator_distance;
        distance.map_or(0.0, |distance| squash(distance, seen.common.length))
    });
    table.vector("predator_direction", |seen| {
        seen.frame.coordinates(&seen.sight)
    });
    table.vector("predator_velocity", |seen| seen.scaled(&seen.approach));
}

impl<const D: usize> Seen<'_, D> {
    /// A velocity in the agent's frame, scaled.
    fn scaled(&self, velocity: &SVector<f64, D>) -> [f64; D] {
        let scale = velocity.norm() + self.common.speed;
        self.frame.coordinates(&(velocity / scale))
    }
}

/// Writes n rows; zeros for agents that were caught.
pub(super) fn write<const D: usize>(scene: &Scene<'_, D>, out: &mut [f32]) {
    let world = scene.world;
    let (heard, scale) = (world.neighborhood().sums(), world.neighborhood().scale());
    let common = Common {
        time: scene.time(),
        running_minimum: scene.running_minimum(),
        max_range: scene.max_range,
        speed: scene.speed(),
        length: scene.length(),
    };
    let length = out.len() / scene.scenario().num_agents;
    for agent in world.caught() {
        out[agent * length..(agent + 1) * length].fill(0.0);
    }
    for (place, (agent, position, velocity)) in world.agents().iter().enumerate() {
        let (heard, lane) = (&heard[place / GROUP], place % GROUP);
        let count = heard.count[lane] as f64;
        let heard_velocity: SVector<f64, D> =
            SVector::from_fn(|axis, _| scale.value(heard.sum[axis][lane]) / count);
        let sensed = nearest(&position, world.predators())
            .filter(|(_, distance)| scene.is_sensed(*distance));
        let sight: SVector<f64, D> = sensed
            .and_then(|(predator, _)| unit(&(predator.position - position)))
            .unwrap_or_else(SVector::zeros);
        let approach: SVector<f64, D> =
            sensed.map_or_else(SVector::zeros, |(predator, _)| predator.velocity - velocity);
        let seen = Seen {
            common: &common,
            range: scene.ranges[agent],
            speed: velocity.norm(),
            neighbor_count: count - 1.0,
            heard_velocity,
            predator_distance: sensed.map(|(_, distance)| distance),
            sight,
            approach,
            frame: Frame::new(&velocity, &[sight, heard_velocity, approach]),
        };
        let row = &mut out[agent * length..(agent + 1) * length];
        table(&mut Row::new(&seen, row));
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
