//! `Preview`: the flock after one more step under a candidate range, and what becomes of it.

use super::approach::{Drift, Straight, closest_distance, extremes, mean_distance_after};
use super::metrics::distances;
use super::motion::{Predators, advance};
use super::summary::Headings;
use super::world::World;
use crate::agents::Group;
use crate::neighbor::NeighborSums;

/// A copy of the agents of a flock, with their sums over neighbors.
#[derive(Debug)]
pub(crate) struct Preview<const D: usize> {
    groups: Vec<Group<D>>,
    sums: Vec<NeighborSums<D>>,
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

impl<const D: usize> Preview<D> {
    /// Creates a preview of a flock with `num_groups` groups, without agents.
    pub(crate) fn new(num_groups: usize) -> Self {
        Self {
            groups: Vec::with_capacity(num_groups),
            sums: Vec::with_capacity(num_groups),
        }
    }

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

    /// Returns averages over the headings of the `num_agents` >= 1 agents relative to the predators.
    pub(crate) fn headings(&mut self, num_agents: usize, predators: &[Straight<D>]) -> Headings {
        self.headings_from(
            num_agents,
            predators.iter().map(|predator| predator.position),
        )
    }

    /// Returns the mean cosine of the angle between an agent's heading and its escape direction.
    pub(crate) fn heading_escape(&mut self, num_agents: usize, predators: &[Straight<D>]) -> f64 {
        let drift = Drift::of(&self.groups, num_agents);
        let place = |predator: &Straight<D>| predator.after(drift.time_of_approach(predator));
        self.headings_from(num_agents, predators.iter().map(place))
            .heading_away
    }

    /// Returns the closest approach of the predators.
    pub(crate) fn approach(&self, num_agents: usize, predators: &[Straight<D>]) -> Approach {
        let drift = Drift::of(&self.groups, num_agents);
        let approach = |predator: &Straight<D>| {
            let time = drift.time_of_approach(predator);
            (
                mean_distance_after(&self.groups, num_agents, predator, time),
                time,
            )
        };
        let nearest = predators
            .iter()
            .map(approach)
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let (mean_distance, time) = nearest.unwrap_or((f64::INFINITY, 0.0));
        Approach {
            mean_distance,
            time,
            min_distance: closest_distance(&self.groups, predators),
        }
    }

    fn headings_from(
        &mut self,
        num_agents: usize,
        places: impl Iterator<Item = [f64; D]>,
    ) -> Headings {
        let places: Vec<[f64; D]> = places.collect();
        for group in &mut self.groups {
            group.distance = distances(&group.position, &places);
        }
        let size = (num_agents, extremes(&self.groups).speed);
        Headings::of((&self.groups, &self.sums), &places, size)
    }
}
