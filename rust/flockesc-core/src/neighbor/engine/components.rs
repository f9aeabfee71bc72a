//! Connected components of the neighbor graph, by graph search in the tree, if neighbors are determined by distances
//! alone.

use pulp::{Arch, Simd, WithSimd};

use crate::agents::{Agents, Column, FANOUT, GROUP, TILE};
use crate::base::vector::larger;
use crate::neighbor::engine::forest::Forest;
use crate::neighbor::engine::nodes::Siblings;
use crate::neighbor::engine::reach::{bits, squared_norm};
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::ranges::Reaches;

/// Returns the weakly connected components if neighbors are determined by distances alone.
pub(in crate::neighbor) fn connect<const D: usize>(
    agents: &Agents<D>,
    tree: &Tree<D>,
    reaches: Reaches<'_>,
) -> Forest {
    Arch::new().dispatch(Connect {
        agents,
        tree,
        reaches,
    })
}

/// The arguments of [`connect`], for dispatch to an instruction set.
struct Connect<'a, const D: usize> {
    agents: &'a Agents<D>,
    tree: &'a Tree<D>,
    reaches: Reaches<'a>,
}

impl<const D: usize> WithSimd for Connect<'_, D> {
    type Output = Forest;

    /// Searches from every agent that no earlier search has found. A search looks only at agents not found yet, so
    /// that each agent is found once.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Forest {
        let Self {
            agents,
            tree,
            reaches,
        } = self;
        let mut forest = Forest::new(agents.len());
        let mut remaining = Remaining::new(agents, tree, reaches);
        let (mut frontier, mut blocks) = (Vec::new(), Vec::new());
        for start in 0..agents.len() {
            if !remaining.remove(start) {
                continue;
            }
            frontier.push(start);
            while let Some(place) = frontier.pop() {
                let from = Agent {
                    position: agents.position(place),
                    square: remaining.squares[place / GROUP][place % GROUP],
                };
                blocks.push((tree.levels.len() - 1, 0));
                while let Some((level, block)) = blocks.pop() {
                    let Level { open, longest } = &remaining.levels[level];
                    if open[block] == 0 {
                        continue;
                    }
                    let nodes = &tree.levels[level][block];
                    let mut near = open[block] & from.near(simd, nodes, &longest[block]);
                    while near != 0 {
                        let child = block * FANOUT + near.trailing_zeros() as usize;
                        near &= near - 1;
                        if level > 0 {
                            blocks.push((level - 1, child));
                            continue;
                        }
                        let mut found = remaining.agents[child]
                            & from.reaches(simd, agents, &remaining.squares, child);
                        while found != 0 {
                            let place = child * TILE + found.trailing_zeros() as usize;
                            found &= found - 1;
                            remaining.remove(place);
                            forest.add(start, place);
                            frontier.push(place);
                        }
                    }
                }
            }
        }
        forest
    }
}

/// The agents that no search has found yet.
struct Remaining {
    /// One bit per agent of every tile.
    agents: Vec<u8>,
    /// Squared reaches in m^2, group by group.
    squares: Vec<Column<f64>>,
    levels: Vec<Level>,
}

/// The nodes of one level of the tree, block by block.
struct Level {
    /// One bit per node: whether it contains agents that remain.
    open: Vec<u8>,
    /// Square in m^2 of the longest reach of an agent in each node.
    longest: Vec<[f64; FANOUT]>,
}

impl Remaining {
    #[inline(always)]
    fn new<const D: usize>(agents: &Agents<D>, tree: &Tree<D>, reaches: Reaches<'_>) -> Self {
        let num_groups = agents.groups.len();
        let mut squares = vec![[0.0; GROUP]; num_groups];
        for (group, squares) in squares.iter_mut().enumerate() {
            reaches.square(group, agents.ids_of(group), squares);
        }
        let mut levels: Vec<Level> = Vec::with_capacity(tree.levels.len());
        for (height, blocks) in tree.levels.iter().enumerate() {
            let mut longest = vec![[0.0; FANOUT]; blocks.len()];
            let nodes = longest.as_flattened_mut().iter_mut();
            if height == 0 {
                for (node, squares) in nodes.zip(squares.as_flattened().chunks(TILE)) {
                    *node = squares.iter().copied().fold(0.0, larger);
                }
            } else {
                for (node, below) in nodes.zip(&levels[height - 1].longest) {
                    *node = below.iter().copied().fold(0.0, larger);
                }
            }
            let is_open = |nodes: &Siblings<D>| {
                (0..FANOUT).fold(0, |bits, child| {
                    bits | u8::from(nodes.count[child] > 0) << child
                })
            };
            let open = blocks.iter().map(is_open).collect();
            levels.push(Level { open, longest });
        }
        let mut remaining = vec![0; num_groups * FANOUT];
        for place in 0..agents.len() {
            remaining[place / TILE] |= 1 << (place % TILE);
        }
        Self {
            agents: remaining,
            squares,
            levels,
        }
    }

    /// Removes the agent at `place`. Returns whether it remained.
    #[inline(always)]
    fn remove(&mut self, place: usize) -> bool {
        let (mut node, bit) = (place / TILE, 1 << (place % TILE));
        if self.agents[node] & bit == 0 {
            return false;
        }
        self.agents[node] &= !bit;
        let mut is_empty = self.agents[node] == 0;
        for level in &mut self.levels {
            if !is_empty {
                break;
            }
            let block = node / FANOUT;
            level.open[block] &= !(1 << (node % FANOUT));
            (is_empty, node) = (level.open[block] == 0, block);
        }
        true
    }
}

/// An agent from which a search goes on.
struct Agent<const D: usize> {
    position: [f64; D],
    /// Squared reach in m^2.
    square: f64,
}

impl<const D: usize> Agent<D> {
    /// Returns one bit per node: whether it may contain agents connected to this one. `longest` are the squares of
    /// their longest reaches in m^2.
    #[inline(always)]
    fn near<S: Simd>(&self, simd: S, nodes: &Siblings<D>, longest: &[f64; FANOUT]) -> u8 {
        let mut near = 0;
        for register in 0..FANOUT / S::F64_LANES {
            let (low, high) = nodes.corners(simd, register);
            let mut gap = low;
            for axis in 0..D {
                let own = simd.splat_f64s(self.position[axis]);
                let (above, below) = (
                    simd.sub_f64s(low[axis], own),
                    simd.sub_f64s(own, high[axis]),
                );
                gap[axis] = simd.max_f64s(simd.max_f64s(above, below), simd.splat_f64s(0.0));
            }
            near |= self.within(simd, gap, S::as_simd_f64s(longest).0[register])
                << (register * S::F64_LANES);
        }
        near
    }

    /// Returns one bit per agent of a tile: whether it is connected to this agent.
    #[inline(always)]
    fn reaches<S: Simd>(
        &self,
        simd: S,
        agents: &Agents<D>,
        squares: &[Column<f64>],
        tile: usize,
    ) -> u8 {
        let (group, first) = (tile / FANOUT, tile % FANOUT * TILE);
        let mut near = 0;
        for register in 0..TILE / S::F64_LANES {
            let start = first + register * S::F64_LANES;
            let lanes = start..start + S::F64_LANES;
            let mut offset = [simd.splat_f64s(0.0); D];
            for axis in 0..D {
                let column = &agents.groups[group].position[axis][lanes.clone()];
                offset[axis] = simd.sub_f64s(
                    S::as_simd_f64s(column).0[0],
                    simd.splat_f64s(self.position[axis]),
                );
            }
            let squares = S::as_simd_f64s(&squares[group][lanes]).0[0];
            near |= self.within(simd, offset, squares) << (register * S::F64_LANES);
        }
        near
    }

    /// Returns one bit per lane: whether the length of the offset in m is at most this agent's reach or the other
    /// reach, whose square is given.
    #[inline(always)]
    fn within<S: Simd>(&self, simd: S, offset: [S::f64s; D], squares: S::f64s) -> u8 {
        let longer = simd.max_f64s(squares, simd.splat_f64s(self.square));
        bits(
            simd,
            simd.less_than_or_equal_f64s(squared_norm(simd, offset), longer),
        )
    }
}
