//! Observations of the agents: one row per agent, in the agent's body frame.

use nalgebra::SVector;

use super::Scene;
use super::table::{Row, Table, squash};
use crate::agents::GROUP;
use crate::base::frame::Frame;
use crate::base::vector::unit;
use crate::flock::HALF_COUNT;
use crate::predator::Predator;

/// Values that are the same for all agents of a flock.
struct Common {
    time: f64,
    running_minimum: f64,
    /// Largest range of an action in m.
    max_range: f64,
    /// Scale of speeds in m/s.
    speed: f64,
    /// Scale of lengths in m.
    length: f64,
}

/// The values that an agent's observation is computed from.
pub(super) struct Features<'a, const D: usize> {
    common: &'a Common,
    /// The agent's last range in m.
    range: f64,
    /// ||v_i|| in m/s.
    speed: f64,
    /// Number of neighbors in the last step, the agent itself excluded.
    neighbor_count: f64,
    /// Mean velocity in m/s of these neighbors and the agent itself.
    heard_velocity: SVector<f64, D>,
    /// Distance in m of the nearest predator, if the agent senses it.
    predator_distance: Option<f64>,
    /// Unit vector toward the sensed predator; 0 if there is none.
    predator_direction: SVector<f64, D>,
    /// Velocity in m/s of the sensed predator relative to the agent; 0 if there is none.
    predator_velocity: SVector<f64, D>,
    frame: Frame<D>,
}

/// Adds the entries of a row to `table`.
#[inline(always)]
pub(super) fn table<'a, const D: usize>(table: &mut impl Table<Features<'a, D>>) {
    table.number("time", 0.0, |features| features.common.time);
    table.number("running_minimum", 0.0, |features| {
        features.common.running_minimum
    });
    table.number("last_range", 0.0, |features| {
        features.range / features.common.max_range
    });
    table.number("speed", 0.0, |features| {
        squash(features.speed, features.common.speed)
    });
    table.number("neighbor_count", 0.0, |features| {
        squash(features.neighbor_count, HALF_COUNT)
    });
    table.vector("heard_velocity", |features| {
        features.scaled(&features.heard_velocity)
    });
    table.number("predator_sensed", 0.0, |features| {
        f64::from(features.predator_distance.is_some())
    });
    table.number("predator_distance", 0.0, |features| {
        let distance = features.predator_distance;
        distance.map_or(0.0, |distance| squash(distance, features.common.length))
    });
    table.vector("predator_direction", |features| {
        features.frame.coordinates(&features.predator_direction)
    });
    table.vector("predator_velocity", |features| {
        features.scaled(&features.predator_velocity)
    });
}

impl<const D: usize> Features<'_, D> {
    /// Returns a velocity in the agent's frame, scaled to a norm below 1.
    fn scaled(&self, velocity: &SVector<f64, D>) -> [f64; D] {
        let scale = velocity.norm() + self.common.speed;
        self.frame.coordinates(&(velocity / scale))
    }
}

/// Writes n rows; rows of caught agents are 0.
pub(super) fn write<const D: usize>(scene: &Scene<'_, D>, out: &mut [f32]) {
    let world = scene.world;
    let (sums, scale) = (world.neighborhood().sums(), world.neighborhood().scale());
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
        let (sums, lane) = (&sums[place / GROUP], place % GROUP);
        let count = sums.count[lane] as f64;
        let heard_velocity: SVector<f64, D> =
            SVector::from_fn(|axis, _| scale.value(sums.sum[axis][lane]) / count);
        let sensed = nearest(&position, world.predators())
            .filter(|(_, distance)| scene.is_sensed(*distance));
        let predator_direction: SVector<f64, D> = sensed
            .and_then(|(predator, _)| unit(&(predator.position - position)))
            .unwrap_or_else(SVector::zeros);
        let predator_velocity: SVector<f64, D> =
            sensed.map_or_else(SVector::zeros, |(predator, _)| predator.velocity - velocity);
        let features = Features {
            common: &common,
            range: scene.ranges[agent],
            speed: velocity.norm(),
            neighbor_count: count - 1.0,
            heard_velocity,
            predator_distance: sensed.map(|(_, distance)| distance),
            predator_direction,
            predator_velocity,
            frame: Frame::new(
                &velocity,
                &[predator_direction, heard_velocity, predator_velocity],
            ),
        };
        let row = &mut out[agent * length..(agent + 1) * length];
        table(&mut Row::new(&features, row));
    }
}

/// Returns the predator nearest to `position` and its distance in m.
pub(super) fn nearest<'a, const D: usize>(
    position: &SVector<f64, D>,
    predators: &'a [Predator<D>],
) -> Option<(&'a Predator<D>, f64)> {
    predators
        .iter()
        .map(|predator| (predator, (predator.position - position).norm()))
        .min_by(|a, b| a.1.total_cmp(&b.1))
}
