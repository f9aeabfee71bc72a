//! `Preview`: the flock after one more step under a candidate range, and what becomes of it.

use multiversion::multiversion;

use super::approach::{Drift, Straight, closest_distance, extremes, measure_after};
use super::metrics::{PredatorDistance, distances};
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
    /// Creates a preview of the flock of `world` as it is. Its agents have the neighbors with these sums.
    pub(crate) fn new(world: &World<D>, sums: Vec<NeighborSums<D>>) -> Self {
        Self {
            groups: world.agents().groups.clone(),
            sums,
        }
    }

    /// Begins again with other sums.
    pub(crate) fn restart(&mut self, world: &World<D>, sums: Vec<NeighborSums<D>>) {
        self.groups.clone_from(&world.agents().groups);
        self.sums = sums;
    }

    /// Advances the agents by one step, without noise, delays and captures. `predators` are the predators
    /// after the step. Returns averages over the headings of the agents relative to the predators. The flock
    /// must have at least one agent.
    pub(crate) fn advance(&mut self, world: &World<D>, predators: &[Straight<D>]) -> Headings {
        let (config, ids) = (world.config(), world.agents().ids());
        let after: Vec<[f64; D]> = predators.iter().map(|predator| predator.position).collect();
        let places = Predators {
            before: world.predator_positions(),
            after: &after,
        };
        let (groups, sums) = (&mut self.groups, &mut self.sums);
        advance(config, &places, ids, groups, sums, None);
        self.headings(ids.len(), &after)
    }

    /// Returns averages over the present positions and velocities of the `num_agents` >= 1 agents.
    pub(crate) fn drift(&self, num_agents: usize) -> Drift<D> {
        Drift::of(&self.groups, num_agents)
    }

    /// Returns the mean cosine of the angle between an agent's heading and its escape direction. It replaces
    /// the distances to predators.
    pub(crate) fn heading_escape(
        &mut self,
        num_agents: usize,
        drift: &Drift<D>,
        predators: &[Straight<D>],
    ) -> f64 {
        let place = |predator: &Straight<D>| predator.after(drift.time_of_approach(predator));
        let places: Vec<[f64; D]> = predators.iter().map(place).collect();
        measure(&mut self.groups, &places);
        self.headings(num_agents, &places).heading_away
    }

    /// Returns the closest approach of the predators. It replaces the distances to predators.
    pub(crate) fn approach(
        &mut self,
        num_agents: usize,
        drift: &Drift<D>,
        predators: &[Straight<D>],
    ) -> Approach {
        let mut approach = Approach {
            mean_distance: f64::INFINITY,
            time: 0.0,
            min_distance: closest_distance(&self.groups, predators),
        };
        for predator in predators {
            let time = drift.time_of_approach(predator);
            measure_after(&mut self.groups, predator, time);
            let mean_distance = PredatorDistance::of(&self.groups, num_agents).mean;
            if mean_distance < approach.mean_distance {
                (approach.mean_distance, approach.time) = (mean_distance, time);
            }
        }
        approach
    }

    /// Returns averages over the headings relative to the `places` that the agents' distances are measured to.
    fn headings(&self, num_agents: usize, places: &[[f64; D]]) -> Headings {
        let size = (num_agents, extremes(&self.groups).speed);
        Headings::of((&self.groups, &self.sums), places, size)
    }
}

/// Computes the distances of the agents to the nearest of `places`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn measure<const D: usize>(groups: &mut [Group<D>], places: &[[f64; D]]) {
    for group in groups {
        group.distance = distances(&group.position, places);
    }
}
