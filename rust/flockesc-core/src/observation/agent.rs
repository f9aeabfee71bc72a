//! Observations of the agents: one row per agent, in the agent's body frame.

use multiversion::multiversion;

use super::frames::{Axes, Shared, Vectors, Velocities, perceive, put_in_frames};
use super::row::{GroupRows, squash};
use super::scene::Common;
use super::{Extras, Scene};
use crate::agents::{Column, GROUP, Group};
use crate::base::entry::{Entries, Row};
use crate::base::error::Result;
use crate::base::exact::{Scale, to_float};
use crate::base::vector::SHORTEST;
use crate::flock::{Drift, HALF_COUNT, approaches};
use crate::neighbor::{NeighborSums, Profile};
use crate::parallel::Progress;

/// What the entries of one group are computed from. Values in empty lanes are unspecified.
struct Seen<'a, const D: usize> {
    group: &'a Group<D>,
    /// Sums over the neighbors in the last step, and under every candidate range.
    heard: &'a NeighborSums<D>,
    candidates: &'a [NeighborSums<D>],
    /// Ranges of the last action in m.
    last_ranges: &'a Column<f64>,
    vectors: &'a Vectors<D>,
    axes: &'a Axes<D>,
}

/// Computes and adds all entries of a group.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn add<const D: usize, R: for<'c> Row<&'c Column<f64>>>(
    row: &mut R,
    shared: &Shared<'_, D>,
    seen: &Seen<'_, D>,
) {
    let Common {
        max_range,
        length,
        speed,
        ..
    } = shared.common;
    let (group, vectors) = (seen.group, seen.vectors);
    row.number("time", 0.0, &[shared.common.time; GROUP]);
    let minimum = [shared.common.running_minimum; GROUP];
    row.number("running_minimum", 0.0, &minimum);
    let mut column = [0.0; GROUP];
    for lane in 0..GROUP {
        column[lane] = seen.last_ranges[lane] / max_range;
    }
    row.number("last_range", 0.0, &column);
    for lane in 0..GROUP {
        column[lane] = squash(vectors.own.norms[lane], speed);
    }
    row.number("speed", 0.0, &column);
    add_neighbor_count(row, seen.heard);
    add_vector(
        row,
        "heard_velocity",
        seen.axes,
        &vectors.heard.scaled(speed),
    );
    for lane in 0..GROUP {
        column[lane] = if vectors.is_sensed[lane] { 1.0 } else { 0.0 };
    }
    row.number("predator_sensed", 0.0, &column);
    for lane in 0..GROUP {
        let distance = squash(group.distance[lane], length);
        column[lane] = if vectors.is_sensed[lane] {
            distance
        } else {
            0.0
        };
    }
    row.number("predator_distance", 0.0, &column);
    add_vector(
        row,
        "predator_direction",
        seen.axes,
        &vectors.predator_direction,
    );
    let approach = vectors.approach.scaled(speed);
    add_vector(row, "predator_velocity", seen.axes, &approach);
    if !shared.extras.is_empty() {
        add_optional(row, shared, seen);
    }
}

/// Computes and adds the optional entries of a group.
#[inline(always)]
fn add_optional<const D: usize>(
    row: &mut impl for<'c> Row<&'c Column<f64>>,
    shared: &Shared<'_, D>,
    seen: &Seen<'_, D>,
) {
    let (has_escape, has_approach) = (shared.extras.has_escape(), shared.extras.has_approach());
    let Common { length, speed, .. } = shared.common;
    let (group, vectors) = (seen.group, seen.vectors);
    let (mut column, mut cosines) = ([0.0; GROUP], [0.0; GROUP]);
    if has_escape {
        add_vector(row, "escape_direction", seen.axes, &vectors.escape);
        vectors.own.cosines(&vectors.escape, &mut column);
        vectors.heard.cosines(&vectors.escape, &mut cosines);
        for lane in 0..GROUP {
            column[lane] = 0.5 * (cosines[lane] - column[lane]);
        }
        row.number("heard_escape_gain", -1.0, &column);
    }
    if has_approach {
        let (predators, sensing_length) = (shared.predators, shared.common.sensing_length);
        let found = approaches(group, &group.velocity, predators, sensing_length);
        for lane in 0..GROUP {
            column[lane] = scaled(found.distance[lane], length);
        }
        row.number("closest_approach", 0.0, &column);
        for lane in 0..GROUP {
            column[lane] = squash(found.time[lane], length / speed);
        }
        row.number("closest_approach_time", 0.0, &column);
        let distances = closest_distances(&vectors.heard, group, shared);
        row.number("heard_closest_approach", 0.0, &distances);
    }
    let mut heard = Velocities::EMPTY;
    for (k, sums) in seen.candidates.iter().enumerate() {
        heard.set_to_means(sums, shared.candidate_unit);
        row.begin_candidate(k);
        add_vector(row, "velocity", seen.axes, &heard.scaled(speed));
        add_neighbor_count(row, sums);
        if has_escape {
            heard.cosines(&vectors.escape, &mut column);
            row.number("escape_cosine", -1.0, &column);
        }
        if has_approach {
            let distances = closest_distances(&heard, group, shared);
            row.number("closest_approach", 0.0, &distances);
        }
    }
}

/// Adds the coordinates of vectors in the agents' body frames.
#[inline(always)]
fn add_vector<const D: usize>(
    row: &mut impl for<'c> Row<&'c Column<f64>>,
    name: &str,
    axes: &Axes<D>,
    vectors: &[Column<f64>; D],
) {
    let mut coordinates = [[0.0; GROUP]; D];
    put_in_frames(axes, vectors, &mut coordinates);
    row.vector(name, coordinates.each_ref());
}

/// Adds the scaled number of neighbors, the agent itself excluded.
#[inline(always)]
fn add_neighbor_count<const D: usize>(
    row: &mut impl for<'c> Row<&'c Column<f64>>,
    sums: &NeighborSums<D>,
) {
    let mut column = [0.0; GROUP];
    for lane in 0..GROUP {
        column[lane] = squash(to_float(sums.count[lane]) - 1.0, HALF_COUNT);
    }
    row.number("neighbor_count", 0.0, &column);
}

/// Returns the distances of the closest approaches with the agents' speeds and the headings of `velocities`, scaled to [0, 1).
/// An agent keeps its heading where the velocity is 0.
#[inline(always)]
fn closest_distances<const D: usize>(
    velocities: &Velocities<D>,
    group: &Group<D>,
    shared: &Shared<'_, D>,
) -> Column<f64> {
    let mut turned = group.velocity;
    for lane in 0..GROUP {
        // The speed stays, because the neighbors determine only where an agent heads.
        let norm = velocities.norms[lane];
        let factor = group.speed[lane] / norm;
        for axis in 0..D {
            let own = group.velocity[axis][lane];
            let aim = velocities.vectors[axis][lane] * factor;
            turned[axis][lane] = if norm > SHORTEST { aim } else { own };
        }
    }
    let sensing_length = shared.common.sensing_length;
    let mut distances = approaches(group, &turned, shared.predators, sensing_length).distance;
    for lane in 0..GROUP {
        distances[lane] = scaled(distances[lane], shared.common.length);
    }
    distances
}

/// Returns a distance to a predator, scaled to [0, 1), or 0 for an infinite one.
#[inline(always)]
fn scaled(distance: f64, length: f64) -> f64 {
    if distance < f64::INFINITY {
        distance / (distance + length)
    } else {
        0.0
    }
}

/// Collects the entries of a row.
pub(super) fn name<const D: usize>(extras: Extras<'_>, entries: &mut Entries) {
    // NOTE: The function that writes values also names them, so that names cannot get out of step. Values of an empty
    // group are ignored.
    let unit = Scale::new(0.0, 1);
    let shared = Shared {
        common: Common::default(),
        extras,
        predators: &[],
        places: Vec::new(),
        unit,
        candidate_unit: unit,
    };
    let seen = Seen {
        group: &Group::<D>::EMPTY,
        heard: &NeighborSums::EMPTY,
        candidates: &vec![NeighborSums::EMPTY; extras.ranges.len()],
        last_ranges: &[0.0; GROUP],
        vectors: &Vectors::EMPTY,
        axes: &[[[0.0; GROUP]; D]; D],
    };
    add(entries, &shared, &seen);
}

/// Writes one row per agent. Rows of caught agents are 0.
pub(super) fn write<const D: usize>(
    scene: &Scene<'_, D>,
    out: &mut [f32],
    progress: &Progress,
) -> Result<()> {
    let (world, extras) = (scene.world, scene.extras);
    let (agents, neighborhood) = (world.agents(), world.neighborhood());
    let length = out.len() / world.config().num_agents;
    for agent in world.caught() {
        out[agent * length..(agent + 1) * length].fill(0.0);
    }
    if agents.len() == 0 {
        return Ok(());
    }
    let predators = world.predators();
    let mut places = Vec::new();
    if extras.has_escape() {
        places = Drift::of(agents).places(predators);
    }
    let mut profile = None;
    if !extras.ranges.is_empty() {
        profile = Some(Profile::new(neighborhood, agents, extras.ranges, progress)?);
    }
    let unit = neighborhood.scale();
    let shared = Shared {
        common: scene.common(),
        extras,
        predators,
        places,
        unit,
        candidate_unit: profile.as_ref().map_or(unit, Profile::scale),
    };
    let mut last_ranges = [0.0; GROUP];
    let mut vectors = Vectors::EMPTY;
    let mut axes = [[[0.0; GROUP]; D]; D];
    let mut rows = GroupRows::new(length);
    let sums = neighborhood.sums();
    // PERF: Group by group: all columns of a group fit into the cache, and a profile needs one buffer.
    for (index, (group, heard)) in agents.groups.iter().zip(sums).enumerate() {
        progress.check()?;
        let ids = agents.ids_of(index);
        perceive(group, heard, &shared, &mut vectors);
        for (last_range, id) in last_ranges.iter_mut().zip(ids) {
            *last_range = scene.ranges[*id as usize];
        }
        let profile = profile.as_mut().map(|profile| profile.of_group(index));
        let candidates = profile.unwrap_or_default();
        vectors.find_axes(group, ids.len(), candidates, &mut axes);
        let seen = Seen {
            group,
            heard,
            candidates,
            last_ranges: &last_ranges,
            vectors: &vectors,
            axes: &axes,
        };
        add(&mut rows, &shared, &seen);
        rows.flush(ids, out);
    }
    Ok(())
}
