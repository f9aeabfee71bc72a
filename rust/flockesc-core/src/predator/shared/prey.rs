//! What predators see: all agents where they are now.

use nalgebra::SVector;

use crate::agents::{Agents, centroid};
use crate::neighbor::Neighborhood;

/// The agents at the end of a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prey<'a, const D: usize> {
    pub(crate) agents: &'a Agents<D>,
    pub(crate) neighborhood: &'a Neighborhood<D>,
}

/// One agent.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Quarry<const D: usize> {
    /// The index that users know.
    pub(crate) id: usize,
    /// r in m.
    pub(crate) position: SVector<f64, D>,
    /// v in m/s.
    pub(crate) velocity: SVector<f64, D>,
}

impl<const D: usize> Prey<'_, D> {
    /// The agent nearest to `place`; the lowest id among equals.
    pub(in crate::predator) fn nearest(&self, place: &SVector<f64, D>) -> Option<Quarry<D>> {
        let mut best = (f64::INFINITY, usize::MAX, None);
        for quarry in self.all() {
            let squared = (quarry.position - place).norm_squared();
            if squared < best.0 || (squared == best.0 && quarry.id < best.1) {
                best = (squared, quarry.id, Some(quarry));
            }
        }
        best.2
    }

    /// The `count` agents nearest to `place`, or all, nearest first; lower ids first among equals.
    pub(in crate::predator) fn nearest_few(
        &self,
        place: &SVector<f64, D>,
        count: usize,
    ) -> Vec<Quarry<D>> {
        let mut few: Vec<(f64, Quarry<D>)> = Vec::with_capacity(count + 1);
        for quarry in self.all() {
            let squared = (quarry.position - place).norm_squared();
            let is_before = |(other, q): &(f64, Quarry<D>)| (*other, q.id) < (squared, quarry.id);
            let rank = few.partition_point(is_before);
            if rank < count {
                few.insert(rank, (squared, quarry));
                few.truncate(count);
            }
        }
        few.into_iter().map(|(_, quarry)| quarry).collect()
    }

    /// The agents within `sight` m of `place`, boundary included, in any order.
    pub(crate) fn within(
        &self,
        place: &SVector<f64, D>,
        sight: f64,
    ) -> impl Iterator<Item = Quarry<D>> {
        self.all()
            .filter(move |quarry| (quarry.position - place).norm_squared() <= sight * sight)
    }

    /// The agent of this `rank` in the order of ids among those within `sight` m of `place`.
    pub(in crate::predator) fn at_rank(
        &self,
        place: &SVector<f64, D>,
        sight: f64,
        rank: usize,
    ) -> Option<Quarry<D>> {
        // Places are not in the order of ids: bisect the ids by counting.
        let (mut low, mut high) = (0, self.agents.num_agents());
        while high - low > 1 {
            let middle = low.midpoint(high);
            let before = self.within(place, sight).filter(|q| q.id < middle).count();
            if before <= rank {
                low = middle;
            } else {
                high = middle;
            }
        }
        self.within(place, sight).find(|quarry| quarry.id == low)
    }

    fn all(&self) -> impl Iterator<Item = Quarry<D>> {
        self.agents.iter().map(|(id, position, velocity)| Quarry {
            id,
            position,
            velocity,
        })
    }

    /// Mean position of all agents in m; `None` if there are none.
    pub(in crate::predator) fn centroid(&self) -> Option<SVector<f64, D>> {
        let bounds = self.neighborhood.bounds();
        let agents = self.agents;
        (agents.len() > 0).then(|| centroid(&agents.groups, bounds, agents.len()).into())
    }

    /// Position in m of the agent whose nearest other agent is farthest; the lowest id among equals.
    pub(in crate::predator) fn most_isolated(&self) -> Option<SVector<f64, D>> {
        let agents = self.agents;
        (agents.len() > 0).then(|| agents.at(self.neighborhood.most_isolated(agents)).1)
    }
}
