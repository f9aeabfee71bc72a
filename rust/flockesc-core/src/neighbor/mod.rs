//! Who listens to whom. Everything that depends on the neighbor rule goes through [`Neighborhood`].

mod engine;
mod options;
mod ranges;
mod rules;
mod state;
#[cfg(test)]
mod tests;

use crate::agents::{Agents, GROUP};
use crate::base::exact::Scale;
use crate::parallel;
use engine::components::{Forest, connect, connect_pairs};
pub(crate) use engine::field_of_view::{Sight, Torus};
use engine::links::Links;
pub(crate) use engine::pairs::Pairs;
pub(crate) use engine::sums::Heard;
use engine::sums::{Scratch, listen, listen_to_pairs};
use engine::tree::Tree;
pub(crate) use options::NeighborOptions;
pub use ranges::Ranges;
pub use rules::NeighborRule;
pub(crate) use state::NeighborhoodState;

/// Cost of arranging per agent and halving, in tests of a pair of tiles (measured).
const ARRANGING: f64 = 0.4;

/// Who heard what: <v>_i and |N_i|, found by the rule.
#[derive(Debug, Clone)]
pub(crate) struct Neighborhood<const D: usize> {
    options: NeighborOptions,
    tree: Tree<D>,
    links: Links,
    heard: Vec<Heard<D>>,
    /// Unit in m/s of the sums heard.
    scale: Scale,
    scratch: Vec<Scratch>,
    /// Mean extent of a tile in m when the agents were arranged.
    tight: f64,
    /// Tests since then that another arrangement would have spared.
    excess: f64,
}

impl<const D: usize> Neighborhood<D> {
    /// What agents have heard before their first step: themselves alone.
    pub(crate) fn silent(options: NeighborOptions, agents: &Agents<D>) -> Self {
        let mut tree = Tree::new(agents.groups.len());
        tree.refresh(agents);
        Self {
            options,
            links: Links::default(),
            heard: tree.speakers.iter().map(Heard::alone).collect(),
            scale: tree.scale,
            scratch: vec![Scratch::default(); parallel::num_chunks(agents.groups.len())],
            tight: tree.mean_extent(),
            excess: 0.0,
            tree,
        }
    }

    /// Finds every agent's neighbors and sums their velocities (Eq. 11). May give the agents new places.
    pub(crate) fn listen(&mut self, agents: &mut Agents<D>, ranges: Ranges<'_>) {
        self.arrange_if_it_pays(agents, ranges);
        let (options, tree) = (&self.options, &self.tree);
        self.links
            .update(options, agents, tree, ranges, &mut self.scratch);
        let links = &self.links;
        parallel::for_each_chunk_with(
            &mut self.heard,
            &mut self.scratch,
            |first, heard, scratch| match links.reaches(options, ranges) {
                Some(reaches) => listen(agents, tree, reaches, first, heard, scratch),
                None => {
                    let pairs = links.pairs(options, agents, tree);
                    listen_to_pairs(pairs, first, heard, scratch);
                }
            },
        );
        self.scale = tree.scale;
    }

    /// Arranges the agents anew as soon as the tests that loose tiles have cost would have paid for it.
    fn arrange_if_it_pays(&mut self, agents: &mut Agents<D>, ranges: Ranges<'_>) {
        let reach = 2.0 * self.links.typical(&self.options, ranges);
        let loose = self.tree.mean_extent();
        let spared = 1.0 - ((self.tight + reach) / (loose + reach)).powi(D as i32);
        self.excess += spared * self.tests() as f64;
        let n = agents.len() as f64;
        if self.excess > ARRANGING * n * n.log2() {
            agents.arrange();
            self.tree.refresh(agents);
            self.tight = self.tree.mean_extent();
            self.excess = 0.0;
        }
    }

    /// Takes note of where the agents are now and how they move, after some may have left.
    pub(crate) fn follow(&mut self, agents: &Agents<D>) {
        let num_groups = agents.groups.len();
        if num_groups < self.heard.len() {
            self.heard.truncate(num_groups);
            self.scratch.truncate(parallel::num_chunks(num_groups));
            self.tree.shrink(num_groups);
        }
        self.tree.refresh(agents);
    }

    /// Takes what the agent in place `from` has heard along to its new place.
    pub(crate) fn relocate(&mut self, from: usize, to: usize) {
        let (source, lane) = (&self.heard[from / GROUP], from % GROUP);
        let (sum, count, norm) = (
            source.sum.map(|column| column[lane]),
            source.count[lane],
            source.norm[lane],
        );
        let (target, lane) = (&mut self.heard[to / GROUP], to % GROUP);
        for axis in 0..D {
            target.sum[axis][lane] = sum[axis];
        }
        (target.count[lane], target.norm[lane]) = (count, norm);
    }

    /// What the groups of agents heard in the last step.
    pub(crate) fn heard(&self) -> &[Heard<D>] {
        &self.heard
    }

    /// The same, for the step to be made of it.
    pub(crate) fn heard_mut(&mut self) -> &mut [Heard<D>] {
        &mut self.heard
    }

    /// Who is whose neighbor in the step that is being made; for options that [visit](NeighborOptions::visits).
    pub(crate) fn pairs<'a>(&'a self, agents: &'a Agents<D>) -> Pairs<'a, D> {
        self.links.pairs(&self.options, agents, &self.tree)
    }

    /// The unit in m/s of the sums in [`Neighborhood::heard`].
    pub(crate) fn scale(&self) -> Scale {
        self.scale
    }

    /// Lowest and highest coordinate of any agent where it is now, in m.
    pub(crate) fn bounds(&self) -> ([f64; D], [f64; D]) {
        let bounds = self.tree.root().bounds();
        (bounds.low, bounds.high)
    }

    /// Sum of v over all agents as they move now, in m/s.
    pub(crate) fn total_velocity(&self) -> [f64; D] {
        let sums = self.tree.root().sum;
        sums.map(|sum| self.tree.scale.value(sum.iter().sum()))
    }

    /// Largest component of any velocity now, in m/s.
    pub(crate) fn largest_speed(&self) -> f64 {
        self.tree.largest_speed
    }

    /// Place of the agent whose nearest other agent is farthest where the agents are now; the lowest name among equals.
    pub(crate) fn most_isolated(&self, agents: &Agents<D>) -> usize {
        engine::isolation::most_isolated(agents, &self.tree)
    }

    /// Pairs of an agent and a neighbor other than itself where the agents are now, by name.
    pub(crate) fn pairs_by_name(&self, agents: &Agents<D>, ranges: Ranges<'_>) -> Vec<(u32, u32)> {
        self.with_pairs(agents, ranges, |pairs| pairs.by_name())
    }

    /// What `look` finds among the pairs of agents and neighbors where the agents are now.
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

    /// Number of weakly connected components of the neighbor graph where the agents are now.
    pub(crate) fn num_components(&self, agents: &Agents<D>, ranges: Ranges<'_>) -> usize {
        self.components(agents, ranges).count()
    }

    /// The component of every agent in that graph, named by the lowest name in it; in the order of names.
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

    /// Who is whose neighbor where the agents are now.
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
        let mut scratch = vec![Scratch::default(); self.scratch.len()];
        links.update(options, agents, &self.tree, ranges, &mut scratch);
        links
    }

    /// Pairs of tiles that the last step tested agent by agent.
    fn tests(&self) -> usize {
        self.scratch.iter().map(|scratch| scratch.tests).sum()
    }
}
