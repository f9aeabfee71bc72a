//! Observations of the agents: one row per agent, in the agent's body frame.

use multiversion::multiversion;
use nalgebra::SVector;

use super::Scene;
use super::columns::{ColumnTable, GroupRows, Rows, put_in_frames};
use super::extras::agent::Writer;
use super::table::squash;
use super::vectors::Vectors;
use crate::agents::{Column, GROUP, Group};
use crate::base::error::Result;
use crate::base::exact::{Scale, to_float};
use crate::base::vector::{SHORTEST, squared_norm};
use crate::flock::HALF_COUNT;
use crate::neighbor::NeighborSums;
use crate::parallel::Progress;
use crate::predator::Predator;

/// The values that are the same for all agents of a flock.
struct Common {
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

/// Columns of values of the agents of one group, scaled as in their rows. Vectors are in the agents' body
/// frames. Values in empty lanes are unspecified.
pub(super) struct Features<const D: usize> {
    time: Column<f64>,
    running_minimum: Column<f64>,
    /// In m until the entries are added.
    last_range: Column<f64>,
    speed: Column<f64>,
    /// Number of neighbors in the last step, the agent itself excluded.
    neighbor_count: Column<f64>,
    /// Mean velocity of the neighbors and the agent itself.
    heard_velocity: [Column<f64>; D],
    /// 1 if the agent senses the nearest predator, otherwise 0. The values below are then 0, too.
    predator_sensed: Column<f64>,
    predator_distance: Column<f64>,
    predator_direction: [Column<f64>; D],
    predator_velocity: [Column<f64>; D],
}

/// Adds the entries of a row to `table`.
#[inline(always)]
pub(super) fn table<const D: usize>(table: &mut impl ColumnTable<Features<D>>) {
    table.numbers("time", 0.0, |features| &features.time);
    table.numbers("running_minimum", 0.0, |features| &features.running_minimum);
    table.numbers("last_range", 0.0, |features| &features.last_range);
    table.numbers("speed", 0.0, |features| &features.speed);
    table.numbers("neighbor_count", 0.0, |features| &features.neighbor_count);
    table.vectors("heard_velocity", |features| &features.heard_velocity);
    table.numbers("predator_sensed", 0.0, |features| &features.predator_sensed);
    table.numbers("predator_distance", 0.0, |features| {
        &features.predator_distance
    });
    table.vectors("predator_direction", |features| {
        &features.predator_direction
    });
    table.vectors("predator_velocity", |features| &features.predator_velocity);
}

impl<const D: usize> Features<D> {
    const EMPTY: Self = Self {
        time: [0.0; GROUP],
        running_minimum: [0.0; GROUP],
        last_range: [0.0; GROUP],
        speed: [0.0; GROUP],
        neighbor_count: [0.0; GROUP],
        heard_velocity: [[0.0; GROUP]; D],
        predator_sensed: [0.0; GROUP],
        predator_distance: [0.0; GROUP],
        predator_direction: [[0.0; GROUP]; D],
        predator_velocity: [[0.0; GROUP]; D],
    };
}

/// Computes the numbers and vectors of one group. `heard` are the sums over its agents' neighbors.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn compute<const D: usize>(
    group: &Group<D>,
    heard: &NeighborSums<D>,
    predators: &[Predator<D>],
    common: &Common,
    features: &mut Features<D>,
    vectors: &mut Vectors<D>,
) {
    let mut nearest = [f64::INFINITY; GROUP];
    for predator in predators {
        for lane in 0..GROUP {
            let offset: [f64; D] =
                std::array::from_fn(|axis| predator.position[axis] - group.position[axis][lane]);
            let square = squared_norm(&offset);
            let is_nearer = square < nearest[lane];
            nearest[lane] = if is_nearer { square } else { nearest[lane] };
            for axis in 0..D {
                let approach = predator.velocity[axis] - group.velocity[axis][lane];
                let direction = &mut vectors.predator_direction[axis][lane];
                let before = vectors.approach[axis][lane];
                *direction = if is_nearer { offset[axis] } else { *direction };
                vectors.approach[axis][lane] = if is_nearer { approach } else { before };
            }
        }
    }
    for lane in 0..GROUP {
        let length = group.distance[lane];
        let is_sensed = length < f64::INFINITY && length <= common.sensing_length;
        let has_direction = is_sensed && length > SHORTEST;
        features.predator_sensed[lane] = if is_sensed { 1.0 } else { 0.0 };
        features.predator_distance[lane] = if is_sensed {
            squash(length, common.length)
        } else {
            0.0
        };
        for axis in 0..D {
            let direction = &mut vectors.predator_direction[axis][lane];
            let approach = vectors.approach[axis][lane];
            *direction = if has_direction {
                *direction / length
            } else {
                0.0
            };
            vectors.approach[axis][lane] = if is_sensed { approach } else { 0.0 };
        }
    }
    for lane in 0..GROUP {
        let velocity: [f64; D] = std::array::from_fn(|axis| group.velocity[axis][lane]);
        let norm = squared_norm(&velocity).sqrt();
        vectors.norm[lane] = norm;
        features.speed[lane] = squash(norm, common.speed);
        let count = to_float(heard.count[lane]);
        features.neighbor_count[lane] = squash(count - 1.0, HALF_COUNT);
        for axis in 0..D {
            vectors.heading[axis][lane] = velocity[axis] / norm;
            vectors.heard[axis][lane] = common.unit.value(heard.sum[axis][lane]) / count;
        }
    }
}

/// Computes the vectors in the body frames with these `axes`, and adds all entries to `rows`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_entries<const D: usize>(
    axes: &[[Column<f64>; D]; D],
    vectors: &Vectors<D>,
    common: &Common,
    features: &mut Features<D>,
    rows: &mut GroupRows,
) {
    for last_range in &mut features.last_range {
        *last_range /= common.max_range;
    }
    let heard = scaled(&vectors.heard, common.speed);
    put_in_frames(axes, &heard, &mut features.heard_velocity);
    let direction = &mut features.predator_direction;
    put_in_frames(axes, &vectors.predator_direction, direction);
    let approach = scaled(&vectors.approach, common.speed);
    put_in_frames(axes, &approach, &mut features.predator_velocity);
    table(&mut Rows { features, rows });
}

/// Scales every velocity w to w / (||w|| + `speed`).
#[inline(always)]
fn scaled<const D: usize>(velocities: &[Column<f64>; D], speed: f64) -> [Column<f64>; D] {
    let mut scaled = [[0.0; GROUP]; D];
    for lane in 0..GROUP {
        let velocity: [f64; D] = std::array::from_fn(|axis| velocities[axis][lane]);
        let divisor = squared_norm(&velocity).sqrt() + speed;
        for axis in 0..D {
            scaled[axis][lane] = velocity[axis] / divisor;
        }
    }
    scaled
}

/// Writes one row per agent. Rows of caught agents are 0.
pub(super) fn write<const D: usize>(
    scene: &Scene<'_, D>,
    out: &mut [f32],
    progress: &Progress,
) -> Result<()> {
    let world = scene.world;
    let common = Common {
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
    if world.agents().len() == 0 {
        return Ok(());
    }
    let mut features = Features {
        time: [scene.time(); GROUP],
        running_minimum: [scene.running_minimum(); GROUP],
        ..Features::EMPTY
    };
    let mut vectors = Vectors::EMPTY;
    let mut axes = [[[0.0; GROUP]; D]; D];
    let mut rows = GroupRows::new(length);
    let mut extras = Writer::new(scene, progress)?;
    let sums = world.neighborhood().sums();
    for (index, (group, heard)) in world.agents().groups.iter().zip(sums).enumerate() {
        progress.check()?;
        let ids = world.agents().ids_of(index);
        compute(
            group,
            heard,
            world.predators(),
            &common,
            &mut features,
            &mut vectors,
        );
        for (last_range, id) in features.last_range.iter_mut().zip(ids) {
            *last_range = scene.ranges[*id as usize];
        }
        if let Some(writer) = &mut extras {
            writer.listen(index);
        }
        vectors.find_axes(group, ids.len(), extras.as_ref(), &mut axes);
        add_entries(&axes, &vectors, &common, &mut features, &mut rows);
        if let Some(writer) = &mut extras {
            writer.add_entries(group, &axes, heard, &mut rows);
        }
        rows.flush(ids, out);
    }
    Ok(())
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
