//! `Neighborhood`: the neighbor graph of a flock and the sums over neighbors, for all neighbor rules.

mod state;

use std::borrow::Cow;

use crate::agents::{Agents, GROUP};
use crate::base::error::Result;
use crate::base::exact::Scale;
use crate::base::memory;
use crate::neighbor::engine::components::Components;
use crate::neighbor::engine::kernel::SumNeighbors;
use crate::neighbor::engine::links::Links;
use crate::neighbor::engine::lists::{Lists, RANGE};
use crate::neighbor::engine::pairs::Pairs;
use crate::neighbor::engine::sums::{NeighborSums, Scratch, remove_warnings, sum_pairs};
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::engine::verlet::{Reuse, VerletLists};
use crate::neighbor::options::NeighborOptions;
use crate::neighbor::ranges::Ranges;
use crate::neighbor::rules::rule::Criterion;
use crate::parallel;
pub(crate) use state::NeighborhoodState;

/// Growth of the area around a leaf, as a side, after which the agents are re-sorted. The number of candidates grows by
/// its square, so that 21 % more work are weighed against a sort; other growths were no faster.
const MOST_GROWTH: f64 = 1.1;

/// The neighbor graph of a flock, with the sums over the neighbors of every agent.
#[derive(Debug, Clone)]
pub(crate) struct Neighborhood<const D: usize> {
    options: NeighborOptions,
    tree: Tree<D>,
    links: Links,
    sums: Vec<NeighborSums<D>>,
    /// Fixed-point scale of the sums in m/s.
    scale: Scale,
    scratch: Vec<Scratch>,
    verlet: VerletLists<D>,
    /// Whether the numbers of neighbors are needed.
    is_counting: bool,
    /// Mean extent of a leaf in m after the last re-sort.
    sorted_extent: f64,
}

impl<const D: usize> Neighborhood<D> {
    /// Creates the neighborhood at t = 0. Every agent's only neighbor is the agent itself.
    pub(crate) fn new(options: NeighborOptions, agents: &mut Agents<D>) -> Self {
        let mut tree = Tree::new(agents.groups.len());
        tree.refresh(agents);
        tree.build_boxes(agents);
        Self {
            options,
            links: Links::default(),
            sums: agents.groups.iter().map(NeighborSums::isolated).collect(),
            scale: tree.scale,
            scratch: vec![Scratch::default(); parallel::num_chunks(agents.groups.len())],
            verlet: VerletLists::new(options.torus),
            is_counting: true,
            sorted_extent: tree.mean_extent(),
            tree,
        }
    }

    /// Stops the counting of neighbors. Their numbers are unspecified from the next step on.
    pub(crate) fn stop_counting(&mut self) {
        self.is_counting = false;
    }

    /// Computes the sums over every agent's neighbors (Eq. 11). May re-sort the agents.
    pub(crate) fn sum_neighbors(&mut self, agents: &mut Agents<D>, ranges: Ranges<'_>) {
        // PERF: Warnings are removed from the sums afterwards, which is faster than a loop over all pairs.
        let audible = NeighborOptions {
            blocks_warnings: false,
            ..self.options
        };
        // Only interaction ranges can be the same in the next step; rules compute other reaches in each.
        let is_by_range = audible.is_by_view() && audible.rule.criterion() == Criterion::Range;
        let reuse = if is_by_range {
            self.verlet.plan(agents, ranges)
        } else {
            Reuse::Discarded
        };
        // NOTE: The order matters. Boxes decide whether to sort, and a sort moves agents to other places. The store and
        // the lists of rules refer to places, so they follow it.
        if reuse != Reuse::Kept || self.options.needs_pairs {
            self.tree.build_boxes(agents);
        }
        if reuse != Reuse::Kept {
            self.sort_if_due(agents, ranges);
            if is_by_range {
                self.verlet.store(agents, ranges, reuse);
            }
        }
        let (options, tree, is_counting) = (&self.options, &self.tree, self.is_counting);
        self.links.update(options, agents, tree, ranges);
        let links = &self.links;
        parallel::for_each_chunk_with(&mut self.sums, &mut self.scratch, |first, sums, scratch| {
            match links.reaches(&audible, ranges) {
                Some(reaches) => {
                    SumNeighbors {
                        agents,
                        tree,
                        reaches,
                        torus: options.torus,
                        field_of_view: options.field_of_view,
                        is_counting,
                        reuse,
                        first,
                        sums,
                        scratch,
                    }
                    .run();
                    if options.blocks_warnings {
                        remove_warnings(links.pairs(options, agents, tree), first, sums);
                    }
                }
                None => sum_pairs(links.pairs(options, agents, tree), first, sums, scratch),
            }
            let places = first * GROUP..agents.len().min((first + sums.len()) * GROUP);
            scratch.trim(places.len(), agents.len());
        });
        // Lists that were too large to keep are gone, so the next step cannot take them.
        if matches!(reuse, Reuse::New(_)) && self.scratch.iter().any(|s| s.is_trimmed) {
            self.verlet.pause();
        }
        self.scale = tree.scale;
    }

    /// Re-sorts the agents if their leaves have grown since the last sort. Results do not depend on when this happens.
    fn sort_if_due(&mut self, agents: &mut Agents<D>, ranges: Ranges<'_>) {
        // Twice the reach plus the extent of a leaf: the side of a square around its candidates.
        let reach = 2.0 * self.links.typical_reach(&self.options, ranges);
        if self.tree.mean_extent() + reach > MOST_GROWTH * (self.sorted_extent + reach) {
            agents.arrange();
            self.tree.refresh(agents);
            self.tree.build_boxes(agents);
            self.sorted_extent = self.tree.mean_extent();
        }
    }

    /// Updates the tree after a step and its captures.
    pub(crate) fn refresh(&mut self, agents: &mut Agents<D>) {
        let num_groups = agents.groups.len();
        if num_groups < self.sums.len() {
            self.sums.truncate(num_groups);
            self.scratch.truncate(parallel::num_chunks(num_groups));
            self.tree = Tree::new(num_groups);
        }
        self.tree.refresh(agents);
    }

    /// Updates the tree after agents were changed between steps. Candidates within the drift of a jump would be too many.
    pub(crate) fn refresh_changed(&mut self, agents: &mut Agents<D>) {
        self.verlet = VerletLists::new(self.options.torus);
        self.refresh(agents);
    }

    /// Moves the sums of an agent from its old place `from` to its new place `to`.
    pub(crate) fn relocate(&mut self, from: usize, to: usize) {
        let agent = self.sums[from / GROUP].of(from % GROUP);
        self.sums[to / GROUP].set(to % GROUP, &agent);
    }

    /// Returns the number of others that the `num_agents` agents heard in the last step, summed over the agents; 0
    /// without counting.
    pub(crate) fn num_heard(&self, num_agents: usize) -> i64 {
        if !self.is_counting {
            return 0;
        }
        let groups = self.sums.iter().zip((0..num_agents).step_by(GROUP));
        let counts = groups.map(|(sums, first)| &sums.count[..GROUP.min(num_agents - first)]);
        counts.map(|count| count.iter().sum::<i64>()).sum::<i64>() - num_agents as i64
    }

    /// Returns the sums of the last step, group by group.
    pub(crate) fn sums(&self) -> &[NeighborSums<D>] {
        &self.sums
    }

    /// Returns the sums of the last step as mutable, group by group.
    pub(crate) fn sums_mut(&mut self) -> &mut [NeighborSums<D>] {
        &mut self.sums
    }

    /// Returns the neighbor graph of the current step. Only for options with
    /// [`NeighborOptions::needs_pairs`].
    pub(crate) fn pairs<'a>(&'a self, agents: &'a Agents<D>) -> Pairs<'a, D> {
        self.links.pairs(&self.options, agents, &self.tree)
    }

    /// Returns the fixed-point scale of the sums in m/s.
    pub(crate) fn scale(&self) -> Scale {
        self.scale
    }

    /// Returns the sum of the velocities of all agents in m/s.
    pub(crate) fn total_velocity(&self) -> [f64; D] {
        let sums = self.tree.root().sum;
        sums.map(|sum| self.tree.scale.value(sum.iter().sum()))
    }

    /// Returns the largest magnitude of a velocity component in m/s.
    pub(crate) fn largest_speed(&self) -> f64 {
        self.tree.largest_speed
    }

    /// Returns the ids of all pairs of an agent and a neighbor other than itself, at the current positions.
    ///
    /// # Errors
    /// [`crate::Error::Memory`].
    pub(crate) fn pairs_by_id(
        &self,
        agents: &Agents<D>,
        ranges: Ranges<'_>,
    ) -> Result<Vec<(u32, u32)>> {
        self.with_pairs(agents, ranges, |pairs| pairs.by_id())
    }

    /// Returns whether the next step freezes the graph.
    pub(crate) fn will_freeze(&self) -> bool {
        self.options.is_frozen && !self.links.is_frozen()
    }

    /// Freezes the graph at the current positions, if the options ask for it and it is not frozen.
    ///
    /// # Errors
    /// As [`Self::pairs_by_id`].
    pub(crate) fn freeze(&mut self, agents: &Agents<D>, ranges: Ranges<'_>) -> Result<()> {
        if self.will_freeze() {
            let pairs = self.pairs_by_id(agents, ranges)?;
            let others = memory::vector(RANGE, pairs.len())?;
            let lists = Lists::new(agents.num_agents(), &pairs, others);
            self.links.freeze(lists, agents);
        }
        Ok(())
    }

    /// Calls `visit` with the neighbor graph at the current positions and returns its result.
    pub(crate) fn with_pairs<T>(
        &self,
        agents: &Agents<D>,
        ranges: Ranges<'_>,
        visit: impl FnOnce(Pairs<'_, D>) -> T,
    ) -> T {
        let options = NeighborOptions {
            needs_pairs: true,
            ..self.current_options()
        };
        let tree = self.tree.with_boxes(agents);
        let links = self.current_links(&options, agents, &tree, ranges);
        visit(links.pairs(&options, agents, &tree))
    }

    /// Returns the number of weakly connected components at the current positions.
    pub(crate) fn num_components(&self, agents: &Agents<D>, ranges: Ranges<'_>) -> usize {
        self.components(agents, ranges).count()
    }

    /// Returns the weakly connected component of every agent at the current positions, in the order of ids.
    /// Components are labeled by the lowest id in them.
    pub(crate) fn component_labels(&self, agents: &Agents<D>, ranges: Ranges<'_>) -> Vec<u32> {
        self.components(agents, ranges).labels(agents)
    }

    fn components(&self, agents: &Agents<D>, ranges: Ranges<'_>) -> Components {
        self.with_pairs(agents, ranges, |pairs| Components::of(&pairs))
    }

    /// Returns the options and the tree of the agents, for searches under other ranges.
    pub(crate) fn search(&self, agents: &Agents<D>) -> (&NeighborOptions, Cow<'_, Tree<D>>) {
        (&self.options, self.tree.with_boxes(agents))
    }

    /// Returns the options of the graph at the current positions, which is frozen only after the first step.
    fn current_options(&self) -> NeighborOptions {
        NeighborOptions {
            is_frozen: self.links.is_frozen(),
            ..self.options
        }
    }

    /// Computes reaches and lists at the current positions. `tree` has their boxes.
    pub(crate) fn current_links(
        &self,
        options: &NeighborOptions,
        agents: &Agents<D>,
        tree: &Tree<D>,
        ranges: Ranges<'_>,
    ) -> Links {
        let mut links = if self.links.is_frozen() {
            self.links.clone()
        } else {
            Links::default()
        };
        links.update(options, agents, tree, ranges);
        links
    }
}
