//! `Candidates`: for every leaf the agents that may be neighbors of its agents, and the agents that are
//! neighbors of all of them.

use std::ops::Range;

use pulp::Simd;

use crate::agents::{Agents, Column, FANOUT, LEAF};
use crate::neighbor::engine::field_of_view::Torus;
use crate::neighbor::engine::nodes::Bounds;
use crate::neighbor::engine::places::Places;
use crate::neighbor::engine::reach::{Reach, bits};
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::ranges::Reaches;

/// The search for candidates.
#[derive(Clone, Copy)]
pub(super) struct Search<'a, const D: usize> {
    pub(super) agents: &'a Agents<D>,
    pub(super) tree: &'a Tree<D>,
    pub(super) torus: Torus,
    pub(super) reaches: Reaches<'a>,
    /// Distance in m by which two agents may approach or leave each other while the candidates are in use.
    pub(super) margin: f64,
    /// Whether each agent within reach is needed, and not only their sums.
    pub(super) is_each: bool,
}

/// The children of one block of the tree, one bit per child.
#[derive(Debug, Clone, Copy)]
pub(super) struct Children {
    pub(super) level: usize,
    pub(super) block: usize,
    pub(super) bits: u8,
}

/// The candidates of some groups.
#[derive(Debug, Clone, Default)]
pub(crate) struct Candidates {
    groups: Vec<Nodes>,
    leaves: Vec<Leaf>,
    /// Nodes entirely within reach.
    nodes: Vec<Children>,
    /// Agents within reach of a whole leaf.
    enclosed: Places,
    /// Agents partly within reach of a leaf.
    across: Places,
    /// Stack of the nodes to visit, as pairs (level, block).
    stack: Vec<(usize, usize)>,
    /// Groups partly within reach of a group.
    near_groups: Vec<usize>,
    /// Leaves partly within reach of a leaf.
    near_leaves: Places,
}

/// The nodes entirely within reach of a group or a leaf, and their number of agents.
#[derive(Debug, Clone)]
struct Nodes {
    listed: Range<usize>,
    count: i64,
}

/// The candidates of one leaf, as parts of the lists of all.
#[derive(Debug, Clone)]
struct Leaf {
    nodes: Nodes,
    enclosed: Range<usize>,
    across: Range<usize>,
}

/// The candidates of one leaf.
pub(super) struct LeafCandidates<'a> {
    /// Nodes entirely within reach of the leaf's group.
    pub(super) shared_nodes: &'a [Children],
    /// Leaves entirely within reach.
    pub(super) nodes: &'a [Children],
    /// Places of agents within reach of the whole leaf.
    pub(super) enclosed: &'a [u32],
    /// Places of agents partly within reach.
    pub(super) across: &'a [u32],
    /// Number of agents that are neighbors of all agents of the leaf.
    pub(super) count: i64,
}

impl Candidates {
    pub(super) fn clear(&mut self) {
        self.groups.clear();
        self.leaves.clear();
        self.nodes.clear();
        self.enclosed.len = 0;
        self.across.len = 0;
    }

    /// Returns the memory in bytes.
    pub(super) fn bytes(&self) -> usize {
        self.groups.capacity() * size_of::<Nodes>()
            + self.leaves.capacity() * size_of::<Leaf>()
            + self.nodes.capacity() * size_of::<Children>()
            + self.stack.capacity() * size_of::<(usize, usize)>()
            + self.near_groups.capacity() * size_of::<usize>()
            + self.enclosed.bytes()
            + self.across.bytes()
            + self.near_leaves.bytes()
    }

    /// Returns the candidates of one leaf of the group that was added as number `group`.
    #[inline(always)]
    pub(super) fn of(&self, group: usize, leaf: usize) -> LeafCandidates<'_> {
        let shared = &self.groups[group];
        let own = &self.leaves[group * FANOUT + leaf];
        LeafCandidates {
            shared_nodes: &self.nodes[shared.listed.clone()],
            nodes: &self.nodes[own.nodes.listed.clone()],
            enclosed: &self.enclosed.places[own.enclosed.clone()],
            across: &self.across.places[own.across.clone()],
            count: shared.count + own.nodes.count + own.enclosed.len() as i64,
        }
    }

    /// Adds the candidates of all leaves of `group`, whose agents have the squared reaches `squared` in m^2.
    #[inline(always)]
    pub(super) fn find<S: Simd, const D: usize>(
        &mut self,
        simd: S,
        search: Search<'_, D>,
        group: usize,
        squared: &Column<f64>,
    ) {
        // PERF: What a whole group does not reach is skipped for its eight leaves, and what all of it reaches is listed
        // once. Each leaf then searches only the groups in between.
        let Search { agents, tree, .. } = search;
        let ids = agents.ids_of(group);
        let leaves = &tree.levels[0][group];
        let reach = search.reach(leaves.bounds(), &squared[..ids.len()]);
        let nodes = self.find_groups(simd, tree, &reach);
        self.groups.push(nodes);
        for leaf in 0..ids.len().div_ceil(LEAF) {
            let lanes = leaf * LEAF..ids.len().min((leaf + 1) * LEAF);
            let reach = search.reach(leaves.bounds_of(leaf), &squared[lanes]);
            let nodes = self.find_leaves(simd, tree, &reach);
            let (enclosed, across) = (self.enclosed.len, self.across.len);
            self.find_agents(simd, agents, &reach);
            self.leaves.push(Leaf {
                nodes,
                enclosed: enclosed..self.enclosed.len,
                across: across..self.across.len,
            });
        }
    }

    /// Finds the groups partly within reach of a group, and returns the nodes entirely within reach.
    #[inline(always)]
    fn find_groups<S: Simd, const D: usize>(
        &mut self,
        simd: S,
        tree: &Tree<D>,
        reach: &Reach<D>,
    ) -> Nodes {
        let (first, mut count) = (self.nodes.len(), 0);
        self.near_groups.clear();
        self.stack.push((tree.levels.len() - 1, 0));
        while let Some((level, block)) = self.stack.pop() {
            if level == 0 {
                self.near_groups.push(block);
                continue;
            }
            let nodes = &mut self.nodes;
            let mut across = add_enclosed(simd, tree, reach, (level, block), nodes, &mut count);
            while across != 0 {
                let child = across.trailing_zeros() as usize;
                across &= across - 1;
                self.stack.push((level - 1, block * FANOUT + child));
            }
        }
        Nodes {
            listed: first..self.nodes.len(),
            count,
        }
    }

    /// Finds the leaves partly within reach of a leaf, and returns the leaves entirely within reach.
    #[inline(always)]
    fn find_leaves<S: Simd, const D: usize>(
        &mut self,
        simd: S,
        tree: &Tree<D>,
        reach: &Reach<D>,
    ) -> Nodes {
        let (first, mut count) = (self.nodes.len(), 0);
        self.near_leaves.len = 0;
        let mut near_leaves = self.near_leaves.writer(self.near_groups.len());
        for &block in &self.near_groups {
            let nodes = &mut self.nodes;
            let across = add_enclosed(simd, tree, reach, (0, block), nodes, &mut count);
            near_leaves.add(block * FANOUT, across);
        }
        self.near_leaves.len = near_leaves.len;
        Nodes {
            listed: first..self.nodes.len(),
            count,
        }
    }

    /// Adds the agents partly within reach of a leaf, and the agents within reach of the whole leaf, among the
    /// leaves partly within reach.
    #[inline(always)]
    fn find_agents<S: Simd, const D: usize>(
        &mut self,
        simd: S,
        agents: &Agents<D>,
        reach: &Reach<D>,
    ) {
        let num_leaves = self.near_leaves.len;
        let mut enclosed = self.enclosed.writer(num_leaves);
        let mut across = self.across.writer(num_leaves);
        for &leaf in &self.near_leaves.places[..num_leaves] {
            let leaf = leaf as usize;
            let columns = &agents.groups[leaf / FANOUT].position;
            let (mut near, mut inside) = (0, 0);
            for register in 0..LEAF / S::F64_LANES {
                let first = leaf % FANOUT * LEAF + register * S::F64_LANES;
                let mut position = [simd.splat_f64s(0.0); D];
                for axis in 0..D {
                    let column = &columns[axis][first..first + S::F64_LANES];
                    position[axis] = S::as_simd_f64s(column).0[0];
                }
                let shift = register * S::F64_LANES;
                near |= bits(simd, reach.meets(simd, position, position)) << shift;
                if reach.may_enclose {
                    inside |= bits(simd, reach.encloses(simd, position, position)) << shift;
                }
            }
            across.add(leaf * LEAF, near & !inside);
            if reach.may_enclose {
                enclosed.add(leaf * LEAF, inside);
            }
        }
        self.enclosed.len = enclosed.len;
        self.across.len = across.len;
    }
}

/// Adds the children of a block, given as (level, block), that are entirely within reach, and their agents to
/// `count`. Returns one bit per child partly within reach.
#[inline(always)]
fn add_enclosed<S: Simd, const D: usize>(
    simd: S,
    tree: &Tree<D>,
    reach: &Reach<D>,
    (level, block): (usize, usize),
    listed: &mut Vec<Children>,
    count: &mut i64,
) -> u8 {
    let nodes = &tree.levels[level][block];
    let (bits, across) = reach.classify(simd, nodes);
    if bits != 0 {
        listed.push(Children { level, block, bits });
        *count += nodes.count_of(bits);
    }
    across
}

impl<const D: usize> Search<'_, D> {
    /// Returns the reach of agents with the bounding box `bounds` and the squared reaches `squared` in m^2.
    #[inline(always)]
    fn reach(&self, bounds: Bounds<D>, squared: &[f64]) -> Reach<D> {
        let mut reach = Reach::new(self.torus, bounds, self.reaches, squared);
        if self.margin > 0.0 {
            reach.widen(self.margin);
        }
        // With a blind sector an agent within reach may be out of view, so that nothing is added as a whole.
        reach.may_enclose &= !self.is_each;
        reach
    }
}
