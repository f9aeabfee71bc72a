//! The SIMD kernel of the neighbor sums, if neighbors are determined by distances and fields of view.
//!
//! Nodes and agents within reach of a whole tile are added at once, unless agents have a blind sector. Only
//! agents partly within reach of a tile are tested.

use std::hint::black_box;

use bytemuck::{NoUninit, cast_ref, cast_slice};
use pulp::{Arch, Simd, WithSimd};

use crate::agents::{Agents, Column, FANOUT, GROUP, Group, TILE};
use crate::neighbor::engine::candidates::{Search, TileCandidates};
use crate::neighbor::engine::field_of_view::FieldOfView;
use crate::neighbor::engine::kept::Listing;
use crate::neighbor::engine::reach::squared_norm;
use crate::neighbor::engine::sums::{NeighborSums, Scratch};
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::ranges::Reaches;

/// Computes the sums of the groups from `first` on.
#[expect(clippy::too_many_arguments, reason = "a struct would only rename them")]
pub(in crate::neighbor) fn sum_neighbors<const D: usize>(
    agents: &Agents<D>,
    tree: &Tree<D>,
    reaches: Reaches<'_>,
    field_of_view: FieldOfView,
    listing: Listing,
    first: usize,
    sums: &mut [NeighborSums<D>],
    scratch: &mut Scratch,
) {
    Arch::new().dispatch(SumNeighbors {
        agents,
        tree,
        reaches,
        field_of_view,
        listing,
        first,
        sums,
        scratch,
    });
}

/// The arguments of [`sum_neighbors`], for dispatch to an instruction set.
pub(in crate::neighbor) struct SumNeighbors<'a, const D: usize> {
    pub(in crate::neighbor) agents: &'a Agents<D>,
    pub(in crate::neighbor) tree: &'a Tree<D>,
    pub(in crate::neighbor) reaches: Reaches<'a>,
    pub(in crate::neighbor) field_of_view: FieldOfView,
    pub(in crate::neighbor) listing: Listing,
    pub(in crate::neighbor) first: usize,
    pub(in crate::neighbor) sums: &'a mut [NeighborSums<D>],
    pub(in crate::neighbor) scratch: &'a mut Scratch,
}

impl<const D: usize> WithSimd for SumNeighbors<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        if self.field_of_view == FieldOfView::ALL_ROUND {
            self.sum::<S, false>(simd);
        } else {
            self.sum::<S, true>(simd);
        }
    }
}

impl<const D: usize> SumNeighbors<'_, D> {
    /// Computes the sums. `IS_BLIND`: whether agents have a blind sector.
    #[inline(always)]
    fn sum<S: Simd, const IS_BLIND: bool>(self, simd: S) {
        let Self {
            agents,
            tree,
            reaches,
            field_of_view,
            listing,
            first,
            sums,
            scratch,
        } = self;
        let margin = match listing {
            Listing::New(margin) => margin,
            Listing::Discarded | Listing::Kept => 0.0,
        };
        let search = Search {
            agents,
            tree,
            reaches,
            margin,
            is_blind: IS_BLIND,
        };
        let candidates = &mut scratch.candidates;
        let mut work = 0;
        let mut squared = [0.0; GROUP];
        for (index, sums) in sums.iter_mut().enumerate() {
            let group = first + index;
            if listing != Listing::Kept {
                if index == 0 || listing == Listing::Discarded {
                    work += candidates.work();
                    candidates.clear();
                }
                candidates.find(simd, search, group);
            }
            let index = if listing == Listing::Discarded {
                0
            } else {
                index
            };
            let ids = agents.ids_of(group);
            reaches.square(group, ids, &mut squared);
            for tile in 0..ids.len().div_ceil(TILE) {
                let candidates = candidates.of(index, tile);
                let whole = sum_whole(simd, tree, &candidates);
                for start in (tile * TILE..(tile + 1) * TILE).step_by(S::F64_LANES) {
                    let own =
                        Own::<S, D>::load::<IS_BLIND>(simd, &agents.groups[group], &squared, start);
                    sum_agents::<S, D, IS_BLIND>(
                        simd,
                        own,
                        field_of_view,
                        start,
                        tree,
                        &candidates,
                        whole,
                        sums,
                    );
                }
            }
        }
        scratch.work = work + scratch.candidates.work();
    }
}

/// Returns the sums of the velocities of the nodes and agents within reach of a whole tile.
#[inline(always)]
fn sum_whole<S: Simd, const D: usize>(
    simd: S,
    tree: &Tree<D>,
    candidates: &TileCandidates<'_>,
) -> [i64; D] {
    let mut whole = [0; D];
    if !candidates.shared_nodes.is_empty() || !candidates.nodes.is_empty() {
        let zero = simd.splat_u64s(0);
        let mut sum = [zero; D];
        for nodes in [candidates.shared_nodes, candidates.nodes] {
            for children in nodes {
                let block = &tree.levels[children.level][children.block];
                for register in 0..FANOUT / S::F64_LANES {
                    let children = simd.splat_u64s(u64::from(children.bits));
                    let bit = S::as_simd_u64s(&BITS).0[register];
                    let is_other = simd.equal_u64s(simd.and_u64s(children, bit), zero);
                    for axis in 0..D {
                        let added =
                            simd.add_u64s(sum[axis], load(simd, &block.sum[axis], register));
                        sum[axis] = simd.select_u64s(is_other, sum[axis], added);
                    }
                }
            }
        }
        for axis in 0..D {
            whole[axis] = lanes(&sum[axis]).iter().sum();
        }
    }
    let rows = tree.agents.as_flattened();
    for &place in candidates.enclosed {
        for axis in 0..D {
            whole[axis] += rows[place as usize].velocity[axis];
        }
    }
    whole
}

/// The bit of every child.
const BITS: [u64; FANOUT] = [1, 2, 4, 8, 16, 32, 64, 128];

/// One register of agents.
#[derive(Clone, Copy)]
struct Own<S: Simd, const D: usize> {
    position: [S::f64s; D],
    /// In m/s; only for agents with a blind sector.
    velocity: [S::f64s; D],
    /// Squared reaches in m^2.
    squared: S::f64s,
}

impl<S: Simd, const D: usize> Own<S, D> {
    /// Loads the agents from lane `start` on.
    #[inline(always)]
    fn load<const IS_BLIND: bool>(
        simd: S,
        group: &Group<D>,
        squared: &Column<f64>,
        start: usize,
    ) -> Self {
        let load =
            |column: &Column<f64>| S::as_simd_f64s(&column[start..start + S::F64_LANES]).0[0];
        let mut own = Self {
            position: [simd.splat_f64s(0.0); D],
            velocity: [simd.splat_f64s(0.0); D],
            squared: load(squared),
        };
        for axis in 0..D {
            own.position[axis] = load(&group.position[axis]);
            if IS_BLIND {
                own.velocity[axis] = load(&group.velocity[axis]);
            }
        }
        own
    }
}

/// Computes the sums of one register of agents, which begins at lane `start`: `whole` plus the sums over the
/// candidates within reach and, with `IS_BLIND`, in view.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a struct would only rename them")]
fn sum_agents<S: Simd, const D: usize, const IS_BLIND: bool>(
    simd: S,
    own: Own<S, D>,
    field_of_view: FieldOfView,
    start: usize,
    tree: &Tree<D>,
    candidates: &TileCandidates<'_>,
    whole: [i64; D],
    sums: &mut NeighborSums<D>,
) {
    let places = start..start + S::F64_LANES;
    let edge = simd.splat_f64s(field_of_view.edge);
    let speed = simd.sqrt_f64s(squared_norm(simd, own.velocity));
    // The compiler does not know that it is 1. It would replace each masked addition by two operations.
    let one = simd.splat_u64s(black_box(1));
    let mut sum = [one; D];
    for axis in 0..D {
        sum[axis] = simd.splat_u64s(whole[axis] as u64);
    }
    let mut count = simd.splat_u64s(candidates.count as u64);
    let rows = tree.agents.as_flattened();
    for &place in candidates.across {
        let other = &rows[place as usize];
        let mut offset = own.position;
        for axis in 0..D {
            offset[axis] = simd.sub_f64s(simd.splat_f64s(other.position[axis]), offset[axis]);
        }
        let squared = squared_norm(simd, offset);
        let mut is_near = simd.less_than_or_equal_f64s(squared, own.squared);
        if IS_BLIND {
            let mut along = simd.mul_f64s(own.velocity[0], offset[0]);
            for axis in 1..D {
                along = simd.add_f64s(along, simd.mul_f64s(own.velocity[axis], offset[axis]));
            }
            let least = simd.mul_f64s(edge, simd.mul_f64s(speed, simd.sqrt_f64s(squared)));
            is_near = simd.and_m64s(is_near, simd.less_than_or_equal_f64s(least, along));
        }
        for axis in 0..D {
            let added = simd.add_u64s(sum[axis], simd.splat_u64s(other.velocity[axis] as u64));
            sum[axis] = simd.select_u64s(is_near, added, sum[axis]);
        }
        count = simd.select_u64s(is_near, simd.add_u64s(count, one), count);
    }
    for axis in 0..D {
        sums.sum[axis][places.clone()].copy_from_slice(lanes(&sum[axis]));
    }
    sums.count[places].copy_from_slice(lanes(&count));
}

/// Loads one register of eight integers.
#[inline(always)]
fn load<S: Simd>(_: S, values: &[i64; FANOUT], register: usize) -> S::u64s {
    let values: &[u64; FANOUT] = cast_ref(values);
    S::as_simd_u64s(values).0[register]
}

/// Returns the integers in a register.
#[inline(always)]
fn lanes<T: NoUninit>(register: &T) -> &[i64] {
    cast_slice(std::slice::from_ref(register))
}
