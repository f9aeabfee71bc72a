//! `Preview`: the flock after one more step under a candidate range, and what becomes of it.

use super::approach::{Drift, Straight, closest_distance, extremes, mean_distance_after};
use super::metrics::distances;
use super::motion::{Predators, advance};
use super::summary::Headings;
use super::world::World;
use crate::agents::Group;
use crate::neighbor::NeighborSums;

/// A copy of the agents of a flock, with their sums over neighbors.
#[derive(Debug, Default)]
pub(crate) struct Preview<const D: usize> {
    groups: Vec<Group<D>>,
    sums: Vec<NeighborSums<D>>,
}

/// What becomes of a flock if all agents and predators keep their velocities.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Forecast {
    pub(crate) headings: Headings,
    /// Mean cosine of the angle between an agent's heading and its escape direction.
    pub(crate) heading_escape: f64,
    /// Mean distance in m to the predator at its closest approach to the flock, and the time in s. With
    /// several predators, those of the smallest distance.
    pub(crate) mean_distance: f64,
    pub(crate) time: f64,
    /// The smallest distance in m of any agent to any predator.
    pub(crate) min_distance: f64,
}

impl<const D: usize> Preview<D> {
    /// Adds the next group of the flock. Its agents have the neighbors with these sums.
    pub(crate) fn push(&mut self, world: &World<D>, sums: &NeighborSums<D>) {
        let index = self.groups.len();
        self.groups.push(world.agents().groups[index].clone());
        self.sums.push(sums.clone());
    }

    /// Advances the agents by one step, without noise, delays and captures. `predators` are the predators
    /// after it.
    pub(crate) fn advance(&mut self, world: &World<D>, predators: &[Straight<D>]) {
        let (config, ids) = (world.config(), world.agents().ids());
        let after: Vec<[f64; D]> = predators.iter().map(|predator| predator.position).collect();
        let places = Predators {
            before: world.predator_positions(),
            after: &after,
        };
        let (motion, parameters) = (&config.motion, config.motion_parameters());
        let (groups, sums) = (&mut self.groups, &mut self.sums);
        advance(motion, &parameters, &places, ids, groups, sums, None);
    }

    /// Returns what becomes of the `num_agents` >= 1 agents.
    pub(crate) fn forecast(&mut self, num_agents: usize, predators: &[Straight<D>]) -> Forecast {
        let drift = Drift::of(&self.groups, num_agents);
        let (mut mean_distance, mut time) = (f64::INFINITY, 0.0);
        let mut places = Vec::with_capacity(predators.len());
        for predator in predators {
            let then = drift.time_of_approach(predator);
            let distance = mean_distance_after(&self.groups, num_agents, predator, then);
            if distance < mean_distance {
                (mean_distance, time) = (distance, then);
            }
            places.push(predator.after(then));
        }
        let min_distance = closest_distance(&self.groups, predators);
        let headings = self.headings(
            num_agents,
            predators.iter().map(|predator| predator.position),
        );
        Forecast {
            headings,
            heading_escape: self.headings(num_agents, places.into_iter()).heading_away,
            mean_distance,
            time,
            min_distance,
        }
    }

    /// Returns averages over the headings relative to these places of predators in m.
    fn headings(&mut self, num_agents: usize, places: impl Iterator<Item = [f64; D]>) -> Headings {
        let places: Vec<[f64; D]> = places.collect();
        for group in &mut self.groups {
            group.distance = distances(&group.position, &places);
        }
        let size = (num_agents, extremes(&self.groups).speed);
        Headings::of((&self.groups, &self.sums), &places, size)
    }
}
