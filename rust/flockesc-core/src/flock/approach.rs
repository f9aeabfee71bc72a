//! Closest approaches of predators and agents that keep their velocities. Results do not depend on the order
//! of the agents.

use multiversion::multiversion;

use crate::agents::{Agents, Column, GROUP, Group, centroid, corners, reduce};
use crate::base::exact::Scale;
use crate::base::vector::{SHORTEST, larger, smaller, squared_norm};
use crate::flock::metrics::{PredatorDistance, measure};
use crate::flock::summary::heading_away;
use crate::flock::world::World;
use crate::predator::Predator;

/// Averages over the agents that determine the closest approach of a predator to the flock.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Drift<const D: usize> {
    /// c, the mean position in m.
    centroid: [f64; D],
    /// Mean velocity in m/s.
    velocity: [f64; D],
    /// Mean of (r_i - c) v_i in m^2/s.
    expansion: f64,
    /// Mean of ||v_i||^2 in m^2/s^2.
    squared_speed: f64,
}

/// The closest approach of a predator to a flock, if all agents and predators keep their velocities.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Approach {
    /// Mean distance in m to the predator at its closest approach to the flock, and the time in s. With
    /// several predators, those of the smallest distance.
    pub(crate) mean_distance: f64,
    pub(crate) time: f64,
    /// The smallest distance in m of any agent to any predator.
    pub(crate) min_distance: f64,
}

impl<const D: usize> Drift<D> {
    /// Computes the averages over at least one agent.
    pub(crate) fn of(agents: &Agents<D>) -> Self {
        let (groups, num_agents, n) = (&agents.groups, agents.len(), agents.len() as f64);
        let (low, high) = corners(groups);
        let extent: [f64; D] = std::array::from_fn(|axis| high[axis] - low[axis]);
        // The norm of a shorter vector can be 0 although its entries are not.
        let extent = squared_norm(&extent).sqrt().max(SHORTEST);
        let speed = largest_speed(groups).max(SHORTEST);
        let scales = [speed, extent * speed, speed * speed];
        let scales = scales.map(|largest| Scale::for_registers(largest, num_agents));
        let centroid = centroid(groups, (low, high), num_agents);
        let (velocity, expansion, square) = add_up(groups, &centroid, scales);
        Self {
            centroid,
            velocity: velocity.map(|sum| scales[0].value(sum) / n),
            expansion: scales[1].value(expansion) / n,
            squared_speed: scales[2].value(square) / n,
        }
    }

    /// Returns where every predator is at its closest approach to the flock.
    pub(crate) fn places(&self, predators: &[Predator<D>]) -> Vec<[f64; D]> {
        let place = |predator: &Predator<D>| {
            predator.position + predator.velocity * self.time_of_approach(predator)
        };
        predators
            .iter()
            .map(|predator| place(predator).into())
            .collect()
    }

    /// Returns the time in s, at least 0, at which the mean squared distance of the agents to a predator is
    /// smallest.
    fn time_of_approach(&self, predator: &Predator<D>) -> f64 {
        // Means over the agents of (r_i - r_p) (v_i - v_p) and ||v_i - v_p||^2. They follow from the averages, because the
        // mean of r_i - c is 0.
        let (mut closing, mut squared_speed) = (self.expansion, self.squared_speed);
        for axis in 0..D {
            let (own, its) = (self.velocity[axis], predator.velocity[axis]);
            closing += (self.centroid[axis] - predator.position[axis]) * (own - its);
            squared_speed += its * (its - 2.0 * own);
        }
        time_of_minimum(closing, squared_speed)
    }
}

/// Returns the mean cosine of the angle between an agent's heading and its escape direction. The flock must
/// have at least one agent.
pub(crate) fn heading_escape<const D: usize>(world: &World<D>, drift: &Drift<D>) -> f64 {
    let places = drift.places(world.predators());
    let mut groups = world.agents().groups.clone();
    measure(&mut groups, &places);
    heading_away(world, &groups, &places)
}

/// Returns the closest approach of the predators. The flock must have at least one agent.
pub(crate) fn approach<const D: usize>(world: &World<D>, drift: &Drift<D>) -> Approach {
    let (mut groups, predators) = (world.agents().groups.clone(), world.predators());
    let mut approach = Approach {
        mean_distance: f64::INFINITY,
        time: 0.0,
        min_distance: closest_distance(&groups, predators),
    };
    for predator in predators {
        let time = drift.time_of_approach(predator);
        measure_after(&mut groups, predator, time);
        let mean_distance = PredatorDistance::of(&groups, world.agents().len()).mean;
        if mean_distance < approach.mean_distance {
            (approach.mean_distance, approach.time) = (mean_distance, time);
        }
    }
    approach
}

/// Returns the time at least 0 at which ||offset + velocity t|| is smallest. `closing` is the product of both
/// vectors, and `squared_speed` is that of the velocity with itself.
#[inline(always)]
fn time_of_minimum(closing: f64, squared_speed: f64) -> f64 {
    let time = -closing / squared_speed;
    // NaN without relative motion, or in lanes without an agent.
    if time > 0.0 && time < f64::INFINITY {
        time
    } else {
        0.0
    }
}

/// Time in s and distance in m of the closest approach of every agent of a group to any predator. The
/// distance is infinite without a predator.
#[derive(Debug, Clone)]
pub(crate) struct Approaches {
    pub(crate) time: Column<f64>,
    pub(crate) distance: Column<f64>,
}

/// Returns the closest approaches of the agents of a group if they had the given velocities in m/s. Predators
/// farther away than `range` m do not count.
#[inline(always)]
pub(crate) fn approaches<const D: usize>(
    group: &Group<D>,
    velocity: &[Column<f64>; D],
    predators: &[Predator<D>],
    range: f64,
) -> Approaches {
    let (mut time, mut distance) = ([0.0; GROUP], [f64::INFINITY; GROUP]);
    for predator in predators {
        for lane in 0..GROUP {
            let offset: [f64; D] =
                std::array::from_fn(|axis| group.position[axis][lane] - predator.position[axis]);
            let relative: [f64; D] =
                std::array::from_fn(|axis| velocity[axis][lane] - predator.velocity[axis]);
            let closing = (0..D).fold(0.0, |sum, axis| sum + offset[axis] * relative[axis]);
            let then = time_of_minimum(closing, squared_norm(&relative));
            let nearest: [f64; D] =
                std::array::from_fn(|axis| offset[axis] + relative[axis] * then);
            let length = squared_norm(&nearest).sqrt();
            let counts = squared_norm(&offset) <= range * range && length < distance[lane];
            distance[lane] = if counts { length } else { distance[lane] };
            time[lane] = if counts { then } else { time[lane] };
        }
    }
    Approaches { time, distance }
}

/// Returns the smallest distance in m of a closest approach of any agent to any predator. It is infinite
/// without agents or predators.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn closest_distance<const D: usize>(groups: &[Group<D>], predators: &[Predator<D>]) -> f64 {
    let mut smallest = [f64::INFINITY; GROUP];
    for group in groups {
        let found = approaches(group, &group.velocity, predators, f64::INFINITY);
        for lane in 0..GROUP {
            smallest[lane] = smaller(smallest[lane], found.distance[lane]);
        }
    }
    reduce(smallest, smaller)
}

/// Sets the distances in m of the agents to the ones to a predator after `time` s with the present velocities.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn measure_after<const D: usize>(groups: &mut [Group<D>], predator: &Predator<D>, time: f64) {
    for group in groups {
        for lane in 0..GROUP {
            let offset: [f64; D] = std::array::from_fn(|axis| {
                let relative = group.velocity[axis][lane] - predator.velocity[axis];
                group.position[axis][lane] - predator.position[axis] + relative * time
            });
            group.distance[lane] = squared_norm(&offset).sqrt();
        }
    }
}

/// Returns the largest speed of an agent in m/s.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn largest_speed<const D: usize>(groups: &[Group<D>]) -> f64 {
    let mut speed = [0.0; GROUP];
    for group in groups {
        for lane in 0..GROUP {
            let is_agent = !group.position[0][lane].is_nan();
            let own = if is_agent { group.speed[lane] } else { 0.0 };
            speed[lane] = larger(speed[lane], own);
        }
    }
    reduce(speed, larger)
}

/// Returns the sums of v_i, of (r_i - c) v_i and of ||v_i||^2 in units of `scales`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_up<const D: usize>(
    groups: &[Group<D>],
    centroid: &[f64; D],
    [speed_scale, expansion_scale, square_scale]: [Scale; 3],
) -> ([i64; D], i64, i64) {
    let mut velocity = [[0; GROUP]; D];
    let (mut expansion, mut square) = ([0; GROUP], [0; GROUP]);
    for group in groups {
        for lane in 0..GROUP {
            let is_agent = -i64::from(!group.position[0][lane].is_nan());
            let (mut product, mut squared_speed) = (0.0, 0.0);
            for axis in 0..D {
                let speed = group.velocity[axis][lane];
                velocity[axis][lane] += speed_scale.quantize(speed) & is_agent;
                product += (group.position[axis][lane] - centroid[axis]) * speed;
                squared_speed += speed * speed;
            }
            expansion[lane] += expansion_scale.quantize(product) & is_agent;
            square[lane] += square_scale.quantize(squared_speed) & is_agent;
        }
    }
    let total = |column: Column<i64>| reduce(column, |a, b| a + b);
    (velocity.map(total), total(expansion), total(square))
}

#[cfg(test)]
mod tests {
    use nalgebra::vector;

    use super::*;

    #[test]
    fn a_minimum_is_at_a_finite_time_of_at_least_0() {
        for (closing, squared_speed, time) in [
            (-2.0, 4.0, 0.5),
            (2.0, 4.0, 0.0),
            (0.0, 0.0, 0.0),
            (-1e-300, 0.0, 0.0), // the square of a tiny velocity is 0
        ] {
            assert_eq!(time_of_minimum(closing, squared_speed), time);
        }
    }

    #[test]
    fn drift_averages_over_the_agents() {
        let positions = [vector![-30.0, 0.0], vector![30.0, 0.0], vector![0.0, 6.0]];
        let velocities = [
            vector![-200.0, 0.0],
            vector![200.0, 0.0],
            vector![0.0, 40.0],
        ];
        let drift = Drift::of(&Agents::new(&positions, &velocities));
        assert_eq!(drift.centroid, [0.0, 2.0]);
        for (found, expected) in [
            (drift.velocity[0], 0.0),
            (drift.velocity[1], 40.0 / 3.0),
            (drift.expansion, (2.0 * 6000.0 + 160.0) / 3.0),
            (drift.squared_speed, (2.0 * 40_000.0 + 1600.0) / 3.0),
        ] {
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }
}
