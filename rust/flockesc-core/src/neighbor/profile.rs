//! `Profile`: the sums over neighbors that the agents would have under each of several ranges.

use crate::agents::Agents;
use crate::base::error::Result;
use crate::base::exact::Scale;
use crate::neighbor::engine::kept::Listing;
use crate::neighbor::engine::kernel::sum_neighbors;
use crate::neighbor::engine::links::Links;
use crate::neighbor::engine::profile::{ProfileScratch, sum_profile};
use crate::neighbor::engine::sums::{NeighborSums, Scratch, sum_pairs};
use crate::neighbor::neighborhood::Neighborhood;
use crate::neighbor::options::NeighborOptions;
use crate::neighbor::ranges::Ranges;
use crate::parallel::Progress;

/// The sums over neighbors at the current positions, if all agents had the same range, for each of several
/// ranges.
#[derive(Debug)]
pub(crate) struct Profile<'a, const D: usize> {
    neighborhood: &'a Neighborhood<D>,
    agents: &'a Agents<D>,
    search: Search<D>,
    sums: Vec<NeighborSums<D>>,
}

/// The search for the neighbors under all ranges.
#[derive(Debug)]
enum Search<const D: usize> {
    /// One descent of the tree for all ranges, with their squares in m^2.
    Together(Vec<f64>, ProfileScratch<D>),
    /// One search per range, with the reaches and lists that the rule computes for it.
    Each(Vec<(f64, Links)>, Scratch),
}

impl<'a, const D: usize> Profile<'a, D> {
    /// Creates the profile for `ranges` in m, in ascending order.
    ///
    /// # Errors
    /// [`crate::Error::Interrupted`] if `progress` was cancelled.
    pub(crate) fn new(
        neighborhood: &'a Neighborhood<D>,
        agents: &'a Agents<D>,
        ranges: &[f64],
        progress: &Progress,
    ) -> Result<Self> {
        let (options, tree) = neighborhood.search();
        let search = if options.is_by_range() {
            let square = |range: &f64| (range * range).min(f64::MAX);
            let scratch = ProfileScratch::new(tree, ranges.len());
            Search::Together(ranges.iter().map(square).collect(), scratch)
        } else {
            let candidate = |range: &f64| {
                progress.check()?;
                let links = neighborhood.links_at(agents, Ranges::Shared(*range));
                Ok((*range, links))
            };
            let candidates: Result<_> = ranges.iter().map(candidate).collect();
            Search::Each(candidates?, Scratch::default())
        };
        Ok(Self {
            neighborhood,
            agents,
            search,
            sums: vec![NeighborSums::EMPTY; ranges.len()],
        })
    }

    /// Returns the memory in bytes of the profile of this many agents.
    pub(crate) fn bytes(options: &NeighborOptions, num_agents: usize, num_ranges: usize) -> usize {
        let search = if options.is_by_range() {
            ProfileScratch::<D>::bytes(num_agents)
        } else {
            num_ranges * Links::bytes(options, num_agents)
        };
        search + num_ranges * size_of::<NeighborSums<D>>()
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
        let agents = self.agents;
        match &mut self.search {
            Search::Together(squares, scratch) => {
                sum_profile(agents, tree, squares, group, &mut self.sums, scratch);
            }
            Search::Each(candidates, scratch) => {
                for ((range, links), sums) in candidates.iter().zip(&mut self.sums) {
                    let sums = std::slice::from_mut(sums);
                    match links.reaches(options, Ranges::Shared(*range)) {
                        Some(reaches) => {
                            sum_neighbors(
                                agents,
                                tree,
                                reaches,
                                options.field_of_view,
                                true,
                                Listing::Discarded,
                                group,
                                sums,
                                scratch,
                            );
                        }
                        None => sum_pairs(links.pairs(options, agents, tree), group, sums, scratch),
                    }
                }
            }
        }
        &self.sums
    }
}
