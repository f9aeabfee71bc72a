//! `Profile`: the sums over neighbors that the agents would have under each of several ranges.

use crate::agents::Agents;
use crate::base::exact::Scale;
use crate::neighbor::engine::kernel::sum_neighbors;
use crate::neighbor::engine::links::Links;
use crate::neighbor::engine::sums::{NeighborSums, Scratch, sum_pairs};
use crate::neighbor::neighborhood::Neighborhood;
use crate::neighbor::ranges::Ranges;

/// The sums over neighbors at the current positions, if all agents had the same range, for each of several
/// ranges.
#[derive(Debug)]
pub(crate) struct Profile<'a, const D: usize> {
    neighborhood: &'a Neighborhood<D>,
    agents: &'a Agents<D>,
    /// The ranges, with the reaches and lists that the rule computes for them.
    candidates: Vec<(f64, Links)>,
    sums: Vec<NeighborSums<D>>,
    scratch: Scratch,
}

impl<'a, const D: usize> Profile<'a, D> {
    pub(crate) fn new(
        neighborhood: &'a Neighborhood<D>,
        agents: &'a Agents<D>,
        ranges: &[f64],
    ) -> Self {
        let candidate = |range: &f64| {
            let links = neighborhood.links_at(agents, Ranges::Shared(*range));
            (*range, links)
        };
        Self {
            neighborhood,
            agents,
            candidates: ranges.iter().map(candidate).collect(),
            sums: vec![NeighborSums::EMPTY; ranges.len()],
            scratch: Scratch::default(),
        }
    }

    /// Returns the fixed-point scale of the sums in m/s.
    pub(crate) fn scale(&self) -> Scale {
        self.neighborhood.search().1.scale
    }

    /// Returns the sums of the group of the last call of [`Self::of_group`].
    pub(crate) fn sums(&self) -> &[NeighborSums<D>] {
        &self.sums
    }

    /// Computes the sums of the agents of a group, one entry per range.
    pub(crate) fn of_group(&mut self, group: usize) -> &[NeighborSums<D>] {
        let (options, tree) = self.neighborhood.search();
        let scratch = &mut self.scratch;
        for ((range, links), sums) in self.candidates.iter().zip(&mut self.sums) {
            let sums = std::slice::from_mut(sums);
            match links.reaches(options, Ranges::Shared(*range)) {
                Some(reaches) => sum_neighbors(self.agents, tree, reaches, group, sums, scratch),
                None => {
                    let pairs = links.pairs(options, self.agents, tree);
                    sum_pairs(pairs, group, sums, scratch);
                }
            }
        }
        &self.sums
    }
}
