//! `Prey`: queries of predators on the agents, such as the nearest agent and the centroid.

use nalgebra::SVector;

use crate::agents::{Agent, Agents, centroid, corners};
use crate::base::vector::{smaller, squared_norm};
use crate::neighbor::Neighborhood;

/// The agents of a flock, for queries of predators.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prey<'a, const D: usize> {
    pub(crate) agents: &'a Agents<D>,
    pub(crate) neighborhood: &'a Neighborhood<D>,
}

impl<'a, const D: usize> Prey<'a, D> {
    pub(crate) fn new(agents: &'a Agents<D>, neighborhood: &'a Neighborhood<D>) -> Self {
        Self {
            agents,
            neighborhood,
        }
    }

    /// Returns the agent nearest to `place`; among equals, the one with the lowest id.
    pub(crate) fn nearest(&self, place: &SVector<f64, D>) -> Option<Agent<D>> {
        let (mut least, mut best) = (f64::INFINITY, None::<Agent<D>>);
        for agent in self.agents.iter() {
            let squared = (agent.position - place).norm_squared();
            let has_lower_id = || best.is_none_or(|other| agent.id < other.id);
            if squared < least || (squared == least && has_lower_id()) {
                (least, best) = (squared, Some(agent));
            }
        }
        best
    }

    /// Returns the `count` agents nearest to `place`, or all if there are fewer, in the order of distance and
    /// then of ids.
    pub(crate) fn nearest_few(&self, place: &SVector<f64, D>, count: usize) -> Vec<Agent<D>> {
        let mut few: Vec<(f64, Agent<D>)> = Vec::with_capacity(count + 1);
        for agent in self.agents.iter() {
            let squared = (agent.position - place).norm_squared();
            let is_before = |(other, q): &(f64, Agent<D>)| (*other, q.id) < (squared, agent.id);
            let rank = few.partition_point(is_before);
            if rank < count {
                few.insert(rank, (squared, agent));
                few.truncate(count);
            }
        }
        few.into_iter().map(|(_, agent)| agent).collect()
    }

    /// Returns the agents within `radius` m of `place`, boundary included, in no particular order.
    pub(crate) fn within(
        &self,
        place: &SVector<f64, D>,
        radius: f64,
    ) -> impl Iterator<Item = Agent<D>> {
        self.agents
            .iter()
            .filter(move |agent| (agent.position - place).norm_squared() <= radius * radius)
    }

    /// Returns the agent that has the index `rank` among the agents within `radius` m of `place`, in the
    /// order of ids.
    pub(crate) fn at_rank(
        &self,
        place: &SVector<f64, D>,
        radius: f64,
        rank: usize,
    ) -> Option<Agent<D>> {
        // Agents are not stored in the order of ids, so bisect the ids by counting.
        let (mut low, mut high) = (0, self.agents.num_agents() as u32);
        while high - low > 1 {
            let middle = low.midpoint(high);
            let before = self.within(place, radius).filter(|q| q.id < middle).count();
            if before <= rank {
                low = middle;
            } else {
                high = middle;
            }
        }
        self.within(place, radius).find(|agent| agent.id == low)
    }

    /// Returns the mean position of all agents in m, or `None` if there are no agents.
    pub(crate) fn centroid(&self) -> Option<SVector<f64, D>> {
        let agents = self.agents;
        let bounds = corners(&agents.groups);
        (agents.len() > 0).then(|| centroid(&agents.groups, bounds, agents.len()).into())
    }

    /// Returns the position in m of the agent whose nearest other agent is farthest away; among equals, the
    /// one with the lowest id.
    pub(crate) fn most_isolated(&self) -> Option<SVector<f64, D>> {
        let agents = self.agents;
        (agents.len() > 0).then(|| agents.agent(most_isolated(agents)).position)
    }
}

/// Returns the place of the agent whose nearest other agent is farthest away; among equals, the one with the
/// lowest id.
fn most_isolated<const D: usize>(agents: &Agents<D>) -> usize {
    let (mut farthest, mut best) = (f64::NEG_INFINITY, 0);
    for place in 0..agents.len() {
        let nearest = squared_to_nearest(agents, place, farthest);
        let has_lower_id = || agents.id(place) < agents.id(best);
        if nearest > farthest || (nearest == farthest && has_lower_id()) {
            (farthest, best) = (nearest, place);
        }
    }
    best
}

/// Returns the squared distance in m^2 from the agent at `place` to the nearest other one, or any that is below
/// `stop_below`. Agents that are close in memory are close in space, so most searches stop after some agents.
fn squared_to_nearest<const D: usize>(agents: &Agents<D>, place: usize, stop_below: f64) -> f64 {
    let (own, mut nearest) = (agents.position(place), f64::INFINITY);
    for step in 1..agents.len() {
        for other in [place.wrapping_sub(step), place + step] {
            if other < agents.len() {
                let other = agents.position(other);
                let offset: [f64; D] = std::array::from_fn(|axis| other[axis] - own[axis]);
                nearest = smaller(nearest, squared_norm(&offset));
            }
        }
        if nearest < stop_below {
            break;
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::SVector;
    use proptest::prelude::*;

    /// Returns the ids of the most isolated agent from the search and from a comparison of all pairs.
    fn found_and_expected<const D: usize>(coordinates: &[i32]) -> (usize, usize) {
        let positions: Vec<SVector<f64, D>> = coordinates
            .chunks_exact(D)
            .map(|row| SVector::from_fn(|axis, _| f64::from(row[axis])))
            .collect();
        let agents = Agents::new(&positions, &positions);
        let nearest = |i: usize| {
            (0..positions.len())
                .filter(|&j| j != i)
                .map(|j| (positions[j] - positions[i]).norm_squared())
                .fold(f64::INFINITY, f64::min)
        };
        let expected = (0..positions.len()).fold((0, f64::NEG_INFINITY), |best, i| {
            let distance = nearest(i);
            if distance > best.1 {
                (i, distance)
            } else {
                best
            }
        });
        (agents.id(most_isolated(&agents)), expected.0)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Integer coordinates, so that many agents coincide and many distances are equal.
        #[test]
        fn equals_all_pairs(coordinates in prop::collection::vec(-40..40_i32, 6..2400)) {
            let (found, expected) = found_and_expected::<2>(&coordinates);
            prop_assert_eq!(found, expected);
            let (found, expected) = found_and_expected::<3>(&coordinates);
            prop_assert_eq!(found, expected);
        }
    }
}
