//! Averages over the whole flock for observations and metrics. Results do not depend on the order of the
//! agents.

use multiversion::multiversion;

use crate::agents::{Column, GROUP, Group, centroid, corners, reduce};
use crate::base::exact::{Scale, to_float};
use crate::base::vector::{SHORTEST, squared_norm};
use crate::flock::world::World;
use crate::neighbor::NeighborSums;

/// Averages over all agents at one time, caught agents excluded. A value x on the scale s is stored as x / (x
/// + s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Summary<const D: usize> {
    /// Mean position in m.
    pub(crate) centroid: [f64; D],
    /// Root mean square distance to the centroid, in m.
    pub(crate) dispersion: f64,
    /// Mean velocity in m/s.
    pub(crate) velocity: [f64; D],
    /// Mean speed in m/s.
    pub(crate) speed: f64,
    /// Norm of the mean heading, in [0, 1]. The heading of an agent at rest is 0.
    pub(crate) polarization: f64,
    /// Mean number of neighbors in the last step, the agent itself excluded, on the scale of [`HALF_COUNT`].
    pub(crate) neighbor_count: f64,
    /// Mean of ||<v>_i|| in the last step, on the scale of v0.
    pub(crate) heard_alignment: f64,
    /// Mean cosine of the angle between an agent's heading and the direction away from its nearest predator.
    pub(crate) heading_away: f64,
    /// `heading_away` over the agents within rho_p of a predator; 0 without such agents.
    pub(crate) heading_away_in_range: f64,
    /// Fraction of the agents within rho_p of a predator.
    pub(crate) fraction_in_range: f64,
}

/// Scale of the number of neighbors: the scaled number is one half for eight neighbors.
pub(crate) const HALF_COUNT: f64 = 8.0;

/// The input of the sums over all agents.
struct Flock<'a, const D: usize> {
    groups: &'a [Group<D>],
    sums: &'a [NeighborSums<D>],
    predators: &'a [[f64; D]],
    /// Unit of the sums over neighbors, in m/s.
    unit: Scale,
    /// Fixed-point scales of the sums over all agents, of speeds in m/s and of numbers in [-1, 1].
    speed_scale: Scale,
    share_scale: Scale,
    speed: f64,
    predator_range: f64,
}

struct Sums<const D: usize> {
    heading: [i64; D],
    speed: i64,
    neighbor_count: i64,
    heard_alignment: i64,
    heading_away: i64,
    heading_away_in_range: i64,
    in_range: i64,
}

impl<'a, const D: usize> Flock<'a, D> {
    fn of(world: &'a World<D>, groups: &'a [Group<D>], predators: &'a [[f64; D]]) -> Self {
        let (neighborhood, num_agents) = (world.neighborhood(), world.agents().len());
        Self {
            groups,
            sums: neighborhood.sums(),
            predators,
            unit: neighborhood.scale(),
            // For D <= 3 the norm is less than twice the largest component.
            speed_scale: Scale::for_registers(2.0 * neighborhood.largest_speed(), num_agents),
            share_scale: Scale::for_registers(1.0, num_agents),
            speed: world.config().speed.largest(),
            predator_range: world.config().predator_range,
        }
    }
}

impl<const D: usize> Summary<D> {
    /// Summary of a flock without agents.
    pub(crate) const EMPTY: Self = Self {
        centroid: [0.0; D],
        dispersion: 0.0,
        velocity: [0.0; D],
        speed: 0.0,
        polarization: 0.0,
        neighbor_count: 0.0,
        heard_alignment: 0.0,
        heading_away: 0.0,
        heading_away_in_range: 0.0,
        fraction_in_range: 0.0,
    };

    pub(crate) fn of(world: &World<D>) -> Self {
        let num_agents = world.agents().len();
        if num_agents == 0 {
            return Self::EMPTY;
        }
        let n = num_agents as f64;
        let (low, high) = corners(&world.agents().groups);
        let flock = Flock::of(world, &world.agents().groups, world.predator_positions());
        let sums = add_up(&flock);
        let share = |sum: i64| flock.share_scale.value(sum) / n;
        let centroid = centroid(flock.groups, (low, high), num_agents);
        let extent: [f64; D] = std::array::from_fn(|axis| high[axis] - low[axis]);
        let square = Scale::for_registers(squared_norm(&extent), num_agents);
        let squares = add_up_squares(flock.groups, &centroid, square);
        Self {
            centroid,
            dispersion: (square.value(squares) / n).sqrt(),
            velocity: world.neighborhood().total_velocity().map(|sum| sum / n),
            speed: flock.speed_scale.value(sums.speed) / n,
            polarization: squared_norm(&sums.heading.map(share)).sqrt().min(1.0),
            neighbor_count: share(sums.neighbor_count),
            heard_alignment: share(sums.heard_alignment),
            heading_away: share(sums.heading_away),
            heading_away_in_range: if sums.in_range == 0 {
                0.0
            } else {
                flock.share_scale.value(sums.heading_away_in_range) / sums.in_range as f64
            },
            fraction_in_range: sums.in_range as f64 / n,
        }
    }
}

/// Returns the mean cosine of the angle between an agent's heading and the direction away from the nearest of
/// `places`. `groups` are the agents of `world` with their distances to these places, at least one agent.
pub(super) fn heading_away<const D: usize>(
    world: &World<D>,
    groups: &[Group<D>],
    places: &[[f64; D]],
) -> f64 {
    let flock = Flock::of(world, groups, places);
    flock.share_scale.value(add_up(&flock).heading_away) / world.agents().len() as f64
}

impl<const D: usize> World<D> {
    /// Returns the norm of the mean heading, in [0, 1].
    pub fn polarization(&self) -> f64 {
        Summary::of(self).polarization
    }
}

/// Computes all sums except the one of squared distances, in one pass.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_up<const D: usize>(flock: &Flock<'_, D>) -> Sums<D> {
    let (speed_scale, share_scale) = (flock.speed_scale, flock.share_scale);
    let mut heading = [[0; GROUP]; D];
    let mut speed = [0; GROUP];
    let mut neighbor_count = [0; GROUP];
    let mut heard_alignment = [0; GROUP];
    let mut heading_away = [0; GROUP];
    let mut heading_away_in_range = [0; GROUP];
    let mut in_range = [0; GROUP];
    for (group, neighbors) in flock.groups.iter().zip(flock.sums) {
        let (distance, norm) = (&group.distance, &group.speed);
        let away = offsets(group, flock.predators);
        for lane in 0..GROUP {
            // All ones for an agent, 0 for an empty lane, whose NaN would otherwise enter the sums.
            let is_agent = -i64::from(!distance[lane].is_nan());
            let velocity: [f64; D] = std::array::from_fn(|axis| group.velocity[axis][lane]);
            // One division replaces two. Vectors of length 0 stay 0.
            let (length, moving) = (divisor(distance[lane]), divisor(norm[lane]));
            let inverse = (length * moving).recip();
            let mut cosine = 0.0;
            for axis in 0..D {
                cosine += velocity[axis] * away[axis][lane];
                heading[axis][lane] +=
                    share_scale.quantize(velocity[axis] * (inverse * length)) & is_agent;
            }
            let cosine = share_scale.quantize(cosine * inverse) & is_agent;
            let is_in_range = -i64::from(distance[lane] <= flock.predator_range);
            speed[lane] += speed_scale.quantize(norm[lane]) & is_agent;
            heading_away[lane] += cosine;
            heading_away_in_range[lane] += cosine & is_in_range;
            in_range[lane] -= is_in_range;
        }
        for lane in 0..GROUP {
            let is_agent = -i64::from(!distance[lane].is_nan());
            let count = to_float(neighbors.count[lane]);
            let total = flock.unit.value_of(neighbors.norm[lane]);
            // (count - 1) / (count - 1 + HALF_COUNT) and ||<v>|| / (||<v>|| + v0). One division replaces two.
            let (others, norms) = (count - 1.0 + HALF_COUNT, total + flock.speed * count);
            let inverse = (others * norms).recip();
            neighbor_count[lane] +=
                share_scale.quantize((count - 1.0) * norms * inverse) & is_agent;
            heard_alignment[lane] += share_scale.quantize(total * others * inverse) & is_agent;
        }
    }
    let total = |column: Column<i64>| reduce(column, |a, b| a + b);
    Sums {
        heading: heading.map(total),
        speed: total(speed),
        neighbor_count: total(neighbor_count),
        heard_alignment: total(heard_alignment),
        heading_away: total(heading_away),
        heading_away_in_range: total(heading_away_in_range),
        in_range: total(in_range),
    }
}

/// Returns the offset in m from the nearest predator to every agent, or 0 without predators.
#[inline(always)]
fn offsets<const D: usize>(group: &Group<D>, predators: &[[f64; D]]) -> [Column<f64>; D] {
    let mut nearest = [f64::INFINITY; GROUP];
    let mut offsets = [[0.0; GROUP]; D];
    for predator in predators {
        for lane in 0..GROUP {
            let offset: [f64; D] =
                std::array::from_fn(|axis| group.position[axis][lane] - predator[axis]);
            let square = squared_norm(&offset);
            let is_nearer = square < nearest[lane];
            nearest[lane] = if is_nearer { square } else { nearest[lane] };
            for axis in 0..D {
                offsets[axis][lane] = if is_nearer {
                    offset[axis]
                } else {
                    offsets[axis][lane]
                };
            }
        }
    }
    offsets
}

/// Returns the sum of the squared distances to the centroid in units of `scale`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_up_squares<const D: usize>(groups: &[Group<D>], centroid: &[f64; D], scale: Scale) -> i64 {
    let mut squares = [0; GROUP];
    for group in groups {
        for lane in 0..GROUP {
            let offset: [f64; D] =
                std::array::from_fn(|axis| group.position[axis][lane] - centroid[axis]);
            let square = squared_norm(&offset);
            squares[lane] += scale.quantize(square) & -i64::from(!square.is_nan());
        }
    }
    reduce(squares, |a, b| a + b)
}

/// Returns `value`, or 1 if it counts as 0 or is infinite, so that a division by it is safe.
#[inline(always)]
fn divisor(value: f64) -> f64 {
    if value > SHORTEST && value < f64::INFINITY {
        value
    } else {
        1.0
    }
}
