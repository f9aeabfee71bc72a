//! `Profile`: the sums over neighbors that the agents would have under each of several ranges.

use std::borrow::Cow;

use crate::agents::Agents;
use crate::base::error::Result;
use crate::base::exact::Scale;
use crate::neighbor::engine::kernel::SumNeighbors;
use crate::neighbor::engine::links::Links;
use crate::neighbor::engine::sums::{NeighborSums, Scratch, sum_pairs};
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::engine::verlet::Reuse;
use crate::neighbor::neighborhood::Neighborhood;
use crate::neighbor::options::NeighborOptions;
use crate::neighbor::ranges::Ranges;
use crate::parallel::Progress;

/// The sums over neighbors at the current positions, if all agents had the same range, for each of several
/// ranges.
#[derive(Debug)]
pub(crate) struct Profile<'a, const D: usize> {
    options: &'a NeighborOptions,
    tree: Cow<'a, Tree<D>>,
    agents: &'a Agents<D>,
    /// Ranges in m, with the reaches and lists that the rule computes for them.
    ranges: Vec<(f64, Links)>,
    sums: Vec<NeighborSums<D>>,
    scratch: Scratch,
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
        let (options, tree) = neighborhood.search(agents);
        let with_links = |range: &f64| {
            progress.check()?;
            let links = neighborhood.current_links(options, agents, &tree, Ranges::Shared(*range));
            Ok((*range, links))
        };
        Ok(Self {
            ranges: ranges.iter().map(with_links).collect::<Result<_>>()?,
            options,
            tree,
            agents,
            sums: vec![NeighborSums::EMPTY; ranges.len()],
            scratch: Scratch::default(),
        })
    }

    /// Returns the fixed-point scale of the sums in m/s.
    pub(crate) fn scale(&self) -> Scale {
        self.tree.scale
    }

    /// Computes the sums of the agents of a group, one entry per range.
    pub(crate) fn of_group(&mut self, group: usize) -> &[NeighborSums<D>] {
        let (options, tree) = (self.options, &self.tree);
        let (agents, scratch) = (self.agents, &mut self.scratch);
        for ((range, links), sums) in self.ranges.iter().zip(&mut self.sums) {
            let sums = std::slice::from_mut(sums);
            match links.reaches(options, Ranges::Shared(*range)) {
                Some(reaches) => {
                    SumNeighbors {
                        agents,
                        tree,
                        reaches,
                        torus: options.torus,
                        field_of_view: options.field_of_view,
                        is_counting: true,
                        reuse: Reuse::Discarded,
                        first: group,
                        sums,
                        scratch,
                    }
                    .run();
                }
                None => sum_pairs(links.pairs(options, agents, tree), group, sums, scratch),
            }
        }
        &self.sums
    }
}
