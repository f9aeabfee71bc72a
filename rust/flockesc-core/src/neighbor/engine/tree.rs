//! `Tree`: a bounding volume hierarchy of the agents, with sums of velocities and numbers of agents in every
//! node.

use multiversion::multiversion;
use pulp::Simd;

use crate::agents::{Agents, FANOUT, GROUP, Group, reduce};
use crate::base::exact::Scale;
use crate::base::vector::{larger, smaller};
use crate::neighbor::engine::tiles::build_tiles;
use crate::neighbor::ranges::SAMPLE;
use crate::parallel;

/// An agent with its velocity in fixed point.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(in crate::neighbor) struct FixedPointAgent<const D: usize> {
    /// r in m.
    pub(in crate::neighbor) position: [f64; D],
    /// v in fixed point, in units of the tree's scale.
    pub(in crate::neighbor) velocity: [i64; D],
}

impl<const D: usize> FixedPointAgent<D> {
    const EMPTY: Self = Self {
        position: [f64::NAN; D],
        velocity: [0; D],
    };
}

/// The agents of one group, row by row.
pub(in crate::neighbor) type FixedPointAgents<const D: usize> = [FixedPointAgent<D>; GROUP];

/// A block of eight sibling nodes: their bounding boxes, sums of velocities and numbers of agents.
///
/// The box of a node without agents extends from infinity to minus infinity.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(in crate::neighbor) struct Siblings<const D: usize> {
    pub(in crate::neighbor) low: [[f64; FANOUT]; D],
    pub(in crate::neighbor) high: [[f64; FANOUT]; D],
    pub(in crate::neighbor) sum: [[i64; FANOUT]; D],
    pub(in crate::neighbor) count: [i64; FANOUT],
}

/// A bounding box of some agents.
#[derive(Debug, Clone, Copy)]
pub(in crate::neighbor) struct Bounds<const D: usize> {
    pub(in crate::neighbor) low: [f64; D],
    pub(in crate::neighbor) high: [f64; D],
}

impl<const D: usize> Siblings<D> {
    pub(in crate::neighbor) const EMPTY: Self = Self {
        low: [[f64::INFINITY; FANOUT]; D],
        high: [[f64::NEG_INFINITY; FANOUT]; D],
        sum: [[0; FANOUT]; D],
        count: [0; FANOUT],
    };

    /// Returns the box of one node.
    #[inline(always)]
    pub(in crate::neighbor) fn bounds_of(&self, child: usize) -> Bounds<D> {
        Bounds {
            low: std::array::from_fn(|axis| self.low[axis][child]),
            high: std::array::from_fn(|axis| self.high[axis][child]),
        }
    }

    /// Loads the corners of one register of boxes.
    #[inline(always)]
    pub(in crate::neighbor) fn corners<S: Simd>(
        &self,
        simd: S,
        register: usize,
    ) -> ([S::f64s; D], [S::f64s; D]) {
        let mut corners = ([simd.splat_f64s(0.0); D], [simd.splat_f64s(0.0); D]);
        for axis in 0..D {
            corners.0[axis] = S::as_simd_f64s(&self.low[axis]).0[register];
            corners.1[axis] = S::as_simd_f64s(&self.high[axis]).0[register];
        }
        corners
    }

    /// Returns the box around all eight nodes.
    #[inline(always)]
    pub(in crate::neighbor) fn bounds(&self) -> Bounds<D> {
        Bounds {
            low: std::array::from_fn(|axis| {
                self.low[axis].iter().copied().fold(f64::INFINITY, smaller)
            }),
            high: std::array::from_fn(|axis| {
                self.high[axis]
                    .iter()
                    .copied()
                    .fold(f64::NEG_INFINITY, larger)
            }),
        }
    }
}

/// The tree of all agents.
#[derive(Debug, Clone)]
pub(in crate::neighbor) struct Tree<const D: usize> {
    /// `levels[0][g]` has the tiles of group g, `levels[1][k]` has the groups 8 k to 8 k + 7, and so on. The
    /// last level has one block.
    pub(in crate::neighbor) levels: Vec<Vec<Siblings<D>>>,
    pub(in crate::neighbor) agents: Vec<FixedPointAgents<D>>,
    /// Fixed-point scale of the velocities, in m/s.
    pub(in crate::neighbor) scale: Scale,
    /// Largest magnitude of a velocity component, in m/s.
    pub(in crate::neighbor) largest_speed: f64,
}

impl<const D: usize> Tree<D> {
    /// Creates a tree for `num_groups` groups. It is empty before the first [`Tree::refresh`].
    pub(in crate::neighbor) fn new(num_groups: usize) -> Self {
        let mut blocks = num_groups;
        let mut levels = vec![vec![Siblings::EMPTY; blocks]];
        while blocks > 1 {
            blocks = blocks.div_ceil(FANOUT);
            levels.push(vec![Siblings::EMPTY; blocks]);
        }
        Self {
            levels,
            agents: vec![[FixedPointAgent::EMPTY; GROUP]; num_groups],
            scale: Scale::for_registers(0.0, 1),
            largest_speed: 0.0,
        }
    }

    /// Shrinks the tree to `num_groups` groups. A [`Tree::refresh`] must follow.
    pub(in crate::neighbor) fn shrink(&mut self, num_groups: usize) {
        self.agents.truncate(num_groups);
        let mut blocks = num_groups;
        self.levels[0].truncate(blocks);
        let mut height = 1;
        while blocks > 1 {
            blocks = blocks.div_ceil(FANOUT);
            self.levels[height].truncate(blocks);
            height += 1;
        }
        self.levels.truncate(height);
    }

    /// Recomputes boxes and sums from the agents' positions and velocities.
    pub(in crate::neighbor) fn refresh(&mut self, agents: &Agents<D>) {
        let largest = parallel::map_reduce(&agents.groups, largest_speed, larger);
        self.largest_speed = largest.unwrap_or(0.0);
        self.scale = Scale::for_registers(self.largest_speed, agents.len());
        let scale = self.scale;
        let (tiles, nodes) = self.levels.split_at_mut(1);
        parallel::for_each_chunk(&mut self.agents, &mut tiles[0], |first, rows, tiles| {
            let groups = &agents.groups[first..first + tiles.len()];
            build_tiles(groups, scale, rows, tiles);
        });
        let mut below = &tiles[0];
        for blocks in nodes {
            for (children, block) in below.chunks(FANOUT).zip(blocks.iter_mut()) {
                *block = parents_of(children);
            }
            below = blocks;
        }
    }

    /// Returns the block of the last level.
    pub(in crate::neighbor) fn root(&self) -> &Siblings<D> {
        &self.levels[self.levels.len() - 1][0]
    }

    /// Lists the tiles for which `is_near` is true of their box and of the boxes of all nodes above.
    pub(in crate::neighbor) fn list_tiles(
        &self,
        tiles: &mut Vec<u32>,
        is_near: impl Fn(&Bounds<D>) -> bool,
    ) {
        tiles.clear();
        self.descend(self.levels.len() - 1, 0, tiles, &is_near);
    }

    fn descend(
        &self,
        level: usize,
        block: usize,
        tiles: &mut Vec<u32>,
        is_near: &impl Fn(&Bounds<D>) -> bool,
    ) {
        let nodes = &self.levels[level][block];
        for child in (0..FANOUT).filter(|&child| nodes.count[child] > 0) {
            if is_near(&nodes.bounds_of(child)) {
                let node = block * FANOUT + child;
                match level.checked_sub(1) {
                    Some(below) => self.descend(below, node, tiles, is_near),
                    None => tiles.push(node as u32),
                }
            }
        }
    }

    /// Returns the mean extent of a tile along an axis in m, over a sample of the groups.
    pub(in crate::neighbor) fn mean_extent(&self) -> f64 {
        let (mut total, mut count) = (0.0, 0.0);
        for tiles in self.levels[0]
            .iter()
            .step_by(self.levels[0].len().div_ceil(SAMPLE))
        {
            for tile in (0..FANOUT).filter(|&tile| tiles.count[tile] > 0) {
                let Bounds { low, high } = tiles.bounds_of(tile);
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

/// Returns the block of nodes whose children are the given blocks.
fn parents_of<const D: usize>(children: &[Siblings<D>]) -> Siblings<D> {
    let mut block = Siblings::EMPTY;
    for (node, child) in children.iter().enumerate() {
        let bounds = child.bounds();
        for axis in 0..D {
            block.low[axis][node] = bounds.low[axis];
            block.high[axis][node] = bounds.high[axis];
            block.sum[axis][node] = child.sum[axis].iter().sum();
        }
        block.count[node] = child.count.iter().sum();
    }
    block
}
