//! `Tree`: a bounding volume hierarchy of the agents, with sums of velocities and numbers of agents in every
//! node.

use std::borrow::Cow;

use multiversion::multiversion;

use crate::agents::{Agents, FANOUT, GROUP, Group, reduce};
use crate::base::exact::Scale;
use crate::base::vector::larger;
use crate::neighbor::engine::nodes::{Bounds, Siblings, add_up_leaves, box_leaves};
use crate::neighbor::ranges::SAMPLE;
use crate::parallel;

/// The tree of all agents.
#[derive(Debug, Clone)]
pub(crate) struct Tree<const D: usize> {
    /// `levels[0][g]` has the leaves of group g, `levels[1][k]` has the groups 8 k to 8 k + 7, and so on. The
    /// last level has one block.
    pub(crate) levels: Vec<Vec<Siblings<D>>>,
    /// Fixed-point scale of the velocities, in m/s.
    pub(crate) scale: Scale,
    /// Largest magnitude of a velocity component, in m/s.
    pub(crate) largest_speed: f64,
    /// Whether the boxes are those of the present positions.
    has_boxes: bool,
}

impl<const D: usize> Tree<D> {
    /// Creates a tree for `num_groups` groups. It is empty before the first [`Tree::refresh`].
    pub(crate) fn new(num_groups: usize) -> Self {
        let mut blocks = num_groups;
        let mut levels = vec![vec![Siblings::EMPTY; blocks]];
        while blocks > 1 {
            blocks = blocks.div_ceil(FANOUT);
            levels.push(vec![Siblings::EMPTY; blocks]);
        }
        Self {
            levels,
            scale: Scale::for_registers(0.0, 1),
            largest_speed: 0.0,
            has_boxes: false,
        }
    }

    /// Recomputes the sums, and the velocities in fixed point, after a step. The boxes are then out of date.
    pub(crate) fn refresh(&mut self, agents: &mut Agents<D>) {
        // NOTE: The scale follows from the largest speed, so that sums in fixed point cannot overflow.
        let largest = parallel::map_reduce(&agents.groups, largest_speed, larger);
        self.largest_speed = largest.unwrap_or(0.0);
        self.scale = Scale::for_registers(self.largest_speed, agents.len());
        let (scale, num_agents) = (self.scale, agents.len());
        let (leaves, nodes) = self.levels.split_at_mut(1);
        parallel::for_each_pair(
            &mut agents.groups,
            &mut leaves[0],
            |first, groups, leaves| {
                add_up_leaves(groups, scale, num_agents - first * GROUP, leaves);
            },
        );
        let mut below = &leaves[0];
        for blocks in nodes {
            add_up_parents(below, blocks);
            below = blocks;
        }
        // PERF: Sums change with every step, boxes only matter to a search.
        self.has_boxes = false;
    }

    /// Computes the boxes if they are out of date. Only searches need them.
    pub(crate) fn build_boxes(&mut self, agents: &Agents<D>) {
        if self.has_boxes {
            return;
        }
        let (leaves, nodes) = self.levels.split_at_mut(1);
        parallel::for_each_chunk(&mut leaves[0], |first, leaves| {
            box_leaves(&agents.groups[first..], leaves);
        });
        let mut below = &leaves[0];
        for blocks in nodes {
            box_parents(below, blocks);
            below = blocks;
        }
        self.has_boxes = true;
    }

    /// Returns the tree with the boxes of the present positions.
    pub(crate) fn with_boxes(&self, agents: &Agents<D>) -> Cow<'_, Self> {
        let mut tree = Cow::Borrowed(self);
        if !self.has_boxes {
            tree.to_mut().build_boxes(agents);
        }
        tree
    }

    /// Returns the block of the last level.
    pub(crate) fn root(&self) -> &Siblings<D> {
        &self.levels[self.levels.len() - 1][0]
    }

    /// Lists the leaves for which `is_near` is true of their box and of the boxes of all nodes above.
    pub(crate) fn list_leaves(&self, leaves: &mut Vec<u32>, is_near: impl Fn(&Bounds<D>) -> bool) {
        leaves.clear();
        self.descend(self.levels.len() - 1, 0, leaves, &is_near);
    }

    fn descend(
        &self,
        level: usize,
        block: usize,
        leaves: &mut Vec<u32>,
        is_near: &impl Fn(&Bounds<D>) -> bool,
    ) {
        let nodes = &self.levels[level][block];
        for child in (0..FANOUT).filter(|&child| nodes.count[child] > 0) {
            if is_near(&nodes.bounds_of(child)) {
                let node = block * FANOUT + child;
                match level.checked_sub(1) {
                    Some(below) => self.descend(below, node, leaves, is_near),
                    None => leaves.push(node as u32),
                }
            }
        }
    }

    /// Returns the mean extent of a leaf along an axis in m, over a sample of the groups.
    pub(crate) fn mean_extent(&self) -> f64 {
        let (mut total, mut count) = (0.0, 0.0);
        for leaves in self.levels[0]
            .iter()
            .step_by(self.levels[0].len().div_ceil(SAMPLE))
        {
            for leaf in (0..FANOUT).filter(|&leaf| leaves.count[leaf] > 0) {
                let Bounds { low, high } = leaves.bounds_of(leaf);
                total += (0..D).map(|axis| high[axis] - low[axis]).sum::<f64>();
                count += D as f64;
            }
        }
        total / count
    }
}

/// Returns the largest magnitude of a velocity component, in m/s.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn largest_speed<const D: usize>(groups: &[Group<D>]) -> f64 {
    let mut largest = [0.0; GROUP];
    for group in groups {
        for column in &group.velocity {
            for lane in 0..GROUP {
                largest[lane] = larger(largest[lane], column[lane].abs());
            }
        }
    }
    reduce(largest, larger)
}

/// Computes the sums of the nodes of the level above `children`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn add_up_parents<const D: usize>(children: &[Siblings<D>], parents: &mut [Siblings<D>]) {
    for (children, block) in children.chunks(FANOUT).zip(parents) {
        for (node, child) in children.iter().enumerate() {
            for axis in 0..D {
                block.sum[axis][node] = child.sum[axis].iter().sum();
            }
            block.count[node] = child.count.iter().sum();
        }
    }
}

/// Computes the boxes of the nodes of the level above `children`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn box_parents<const D: usize>(children: &[Siblings<D>], parents: &mut [Siblings<D>]) {
    for (children, block) in children.chunks(FANOUT).zip(parents) {
        for (node, child) in children.iter().enumerate() {
            let bounds = child.bounds();
            for axis in 0..D {
                block.low[axis][node] = bounds.low[axis];
                block.high[axis][node] = bounds.high[axis];
            }
        }
    }
}
