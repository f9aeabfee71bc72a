//! Who listens to whom. Everything that depends on the neighbor rule goes through [`Neighborhood`].

mod components;
mod isolation;
mod listen;
mod reach;
#[cfg(test)]
mod tests;
mod tree;

use serde::Deserialize;

use crate::agents::{Agents, Column, GROUP};
use crate::exact::Scale;
use crate::threads;
pub(crate) use components::component_labels;
use components::num_components;
pub(crate) use listen::Heard;
use listen::{Scratch, listen};
use tree::Tree;

/// The rule that makes agents neighbors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum NeighborRule {
    /// All agents within the interaction range, boundary and self included.
    Metric {},
}

/// Interaction ranges rho in m: one for the flock, or one per agent.
#[derive(Debug, Clone, Copy)]
pub enum Ranges<'a> {
    /// The same range for every agent.
    Shared(f64),
    /// Entry i is the range of agent i; the neighbor graph is then directed.
    PerAgent(&'a [f64]),
}

impl Ranges<'_> {
    /// Squares of the ranges of the agents named, in m^2.
    #[inline(always)]
    fn square(self, names: &[u32], out: &mut Column<f64>) {
        // Finite, so that nobody hears the boxes at infinity that stand for no agent.
        let square = |range: f64| (range * range).min(f64::MAX);
        match self {
            Self::Shared(range) => out.fill(square(range)),
            Self::PerAgent(ranges) => {
                for (squared, &name) in out.iter_mut().zip(names) {
                    *squared = square(ranges[name as usize]);
                }
            }
        }
    }

    /// Mean over a sample of the agents, in m.
    fn typical(self) -> f64 {
        match self {
            Self::Shared(range) => range,
            Self::PerAgent(ranges) => {
                let sample = ranges.iter().step_by(ranges.len().div_ceil(SAMPLE));
                let count = sample.len() as f64;
                sample.sum::<f64>() / count
            }
        }
    }
}

/// Agents or groups looked at to tell whether it pays to arrange all of them.
const SAMPLE: usize = 64;

/// Cost of arranging per agent and halving, in tests of a pair of tiles (measured).
const ARRANGING: f64 = 0.4;

/// Who heard what: <v>_i and |N_i|, found by the rule.
#[derive(Debug, Clone)]
pub(crate) struct Neighborhood<const D: usize> {
    rule: NeighborRule,
    tree: Tree<D>,
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
    pub(crate) fn silent(rule: NeighborRule, agents: &Agents<D>) -> Self {
        let mut tree = Tree::new(agents.groups.len());
        tree.refresh(agents);
        Self {
            rule,
            heard: tree.speakers.iter().map(Heard::alone).collect(),
            scale: tree.scale,
            scratch: vec![Scratch::default(); threads::num_chunks(agents.groups.len())],
            tight: tree.mean_extent(),
            excess: 0.0,
            tree,
        }
    }

    /// Finds every agent's neighbors and sums their velocities (Eq. 11). May give the agents new places.
    pub(crate) fn listen(&mut self, agents: &mut Agents<D>, ranges: Ranges<'_>) {
        match self.rule {
            NeighborRule::Metric {} => {
                self.arrange_if_it_pays(agents, ranges);
                let tree = &self.tree;
                threads::for_each_chunk_with(
                    &mut self.heard,
                    &mut self.scratch,
                    |first, heard, scratch| listen(agents, tree, ranges, first, heard, scratch),
                );
                self.scale = tree.scale;
            }
        }
    }

    /// Arranges the agents anew as soon as the tests that loose tiles have cost would have paid for it.
    fn arrange_if_it_pays(&mut self, agents: &mut Agents<D>, ranges: Ranges<'_>) {
        let reach = 2.0 * ranges.typical();
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
            self.scratch.truncate(threads::num_chunks(num_groups));
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
        isolation::most_isolated(agents, &self.tree)
    }

    /// Number of weakly connected components of the neighbor graph.
    pub(crate) fn num_components(&self, agents: &Agents<D>, ranges: Ranges<'_>) -> usize {
        match self.rule {
            NeighborRule::Metric {} => num_components(agents, &self.tree, ranges),
        }
    }

    /// Pairs of tiles that the last step tested agent by agent.
    fn tests(&self) -> usize {
        self.scratch.iter().map(|scratch| scratch.tests).sum()
    }
}
