//! Observations of the agents: one row per agent, in the agent's body frame.

use multiversion::multiversion;
use nalgebra::SVector;

use super::Scene;
use super::extras::agent::Writer;
use super::table::{Row, Table, squash};
use crate::agents::{Column, GROUP, Group};
use crate::base::exact::Scale;
use crate::base::frame::Frame;
use crate::base::vector::{SHORTEST, squared_norm};
use crate::flock::HALF_COUNT;
use crate::neighbor::NeighborSums;
use crate::predator::Predator;

/// The values that are the same for all agents of a flock.
struct Common {
    time: f64,
    running_minimum: f64,
    /// Largest range of an action in m.
    max_range: f64,
    /// Distance in m up to which a predator is sensed.
    sensing_length: f64,
    /// Scale of speeds in m/s.
    speed: f64,
    /// Scale of lengths in m.
    length: f64,
    /// Unit of the sums over neighbors, in m/s.
    unit: Scale,
}

/// The values of one agent's observation, scaled as in its row. Vectors are in the agent's body
/// frame.
pub(super) struct Features<'a, const D: usize> {
    common: &'a Common,
    last_range: f64,
    speed: f64,
    /// Number of neighbors in the last step, the agent itself excluded.
    neighbor_count: f64,
    /// Mean velocity of the neighbors and the agent itself.
    heard_velocity: [f64; D],
    /// 1 if the agent senses the nearest predator, otherwise 0. The values below are then 0, too.
    predator_sensed: f64,
    predator_distance: f64,
    predator_direction: [f64; D],
    predator_velocity: [f64; D],
}

/// Adds the entries of a row to `table`.
#[inline(always)]
pub(super) fn table<'a, const D: usize>(table: &mut impl Table<Features<'a, D>>) {
    table.number("time", 0.0, |features| features.common.time);
    table.number("running_minimum", 0.0, |features| {
        features.common.running_minimum
    });
    table.number("last_range", 0.0, |features| features.last_range);
    table.number("speed", 0.0, |features| features.speed);
    table.number("neighbor_count", 0.0, |features| features.neighbor_count);
    table.vector("heard_velocity", |features| features.heard_velocity);
    table.number("predator_sensed", 0.0, |features| features.predator_sensed);
    table.number("predator_distance", 0.0, |features| {
        features.predator_distance
    });
    table.vector("predator_direction", |features| features.predator_direction);
    table.vector("predator_velocity", |features| features.predator_velocity);
}

/// Columns of values of the agents of one group, one lane per agent. Vectors are along the axes of
/// the world. Values in empty lanes are unspecified.
struct Columns<const D: usize> {
    /// ||v_i|| in m/s.
    norm: Column<f64>,
    /// ||v_i||, scaled to [0, 1).
    speed: Column<f64>,
    /// v_i / ||v_i||. Unspecified if v_i is 0.
    heading: [Column<f64>; D],
    neighbor_count: Column<f64>,
    /// Mean velocity of the neighbors and the agent itself in m/s.
    heard: [Column<f64>; D],
    /// `heard`, scaled to a norm below 1.
    heard_scaled: [Column<f64>; D],
    /// 1 if the agent senses the nearest predator, otherwise 0.
    sensed: Column<f64>,
    /// Distance to the nearest predator, scaled to [0, 1).
    distance: Column<f64>,
    /// Unit vector toward the nearest predator.
    predator_direction: [Column<f64>; D],
    /// Velocity of the nearest predator relative to the agent in m/s.
    approach: [Column<f64>; D],
    /// `approach`, scaled to a norm below 1.
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
        predator_direction: [[0.0; GROUP]; D],
        approach: [[0.0; GROUP]; D],
        approach_scaled: [[0.0; GROUP]; D],
    };

    /// Returns the body frame of the agent in a lane. `more` are further cues of its roll.
    fn frame(&self, lane: usize, velocity: &SVector<f64, D>, more: &[SVector<f64, D>]) -> Frame<D> {
        let at = |columns: &[Column<f64>; D]| SVector::from_fn(|axis, _| columns[axis][lane]);
        let cues = [
            at(&self.predator_direction),
            at(&self.heard),
            at(&self.approach),
        ];
        let cues = cues.into_iter().chain(more.iter().copied());
        if self.norm[lane] > SHORTEST {
            Frame::along(at(&self.heading), cues)
        } else {
            Frame::new(velocity, cues)
        }
    }

    /// Returns the features of the agent in a lane.
    fn features<'a>(
        &self,
        lane: usize,
        frame: &Frame<D>,
        last_range: f64,
        common: &'a Common,
    ) -> Features<'a, D> {
        let at = |columns: &[Column<f64>; D]| SVector::from_fn(|axis, _| columns[axis][lane]);
        Features {
            common,
            last_range,
            speed: self.speed[lane],
            neighbor_count: self.neighbor_count[lane],
            heard_velocity: frame.coordinates(&at(&self.heard_scaled)),
            predator_sensed: self.sensed[lane],
            predator_distance: self.distance[lane],
            predator_direction: frame.coordinates(&at(&self.predator_direction)),
            predator_velocity: frame.coordinates(&at(&self.approach_scaled)),
        }
    }
}

/// Computes the columns of one group. `heard` are the sums over its agents' neighbors.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn compute_columns<const D: usize>(
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
                let direction = &mut columns.predator_direction[axis][lane];
                let before = columns.approach[axis][lane];
                *direction = if is_nearer { offset[axis] } else { *direction };
                columns.approach[axis][lane] = if is_nearer { approach } else { before };
            }
        }
    }
    for lane in 0..GROUP {
        let length = distance[lane];
        let is_sensed = length < f64::INFINITY && length <= common.sensing_length;
        let has_direction = is_sensed && length > SHORTEST;
        columns.sensed[lane] = if is_sensed { 1.0 } else { 0.0 };
        columns.distance[lane] = if is_sensed {
            squash(length, common.length)
        } else {
            0.0
        };
        for axis in 0..D {
            let direction = &mut columns.predator_direction[axis][lane];
            let approach = columns.approach[axis][lane];
            *direction = if has_direction {
                *direction / length
            } else {
                0.0
            };
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

/// Scales every velocity w to w / (||w|| + `speed`).
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

/// Writes one row per agent. Rows of caught agents are 0.
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
    let mut extras = Writer::new(scene);
    let (mut axes, mut cues) = ([[[0.0; GROUP]; D]; D], Vec::new());
    let groups = world
        .agents()
        .groups
        .iter()
        .zip(world.neighborhood().sums());
    for (index, (group, heard)) in groups.enumerate() {
        compute_columns(group, heard, world.predators(), &common, &mut columns);
        if let Some(writer) = &mut extras {
            writer.listen(index);
        }
        let ids = world.agents().ids_of(index);
        for (lane, agent) in ids.iter().enumerate() {
            let agent = *agent as usize;
            let velocity = SVector::from_fn(|axis, _| group.velocity[axis][lane]);
            let last_range = scene.ranges[agent] / common.max_range;
            if let Some(writer) = extras.as_ref().filter(|_| D == 3) {
                cues.clear();
                writer.add_cues(lane, &mut cues);
            }
            let frame = columns.frame(lane, &velocity, &cues);
            let features = columns.features(lane, &frame, last_range, &common);
            let row = &mut out[agent * length..(agent + 1) * length];
            table(&mut Row::new(&features, row));
            if extras.is_some() {
                for (columns, axis) in axes.iter_mut().zip(frame.axes()) {
                    for k in 0..D {
                        columns[k][lane] = axis[k];
                    }
                }
            }
        }
        if let Some(writer) = &mut extras {
            let columns = writer.columns(group, &axes, heard);
            let first = length - columns.len();
            for (lane, agent) in ids.iter().enumerate() {
                let row = &mut out[*agent as usize * length..][first..length];
                for (entry, column) in row.iter_mut().zip(columns) {
                    *entry = column[lane];
                }
            }
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
