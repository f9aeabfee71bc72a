//! The SIMD kernel of the neighbor sums under several ranges, if neighbors are determined by distances alone.
//!
//! One descent of the tree serves all ranges. Nodes entirely within a range are added to its sums at once. A
//! pair of tiles is tested agent by agent only against the ranges that it is partly within.

use std::hint::black_box;

use bytemuck::{cast_mut, cast_ref};
use pulp::{Arch, Simd, WithSimd};

use crate::agents::{Agents, Column, FANOUT, GROUP, TILE};
use crate::neighbor::engine::nodes::{Bounds, FixedPointAgent, Siblings};
use crate::neighbor::engine::reach::{bits, squared_norm};
use crate::neighbor::engine::sums::NeighborSums;
use crate::neighbor::engine::tree::Tree;

/// Buffers that are reused from group to group.
#[derive(Debug, Clone)]
pub(in crate::neighbor) struct ProfileScratch<const D: usize> {
    /// Stack of the nodes to visit, as pairs (level, block).
    nodes: Vec<(usize, usize)>,
    /// Groups partly within some range of a group.
    groups: Vec<usize>,
    /// Sums over nodes entirely within each range of a group.
    nodes_within: Vec<Totals<D>>,
    /// The same of a tile.
    tiles_within: Vec<Totals<D>>,
    /// One bit per tile of a block for each range: whether the tile is partly within it.
    across: Vec<u8>,
}

/// Sums in eight lanes.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
struct Totals<const D: usize> {
    sum: [[i64; FANOUT]; D],
    count: [i64; FANOUT],
}

impl<const D: usize> Totals<D> {
    const EMPTY: Self = Self {
        sum: [[0; FANOUT]; D],
        count: [0; FANOUT],
    };
}

impl<const D: usize> ProfileScratch<D> {
    pub(in crate::neighbor) fn new(num_ranges: usize) -> Self {
        Self {
            nodes: Vec::new(),
            groups: Vec::new(),
            nodes_within: vec![Totals::EMPTY; num_ranges],
            tiles_within: vec![Totals::EMPTY; num_ranges],
            across: vec![0; num_ranges],
        }
    }
}

/// Computes the sums of one group under each range. `squares` are the squared ranges in m^2, in ascending
/// order.
pub(in crate::neighbor) fn sum_profile<const D: usize>(
    agents: &Agents<D>,
    tree: &Tree<D>,
    squares: &[f64],
    group: usize,
    sums: &mut [NeighborSums<D>],
    scratch: &mut ProfileScratch<D>,
) {
    Arch::new().dispatch(SumProfile {
        agents,
        tree,
        squares,
        group,
        sums,
        scratch,
    });
}

/// The arguments of [`sum_profile`], for dispatch to an instruction set.
pub(in crate::neighbor) struct SumProfile<'a, const D: usize> {
    pub(in crate::neighbor) agents: &'a Agents<D>,
    pub(in crate::neighbor) tree: &'a Tree<D>,
    pub(in crate::neighbor) squares: &'a [f64],
    pub(in crate::neighbor) group: usize,
    pub(in crate::neighbor) sums: &'a mut [NeighborSums<D>],
    pub(in crate::neighbor) scratch: &'a mut ProfileScratch<D>,
}

impl<const D: usize> WithSimd for SumProfile<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            agents,
            tree,
            squares,
            group,
            sums,
            scratch,
        } = self;
        for sums in sums.iter_mut() {
            sums.count = [0; GROUP];
            sums.sum = [[0; GROUP]; D];
        }
        let own = &tree.levels[0][group];
        find_groups(simd, tree, &own.bounds(), squares, scratch);
        let positions = &agents.groups[group].position;
        let num_tiles = agents.ids_of(group).len().div_ceil(TILE);
        for tile in 0..num_tiles {
            let bounds = own.bounds_of(tile);
            scratch.tiles_within.copy_from_slice(&scratch.nodes_within);
            for &other in &scratch.groups {
                let block = &tree.levels[0][other];
                let mut some = 0;
                for ((square, totals), across) in squares
                    .iter()
                    .zip(&mut scratch.tiles_within)
                    .zip(&mut scratch.across)
                {
                    *across = add_enclosed(simd, &bounds, block, *square, totals);
                    some |= *across;
                }
                let rows = tree.agents[other].as_chunks::<TILE>().0;
                while some != 0 {
                    let child = some.trailing_zeros() as usize;
                    some &= some - 1;
                    let is_across = |across: &u8| across >> child & 1 == 1;
                    let first = scratch.across.iter().position(is_across).unwrap_or(0);
                    let count = scratch.across[first..]
                        .iter()
                        .take_while(|k| is_across(k))
                        .count();
                    let ranges = first..first + count;
                    for start in (tile * TILE..(tile + 1) * TILE).step_by(S::F64_LANES) {
                        let (squares, sums) = (&squares[ranges.clone()], &mut sums[ranges.clone()]);
                        sum_tile(simd, positions, start, &rows[child], squares, sums);
                    }
                }
            }
            let lanes = tile * TILE..(tile + 1) * TILE;
            for (sums, totals) in sums.iter_mut().zip(&scratch.tiles_within) {
                for axis in 0..D {
                    let total: i64 = totals.sum[axis].iter().sum();
                    for sum in &mut sums.sum[axis][lanes.clone()] {
                        *sum += total;
                    }
                }
                let total: i64 = totals.count.iter().sum();
                for count in &mut sums.count[lanes.clone()] {
                    *count += total;
                }
            }
        }
    }
}

/// Lists the groups partly within some range of the box `bounds`, and adds nodes entirely within a range to
/// `scratch.nodes_within`, to the totals of every such range.
#[inline(always)]
fn find_groups<S: Simd, const D: usize>(
    simd: S,
    tree: &Tree<D>,
    bounds: &Bounds<D>,
    squares: &[f64],
    scratch: &mut ProfileScratch<D>,
) {
    scratch.nodes_within.fill(Totals::EMPTY);
    scratch.groups.clear();
    scratch.nodes.push((tree.levels.len() - 1, 0));
    while let Some((level, index)) = scratch.nodes.pop() {
        if level == 0 {
            scratch.groups.push(index);
            continue;
        }
        let block = &tree.levels[level][index];
        // A node that is partly within one range is visited, and then counts for all ranges.
        let mut visited = 0;
        for square in squares {
            let (inside, near) = classify(simd, bounds, block, *square);
            visited |= near & !inside;
        }
        for (square, totals) in squares.iter().zip(&mut scratch.nodes_within) {
            let (inside, _) = classify(simd, bounds, block, *square);
            add_children(block, inside & !visited, totals);
        }
        while visited != 0 {
            let child = visited.trailing_zeros() as usize;
            visited &= visited - 1;
            scratch.nodes.push((level - 1, index * FANOUT + child));
        }
    }
}

/// Adds the children of `block` whose bits are set.
#[inline(always)]
fn add_children<const D: usize>(block: &Siblings<D>, mut children: u8, totals: &mut Totals<D>) {
    while children != 0 {
        let child = children.trailing_zeros() as usize;
        children &= children - 1;
        for axis in 0..D {
            totals.sum[axis][0] += block.sum[axis][child];
        }
        totals.count[0] += block.count[child];
    }
}

/// Returns one bit per node for those entirely within a range of the box `bounds`, and one for those at least
/// partly within it.
#[inline(always)]
fn classify<S: Simd, const D: usize>(
    simd: S,
    bounds: &Bounds<D>,
    nodes: &Siblings<D>,
    square: f64,
) -> (u8, u8) {
    let (mut inside, mut near) = (0, 0);
    for register in 0..FANOUT / S::F64_LANES {
        let (gap, extent) = distances(simd, bounds, nodes, register);
        let square = simd.splat_f64s(square);
        let shift = register * S::F64_LANES;
        inside |= bits(simd, simd.less_than_or_equal_f64s(extent, square)) << shift;
        near |= bits(simd, simd.less_than_or_equal_f64s(gap, square)) << shift;
    }
    (inside, near)
}

/// Adds the nodes entirely within a range of the box `bounds` to `totals`. Returns one bit per node for those
/// partly within it.
#[inline(always)]
fn add_enclosed<S: Simd, const D: usize>(
    simd: S,
    bounds: &Bounds<D>,
    nodes: &Siblings<D>,
    square: f64,
    totals: &mut Totals<D>,
) -> u8 {
    let mut across = 0;
    for register in 0..FANOUT / S::F64_LANES {
        let (gap, extent) = distances(simd, bounds, nodes, register);
        let square = simd.splat_f64s(square);
        let is_inside = simd.less_than_or_equal_f64s(extent, square);
        let near = bits(simd, simd.less_than_or_equal_f64s(gap, square));
        let inside = bits(simd, is_inside);
        across |= (near & !inside) << (register * S::F64_LANES);
        if inside != 0 {
            for axis in 0..D {
                add_masked(
                    simd,
                    is_inside,
                    &nodes.sum[axis],
                    &mut totals.sum[axis],
                    register,
                );
            }
            add_masked(simd, is_inside, &nodes.count, &mut totals.count, register);
        }
    }
    across
}

/// Adds one register of `values` to `totals` where `mask` is set.
#[inline(always)]
fn add_masked<S: Simd>(
    simd: S,
    mask: S::m64s,
    values: &[i64; FANOUT],
    totals: &mut [i64; FANOUT],
    register: usize,
) {
    let values: &[u64; FANOUT] = cast_ref(values);
    let totals: &mut [u64; FANOUT] = cast_mut(totals);
    let value = S::as_simd_u64s(values).0[register];
    let total = &mut S::as_mut_simd_u64s(totals).0[register];
    *total = simd.select_u64s(mask, simd.add_u64s(*total, value), *total);
}

/// Returns the squared distances in m^2 of one register of nodes to the box `bounds`, as the kernel of one range
/// computes them: between the nearest points, and between the farthest ones.
#[inline(always)]
fn distances<S: Simd, const D: usize>(
    simd: S,
    bounds: &Bounds<D>,
    nodes: &Siblings<D>,
    register: usize,
) -> (S::f64s, S::f64s) {
    let zero = simd.splat_f64s(0.0);
    let (mut gap, mut extent) = ([zero; D], [zero; D]);
    for axis in 0..D {
        let low = S::as_simd_f64s(&nodes.low[axis]).0[register];
        let high = S::as_simd_f64s(&nodes.high[axis]).0[register];
        let (own_low, own_high) = (bounds.low[axis], bounds.high[axis]);
        let above = simd.sub_f64s(low, simd.splat_f64s(own_high));
        let below = simd.sub_f64s(simd.splat_f64s(own_low), high);
        gap[axis] = simd.max_f64s(simd.max_f64s(above, below), zero);
        let up = simd.sub_f64s(high, simd.splat_f64s(own_low));
        let down = simd.sub_f64s(simd.splat_f64s(own_high), low);
        extent[axis] = simd.max_f64s(up, down);
    }
    (squared_norm(simd, gap), squared_norm(simd, extent))
}

/// Adds the agents of a tile within each range to the sums of one register of agents, which begins at lane
/// `start`.
#[inline(always)]
fn sum_tile<S: Simd, const D: usize>(
    simd: S,
    positions: &[Column<f64>; D],
    start: usize,
    others: &[FixedPointAgent<D>; TILE],
    squares: &[f64],
    sums: &mut [NeighborSums<D>],
) {
    let places = start..start + S::F64_LANES;
    let zero = simd.splat_f64s(0.0);
    let mut position = [zero; D];
    for axis in 0..D {
        position[axis] = S::as_simd_f64s(&positions[axis][places.clone()]).0[0];
    }
    let mut distance = [zero; TILE];
    for (distance, other) in distance.iter_mut().zip(others) {
        let mut offset = position;
        for axis in 0..D {
            offset[axis] = simd.sub_f64s(offset[axis], simd.splat_f64s(other.position[axis]));
        }
        *distance = squared_norm(simd, offset);
    }
    // The compiler does not know that it is 1. It would replace each masked addition by two operations.
    let one = simd.splat_u64s(black_box(1));
    for (square, sums) in squares.iter().zip(sums) {
        let square = simd.splat_f64s(*square);
        let mut sum = [one; D];
        for axis in 0..D {
            sum[axis] = *register(simd, &mut sums.sum[axis], start);
        }
        let mut count = *register(simd, &mut sums.count, start);
        for (distance, other) in distance.iter().zip(others) {
            let is_near = simd.less_than_or_equal_f64s(*distance, square);
            for axis in 0..D {
                let added = simd.add_u64s(sum[axis], simd.splat_u64s(other.velocity[axis] as u64));
                sum[axis] = simd.select_u64s(is_near, added, sum[axis]);
            }
            count = simd.select_u64s(is_near, simd.add_u64s(count, one), count);
        }
        for axis in 0..D {
            *register(simd, &mut sums.sum[axis], start) = sum[axis];
        }
        *register(simd, &mut sums.count, start) = count;
    }
}

/// Returns the register of integers that begins at lane `start`.
#[inline(always)]
fn register<S: Simd>(_: S, column: &mut Column<i64>, start: usize) -> &mut S::u64s {
    let column: &mut Column<u64> = cast_mut(column);
    &mut S::as_mut_simd_u64s(column).0[start / S::F64_LANES]
}
