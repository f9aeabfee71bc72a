//! Neighbors and sums over them, under any rule: the one interface to the neighbor graph.

mod state;

use crate::agents::{Agents, GROUP};
use crate::base::exact::Scale;
use crate::neighbor::engine::components::{Forest, connect, connect_pairs};
use crate::neighbor::engine::isolation;
use crate::neighbor::engine::links::Links;
use crate::neighbor::engine::pairs::Pairs;
use crate::neighbor::engine::sums::{NeighborSums, Scratch, sum_neighbors, sum_pairs};
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::options::NeighborOptions;
use crate::neighbor::ranges::Ranges;
use crate::parallel;
pub(crate) use state::NeighborhoodState;

/// Cost of a re-sort per agent and halving, in tests of a pair of tiles (measured).
const SORTING: f64 = 0.4;

/// The neighbor graph of a flock, with the sums over the neighbors of every agent.
#[derive(Debug, Clone)]
pub(crate) struct Neighborhood<const D: usize> {
    options: NeighborOptions,
    tree: Tree<D>,
    links: Links,
    sums: Vec<NeighborSums<D>>,
    /// Unit of the sums in m/s.
    scale: Scale,
    scratch: Vec<Scratch>,
    /// Mean extent of a tile in m after the last re-sort.
    tight: f64,
    /// Estimated number of tests since then that a re-sort would have saved.
    excess: f64,
}

impl<const D: usize> Neighborhood<D> {
    /// The neighborhood at t = 0, where every agent's only neighbor is itself.
    pub(crate) fn new(options: NeighborOptions, agents: &Agents<D>) -> Self {
        let mut tree = Tree::new(agents.groups.len());
        tree.refresh(agents);
        Self {
            options,
            links: Links::default(),
            sums: tree.agents.iter().map(NeighborSums::alone).collect(),
            scale: tree.scale,
            scratch: vec![Scratch::default(); parallel::num_chunks(agents.groups.len())],
            tight: tree.mean_extent(),
            excess: 0.0,
            tree,
        }
    }

    /// Finds every agent's neighbors and sums their velocities (Eq. 11). May re-sort the agents.
    pub(crate) fn sum_neighbors(&mut self, agents: &mut Agents<D>, ranges: Ranges<'_>) {
        self.sort_if_due(agents, ranges);
        let (options, tree) = (&self.options, &self.tree);
        self.links.update(options, agents, tree, ranges);
        let links = &self.links;
        parallel::for_each_chunk_with(&mut self.sums, &mut self.scratch, |first, sums, scratch| {
            match links.reaches(options, ranges) {
                Some(reaches) => sum_neighbors(agents, tree, reaches, first, sums, scratch),
                None => sum_pairs(links.pairs(options, agents, tree), first, sums, scratch),
            }
        });
        self.scale = tree.scale;
    }

    /// Tiles grow as agents mix. Each step estimates the extra tests; when they exceed the cost of a re-sort, the agents
    /// are re-sorted. Results do not depend on when.
    fn sort_if_due(&mut self, agents: &mut Agents<D>, ranges: Ranges<'_>) {
        let reach = 2.0 * self.links.typical_reach(&self.options, ranges);
        let loose = self.tree.mean_extent();
        let saved = 1.0 - ((self.tight + reach) / (loose + reach)).powi(D as i32);
        self.excess += saved * self.num_tile_pairs() as f64;
        let n = agents.len() as f64;
        if self.excess > SORTING * n * n.log2() {
            agents.arrange();
            self.tree.refresh(agents);
            self.tight = self.tree.mean_extent();
            self.excess = 0.0;
        }
    }

    /// Updates the tree to the agents' positions and velocities, after some may have been caught.
    pub(crate) fn refresh(&mut self, agents: &Agents<D>) {
        let num_groups = agents.groups.len();
        if num_groups < self.sums.len() {
            self.sums.truncate(num_groups);
            self.scratch.truncate(parallel::num_chunks(num_groups));
            self.tree.shrink(num_groups);
        }
        self.tree.refresh(agents);
    }

    /// Moves the sums of the agent in place `from` to its new place.
    pub(crate) fn relocate(&mut self, from: usize, to: usize) {
        let agent = self.sums[from / GROUP].of(from % GROUP);
        self.sums[to / GROUP].set(to % GROUP, &agent);
    }

    /// The sums of the last step, group by group.
    pub(crate) fn sums(&self) -> &[NeighborSums<D>] {
        &self.sums
    }

    /// The same, for the step that uses them.
    pub(crate) fn sums_mut(&mut self) -> &mut [NeighborSums<D>] {
        &mut self.sums
    }

    /// The neighbor graph of the current step; for options that [visit](NeighborOptions::visits) pairs.
    pub(crate) fn pairs<'a>(&'a self, agents: &'a Agents<D>) -> Pairs<'a, D> {
        self.links.pairs(&self.options, agents, &self.tree)
    }

    /// The unit of the sums in m/s.
    pub(crate) fn scale(&self) -> Scale {
        self.scale
    }

    /// Lowest and highest coordinates of the agents in m.
    pub(crate) fn bounds(&self) -> ([f64; D], [f64; D]) {
        let bounds = self.tree.root().bounds();
        (bounds.low, bounds.high)
    }

    /// Sum of v over all agents in m/s.
    pub(crate) fn total_velocity(&self) -> [f64; D] {
        let sums = self.tree.root().sum;
        sums.map(|sum| self.tree.scale.value(sum.iter().sum()))
    }

    /// Largest component of any velocity in m/s.
    pub(crate) fn largest_speed(&self) -> f64 {
        self.tree.largest_speed
    }

    /// Place of the agent whose nearest other agent is farthest; the lowest id among equals.
    pub(crate) fn most_isolated(&self, agents: &Agents<D>) -> usize {
        isolation::most_isolated(agents, &self.tree)
    }

    /// Pairs of the ids of an agent and a neighbor other than itself, at the current positions.
    pub(crate) fn pairs_by_id(&self, agents: &Agents<D>, ranges: Ranges<'_>) -> Vec<(u32, u32)> {
        self.with_pairs(agents, ranges, |pairs| pairs.by_id())
    }

    /// Calls `look` with the neighbor graph at the current positions.
    pub(crate) fn with_pairs<T>(
        &self,
        agents: &Agents<D>,
        ranges: Ranges<'_>,
        look: impl FnOnce(Pairs<'_, D>) -> T,
    ) -> T {
        let options = NeighborOptions {
            visits: true,
            ..self.options
        };
        let links = self.links_now(&options, agents, ranges);
        look(links.pairs(&options, agents, &self.tree))
    }

    /// Number of weakly connected components of the neighbor graph at the current positions.
    pub(crate) fn num_components(&self, agents: &Agents<D>, ranges: Ranges<'_>) -> usize {
        self.components(agents, ranges).count()
    }

    /// The component of every agent in that graph, labeled by the lowest id in it; in the order of ids.
    pub(crate) fn component_labels(&self, agents: &Agents<D>, ranges: Ranges<'_>) -> Vec<u32> {
        self.components(agents, ranges).labels(agents)
    }

    fn components(&self, agents: &Agents<D>, ranges: Ranges<'_>) -> Forest {
        let links = self.links_now(&self.options, agents, ranges);
        match links.reaches(&self.options, ranges) {
            Some(reaches) => connect(agents, &self.tree, reaches),
            None => connect_pairs(&links.pairs(&self.options, agents, &self.tree)),
        }
    }

    /// Reaches and lists at the current positions.
    fn links_now(
        &self,
        options: &NeighborOptions,
        agents: &Agents<D>,
        ranges: Ranges<'_>,
    ) -> Links {
        let mut links = if self.links.is_frozen() {
            self.links.clone()
        } else {
            Links::default()
        };
        links.update(options, agents, &self.tree, ranges);
        links
    }

    /// Number of pairs of tiles that the last step tested agent by agent.
    fn num_tile_pairs(&self) -> usize {
        self.scratch
            .iter()
            .map(|scratch| scratch.num_tile_pairs)
            .sum()
    }
}
