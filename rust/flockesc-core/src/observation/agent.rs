//! Observations of the agents: one row per agent, in the agent's body frame.

use multiversion::multiversion;
use nalgebra::SVector;

use super::Scene;
use super::table::{Row, Table, squash};
use crate::agents::{Column, GROUP, Group};
use crate::base::exact::Scale;
use crate::base::frame::Frame;
use crate::base::vector::{SHORTEST, squared_norm};
use crate::flock::HALF_COUNT;
use crate::neighbor::NeighborSums;
use crate::predator::Predator;

/// Values that are the same for all agents of a flock.
struct Common {
    time: f64,
    running_minimum: f64,
    /// Largest range of an action in m.
    max_range: f64,
    /// Distance in m up to which a predator is sensed.
    sensing_length: f64,
    /// Scales of speeds in m/s and lengths in m.
    speed: f64,
    /// Scale of lengths in m.
    length: f64,
    /// Unit of the sums over neighbors, in m/s.
    unit: Scale,
}

/// What one agent sees, on the scales of its row.
pub(super) struct Seen<'a, const D: usize> {
    common: &'a Common,
    last_range: f64,
    speed: f64,
    /// Number of neighbors in the last step, the agent itself excluded.
    neighbor_count: f64,
    /// Their mean velocity and its own, in the agent's frame as all vectors.
    heard_velocity: [f64; D],
    /// 1 if the nearest predator is sensed. Without, the rest is 0.
    predator_sensed: f64,
    predator_distance: f64,
    predator_direction: [f64; D],
    predator_velocity: [f64; D],
}

/// Adds the entries of a row to `table`.
#[inline(always)]
pub(super) fn table<'a, const D: usize>(table: &mut impl Table<Seen<'a, D>>) {
    table.number("time", 0.0, |seen| seen.common.time);
    table.number("running_minimum", 0.0, |seen| seen.common.running_minimum);
    table.number("last_range", 0.0, |seen| seen.last_range);
    table.number("speed", 0.0, |seen| seen.speed);
    table.number("neighbor_count", 0.0, |seen| seen.neighbor_count);
    table.vector("heard_velocity", |seen| seen.heard_velocity);
    table.number("predator_sensed", 0.0, |seen| seen.predator_sensed);
    table.number("predator_distance", 0.0, |seen| seen.predator_distance);
    table.vector("predator_direction", |seen| seen.predator_direction);
    table.vector("predator_velocity", |seen| seen.predator_velocity);
}

/// What the agents of one group see, a lane for each: vectors along the world's axes, before and after they are scaled.
/// Empty lanes hold anything.
struct Columns<const D: usize> {
    /// ||v_i|| in m/s and on its scale, and the heading where it is not 0.
    norm: Column<f64>,
    speed: Column<f64>,
    heading: [Column<f64>; D],
    neighbor_count: Column<f64>,
    heard: [Column<f64>; D],
    heard_scaled: [Column<f64>; D],
    sensed: Column<f64>,
    distance: Column<f64>,
    /// Unit vector toward the predator.
    sight: [Column<f64>; D],
    /// The predator's velocity relative to the agent's.
    approach: [Column<f64>; D],
    approach_scaled: [Column<f64>; D],
}

impl<const D: usize> Columns<D> {
    const EMPTY: Self = Self {
        norm: [0.0; GROUP],
        speed: [0.0; GROUP],
        heading: [[0.0; GROUP]; D],
        neighbor_count: [0.0; GROUP],
        heard: [[0.0; GROUP]; D],
        heard_scaled: [[0.0; GROUP]; D],
        sensed: [0.0; GROUP],
        distance: [0.0; GROUP],
        sight: [[0.0; GROUP]; D],
        approach: [[0.0; GROUP]; D],
        approach_scaled: [[0.0; GROUP]; D],
    };

    /// The row of the agent in a lane.
    fn seen<'a>(
        &self,
        lane: usize,
        velocity: &SVector<f64, D>,
        last_range: f64,
        common: &'a Common,
    ) -> Seen<'a, D> {
        let at = |columns: &[Column<f64>; D]| SVector::from_fn(|axis, _| columns[axis][lane]);
        let cues = [at(&self.sight), at(&self.heard), at(&self.approach)];
        let frame = if self.norm[lane] > SHORTEST {
            Frame::along(at(&self.heading), &cues)
        } else {
            Frame::new(velocity, &cues)
        };
        Seen {
            common,
            last_range,
            speed: self.speed[lane],
            neighbor_count: self.neighbor_count[lane],
            heard_velocity: frame.coordinates(&at(&self.heard_scaled)),
            predator_sensed: self.sensed[lane],
            predator_distance: self.distance[lane],
            predator_direction: frame.coordinates(&cues[0]),
            predator_velocity: frame.coordinates(&at(&self.approach_scaled)),
        }
    }
}

/// Fills the columns of one group, whose sums over neighbors are `heard`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn look<const D: usize>(
    group: &Group<D>,
    heard: &NeighborSums<D>,
    predators: &[Predator<D>],
    common: &Common,
    columns: &mut Columns<D>,
) {
    let mut distance = [f64::INFINITY; GROUP];
    for predator in predators {
        for lane in 0..GROUP {
            let offset: [f64; D] =
                std::array::from_fn(|axis| predator.position[axis] - group.position[axis][lane]);
            let length = squared_norm(&offset).sqrt();
            let is_nearer = length < distance[lane];
            distance[lane] = if is_nearer { length } else { distance[lane] };
            for axis in 0..D {
                let approach = predator.velocity[axis] - group.velocity[axis][lane];
                let (sight, before) =
                    (&mut columns.sight[axis][lane], columns.approach[axis][lane]);
                *sight = if is_nearer { offset[axis] } else { *sight };
                columns.approach[axis][lane] = if is_nearer { approach } else { before };
            }
        }
    }
    for lane in 0..GROUP {
        let length = distance[lane];
        let is_sensed = length < f64::INFINITY && length <= common.sensing_length;
        let is_seen = is_sensed && length > SHORTEST;
        columns.sensed[lane] = if is_sensed { 1.0 } else { 0.0 };
        columns.distance[lane] = if is_sensed {
            squash(length, common.length)
        } else {
            0.0
        };
        for axis in 0..D {
            let (sight, approach) = (columns.sight[axis][lane], columns.approach[axis][lane]);
            columns.sight[axis][lane] = if is_seen { sight / length } else { 0.0 };
            columns.approach[axis][lane] = if is_sensed { approach } else { 0.0 };
        }
    }
    for lane in 0..GROUP {
        let velocity: [f64; D] = std::array::from_fn(|axis| group.velocity[axis][lane]);
        let norm = squared_norm(&velocity).sqrt();
        columns.norm[lane] = norm;
        columns.speed[lane] = squash(norm, common.speed);
        let count = heard.count[lane] as f64;
        columns.neighbor_count[lane] = squash(count - 1.0, HALF_COUNT);
        for axis in 0..D {
            columns.heading[axis][lane] = velocity[axis] / norm;
            columns.heard[axis][lane] = common.unit.value(heard.sum[axis][lane]) / count;
        }
    }
    scale(&columns.heard, common.speed, &mut columns.heard_scaled);
    scale(
        &columns.approach,
        common.speed,
        &mut columns.approach_scaled,
    );
}

/// Velocities w as w / (||w|| + speed).
#[inline(always)]
fn scale<const D: usize>(velocities: &[Column<f64>; D], speed: f64, out: &mut [Column<f64>; D]) {
    for lane in 0..GROUP {
        let velocity: [f64; D] = std::array::from_fn(|axis| velocities[axis][lane]);
        let divisor = squared_norm(&velocity).sqrt() + speed;
        for axis in 0..D {
            out[axis][lane] = velocity[axis] / divisor;
        }
    }
}

/// Writes n rows; rows of caught agents are 0.
pub(super) fn write<const D: usize>(scene: &Scene<'_, D>, out: &mut [f32]) {
    let world = scene.world;
    let common = Common {
        time: scene.time(),
        running_minimum: scene.running_minimum(),
        max_range: scene.max_range,
        sensing_length: scene.sensing_length(),
        speed: scene.speed(),
        length: scene.length(),
        unit: world.neighborhood().scale(),
    };
    let length = out.len() / scene.scenario().num_agents;
    for agent in world.caught() {
        out[agent * length..(agent + 1) * length].fill(0.0);
    }
    let mut columns = Columns::EMPTY;
    let groups = world
        .agents()
        .groups
        .iter()
        .zip(world.neighborhood().sums());
    for (index, (group, heard)) in groups.enumerate() {
        look(group, heard, world.predators(), &common, &mut columns);
        for (lane, agent) in world.agents().ids_of(index).iter().enumerate() {
            let agent = *agent as usize;
            let velocity = SVector::from_fn(|axis, _| group.velocity[axis][lane]);
            let last_range = scene.ranges[agent] / common.max_range;
            let seen = columns.seen(lane, &velocity, last_range, &common);
            let row = &mut out[agent * length..(agent + 1) * length];
            table(&mut Row::new(&seen, row));
        }
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
