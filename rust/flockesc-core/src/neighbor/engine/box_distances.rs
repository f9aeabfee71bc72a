//! `BoxDistances`: how far the nodes of a block are from a box, and which nodes are within which of several
//! ranges.

use bytemuck::cast_ref;
use pulp::Simd;

use crate::agents::FANOUT;
use crate::neighbor::engine::nodes::{Bounds, Siblings};
use crate::neighbor::engine::own::lanes;
use crate::neighbor::engine::reach::{bits, squared_norm};
use crate::neighbor::engine::tree::Tree;

/// Squared distances in m^2 of the nodes of one block to a box, as the kernel of one range computes them.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct BoxDistances {
    /// Between the nearest points.
    gap: [f64; FANOUT],
    /// Between the farthest points.
    extent: [f64; FANOUT],
}

/// Sum of the velocities and number of the agents in some nodes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Total<const D: usize> {
    pub(super) sum: [i64; D],
    pub(super) count: i64,
}

impl BoxDistances {
    pub(super) const EMPTY: Self = Self {
        gap: [0.0; FANOUT],
        extent: [0.0; FANOUT],
    };

    /// Computes the distances to the box `bounds`.
    #[inline(always)]
    pub(super) fn of<S: Simd, const D: usize>(
        simd: S,
        bounds: &Bounds<D>,
        nodes: &Siblings<D>,
    ) -> Self {
        let zero = simd.splat_f64s(0.0);
        let mut distances = Self::EMPTY;
        for register in 0..FANOUT / S::F64_LANES {
            let (low, high) = nodes.corners(simd, register);
            let (mut gap, mut extent) = ([zero; D], [zero; D]);
            for axis in 0..D {
                let own_low = simd.splat_f64s(bounds.low[axis]);
                let own_high = simd.splat_f64s(bounds.high[axis]);
                let above = simd.sub_f64s(low[axis], own_high);
                let below = simd.sub_f64s(own_low, high[axis]);
                gap[axis] = simd.max_f64s(simd.max_f64s(above, below), zero);
                let up = simd.sub_f64s(high[axis], own_low);
                let down = simd.sub_f64s(own_high, low[axis]);
                extent[axis] = simd.max_f64s(up, down);
            }
            let (gap, extent) = (squared_norm(simd, gap), squared_norm(simd, extent));
            S::as_mut_simd_f64s(&mut distances.gap).0[register] = gap;
            S::as_mut_simd_f64s(&mut distances.extent).0[register] = extent;
        }
        distances
    }

    /// Returns masks of one register of nodes: those entirely and those partly within a range.
    #[inline(always)]
    fn within<S: Simd>(&self, simd: S, register: usize, square: f64) -> (S::m64s, S::m64s) {
        let square = simd.splat_f64s(square);
        let gap = S::as_simd_f64s(&self.gap).0[register];
        let extent = S::as_simd_f64s(&self.extent).0[register];
        let is_near = simd.less_than_or_equal_f64s(gap, square);
        let is_inside = simd.less_than_or_equal_f64s(extent, square);
        (is_inside, simd.xor_m64s(is_near, is_inside))
    }

    /// Returns one bit per node for those entirely within a range, and one for those partly within it.
    #[inline(always)]
    fn bits_within<S: Simd>(&self, simd: S, square: f64) -> (u8, u8) {
        let (mut inside, mut across) = (0, 0);
        for register in 0..FANOUT / S::F64_LANES {
            let (is_inside, is_across) = self.within(simd, register, square);
            let shift = register * S::F64_LANES;
            inside |= bits(simd, is_inside) << shift;
            across |= bits(simd, is_across) << shift;
        }
        (inside, across)
    }
}

impl<const D: usize> Total<D> {
    pub(super) const EMPTY: Self = Self {
        sum: [0; D],
        count: 0,
    };
}

/// Lists the groups partly within some range of the box `bounds` in `groups`. Computes the totals of the other
/// nodes within each range. `stack` is a buffer.
#[inline(always)]
pub(super) fn find_groups<S: Simd, const D: usize>(
    simd: S,
    tree: &Tree<D>,
    bounds: &Bounds<D>,
    squares: &[f64],
    stack: &mut Vec<(usize, usize)>,
    groups: &mut Vec<usize>,
    totals: &mut [Total<D>],
) {
    totals.fill(Total::EMPTY);
    groups.clear();
    stack.push((tree.levels.len() - 1, 0));
    while let Some((level, index)) = stack.pop() {
        if level == 0 {
            groups.push(index);
            continue;
        }
        let block = &tree.levels[level][index];
        let distances = BoxDistances::of(simd, bounds, block);
        // A node that is partly within one range is visited, and then counts for all ranges.
        let mut visited = 0;
        for square in squares {
            let (_, across) = distances.bits_within(simd, *square);
            visited |= across;
        }
        for (square, total) in squares.iter().zip(&mut *totals) {
            let (inside, _) = distances.bits_within(simd, *square);
            add_children(block, inside & !visited, total);
        }
        while visited != 0 {
            let child = visited.trailing_zeros() as usize;
            visited &= visited - 1;
            stack.push((level - 1, index * FANOUT + child));
        }
    }
}

/// Adds the children of `block` whose bits are set.
#[inline(always)]
fn add_children<const D: usize>(block: &Siblings<D>, mut children: u8, total: &mut Total<D>) {
    while children != 0 {
        let child = children.trailing_zeros() as usize;
        children &= children - 1;
        for axis in 0..D {
            total.sum[axis] += block.sum[axis][child];
        }
        total.count += block.count[child];
    }
}

/// Returns the total of the tiles entirely within a range of a box, and one bit per tile for those partly
/// within it. `groups` are the groups of the tiles, and `distances` their distances to the box.
#[inline(always)]
pub(super) fn sum_enclosed<S: Simd, const D: usize>(
    simd: S,
    tree: &Tree<D>,
    groups: &[usize],
    distances: &[BoxDistances],
    square: f64,
) -> (Total<D>, u64) {
    let zero = simd.splat_u64s(0);
    let (mut sum, mut count, mut across) = ([zero; D], zero, 0);
    for (index, (group, distances)) in groups.iter().zip(distances).enumerate() {
        let tiles = &tree.levels[0][*group];
        for register in 0..FANOUT / S::F64_LANES {
            let (is_inside, is_across) = distances.within(simd, register, square);
            for axis in 0..D {
                let added = simd.add_u64s(sum[axis], load(simd, &tiles.sum[axis], register));
                sum[axis] = simd.select_u64s(is_inside, added, sum[axis]);
            }
            let added = simd.add_u64s(count, load(simd, &tiles.count, register));
            count = simd.select_u64s(is_inside, added, count);
            let shift = index * FANOUT + register * S::F64_LANES;
            across |= u64::from(bits(simd, is_across)) << shift;
        }
    }
    let mut total = Total::EMPTY;
    for axis in 0..D {
        total.sum[axis] = lanes(&sum[axis]).iter().sum();
    }
    total.count = lanes(&count).iter().sum();
    (total, across)
}

/// Loads one register of eight integers.
#[inline(always)]
fn load<S: Simd>(_: S, values: &[i64; FANOUT], register: usize) -> S::u64s {
    let values: &[u64; FANOUT] = cast_ref(values);
    S::as_simd_u64s(values).0[register]
}
