//! The SIMD kernel of the neighbor sums, if neighbors are determined by distances and fields of view.
//!
//! Nodes and agents within reach of a whole leaf are added at once, unless agents have a blind sector. Only
//! agents partly within reach of a leaf are tested.

use std::hint::black_box;

use bytemuck::cast_ref;
use pulp::{Arch, Simd, WithSimd};

use crate::agents::{Agents, Column, FANOUT, GROUP, Group, LEAF};
use crate::neighbor::engine::candidates::{LeafCandidates, Search};
use crate::neighbor::engine::field_of_view::{FieldOfView, Own, Torus, lanes};
use crate::neighbor::engine::reach::BITS;
use crate::neighbor::engine::sums::{NeighborSums, Scratch};
use crate::neighbor::engine::tree::Tree;
use crate::neighbor::engine::verlet::Reuse;
use crate::neighbor::ranges::Reaches;

/// The sums over neighbors of the groups from `first` on.
pub(crate) struct SumNeighbors<'a, const D: usize> {
    pub(crate) agents: &'a Agents<D>,
    pub(crate) tree: &'a Tree<D>,
    pub(crate) reaches: Reaches<'a>,
    pub(crate) torus: Torus,
    pub(crate) field_of_view: FieldOfView,
    /// Whether neighbors are counted. Otherwise their numbers are unspecified.
    pub(crate) is_counting: bool,
    pub(crate) reuse: Reuse,
    pub(crate) first: usize,
    pub(crate) sums: &'a mut [NeighborSums<D>],
    pub(crate) scratch: &'a mut Scratch,
}

impl<const D: usize> SumNeighbors<'_, D> {
    /// Computes the sums.
    pub(crate) fn run(self) {
        Arch::new().dispatch(self);
    }
}

impl<const D: usize> WithSimd for SumNeighbors<'_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let is_blind = self.field_of_view != FieldOfView::ALL_ROUND;
        // PERF: Five of eight combinations, because each is compiled for every instruction set and dimension. Only the
        // plain kernel has one without counts, which are 5 % of it; the others do more per candidate.
        // The compiler removes the wrapping by a constant `Torus::NONE`.
        match (self.torus, is_blind, self.is_counting) {
            (Torus::NONE, false, true) => self.sum::<S, false, true>(simd, Torus::NONE),
            (Torus::NONE, false, false) => self.sum::<S, false, false>(simd, Torus::NONE),
            (Torus::NONE, true, _) => self.sum::<S, true, true>(simd, Torus::NONE),
            (torus, false, _) => self.sum::<S, false, true>(simd, torus),
            (torus, true, _) => self.sum::<S, true, true>(simd, torus),
        }
    }
}

impl<const D: usize> SumNeighbors<'_, D> {
    /// Computes the sums. `IS_BLIND`: whether agents have a blind sector. `IS_COUNTING`: whether neighbors are counted.
    #[inline(always)]
    fn sum<S: Simd, const IS_BLIND: bool, const IS_COUNTING: bool>(self, simd: S, torus: Torus) {
        let Self {
            agents,
            tree,
            reaches,
            field_of_view,
            reuse,
            first,
            sums,
            scratch,
            ..
        } = self;
        let margin = match reuse {
            Reuse::New(margin) => margin,
            Reuse::Discarded | Reuse::Kept => 0.0,
        };
        let search = Search {
            agents,
            tree,
            torus,
            reaches,
            margin,
            is_each: IS_BLIND,
        };
        let candidates = &mut scratch.candidates;
        let mut squared = [0.0; GROUP];
        for (index, sums) in sums.iter_mut().enumerate() {
            let group = first + index;
            let ids = agents.ids_of(group);
            if index == 0 || !reaches.are_equal() {
                reaches.square(group, ids, &mut squared);
            }
            if reuse != Reuse::Kept {
                // PERF: Lists that are discarded are made for one group at a time, so that they stay in the cache.
                if index == 0 || reuse == Reuse::Discarded {
                    candidates.clear();
                }
                candidates.find(simd, search, group, &squared);
            }
            let index = if reuse == Reuse::Discarded { 0 } else { index };
            for leaf in 0..ids.len().div_ceil(LEAF) {
                let candidates = candidates.of(index, leaf);
                let whole = sum_whole(simd, agents, tree, &candidates);
                // Two registers share the loads of a candidate.
                let lanes = 2 * S::F64_LANES;
                for start in (leaf * LEAF..(leaf + 1) * LEAF).step_by(lanes) {
                    let own = (&agents.groups[group], &squared, field_of_view, start);
                    // With AVX-512 one register is the whole leaf.
                    if lanes > LEAF {
                        sum_agents::<S, D, 1, IS_BLIND, IS_COUNTING>(
                            simd,
                            torus,
                            own,
                            agents,
                            &candidates,
                            whole,
                            sums,
                        );
                    } else {
                        sum_agents::<S, D, 2, IS_BLIND, IS_COUNTING>(
                            simd,
                            torus,
                            own,
                            agents,
                            &candidates,
                            whole,
                            sums,
                        );
                    }
                }
            }
        }
    }
}

/// Returns the sums of the velocities of the nodes and agents within reach of a whole leaf.
#[inline(always)]
fn sum_whole<S: Simd, const D: usize>(
    simd: S,
    agents: &Agents<D>,
    tree: &Tree<D>,
    candidates: &LeafCandidates<'_>,
) -> [i64; D] {
    let mut whole = [0; D];
    if !candidates.shared_nodes.is_empty() || !candidates.nodes.is_empty() {
        let zero = simd.splat_u64s(0);
        let mut sum = [zero; D];
        for nodes in [candidates.shared_nodes, candidates.nodes] {
            for children in nodes {
                let block = &tree.levels[children.level][children.block];
                // PERF: All children are loaded and masked, because a branch per child would be unpredictable.
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
    for &place in candidates.enclosed {
        let velocity = agents.fixed_velocity(place as usize);
        for axis in 0..D {
            whole[axis] += velocity[axis];
        }
    }
    whole
}

/// Computes the sums of R registers of agents of a group, from the lane `start` on: `whole` plus the sums over the candidates within reach and, with
/// `IS_BLIND`, in view.
#[inline(always)]
fn sum_agents<
    S: Simd,
    const D: usize,
    const R: usize,
    const IS_BLIND: bool,
    const IS_COUNTING: bool,
>(
    simd: S,
    torus: Torus,
    (group, squared, view, start): (&Group<D>, &Column<f64>, FieldOfView, usize),
    agents: &Agents<D>,
    candidates: &LeafCandidates<'_>,
    whole: [i64; D],
    sums: &mut NeighborSums<D>,
) {
    // A loop, because target features do not reach closures, and calls there would stay calls.
    let mut own = [Own::<S, D>::load::<IS_BLIND>(simd, group, squared, view, start); R];
    for register in 1..R {
        let start = start + register * S::F64_LANES;
        own[register] = Own::load::<IS_BLIND>(simd, group, squared, view, start);
    }
    // The compiler does not know that it is 1. It would replace each masked addition by two operations.
    let one = simd.splat_u64s(if IS_COUNTING { black_box(1) } else { 0 });
    let mut sum = [[one; D]; R];
    for sum in &mut sum {
        for axis in 0..D {
            sum[axis] = simd.splat_u64s(whole[axis] as u64);
        }
    }
    let mut count = [simd.splat_u64s(candidates.count as u64); R];
    for &place in candidates.across {
        let place = place as usize;
        let (position, velocity) = (agents.position(place), agents.fixed_velocity(place));
        for register in 0..R {
            let (_, is_neighbor) = own[register].senses::<IS_BLIND>(simd, torus, &position);
            let (sum, count) = (&mut sum[register], &mut count[register]);
            for axis in 0..D {
                let added = simd.add_u64s(sum[axis], simd.splat_u64s(velocity[axis] as u64));
                sum[axis] = simd.select_u64s(is_neighbor, added, sum[axis]);
            }
            if IS_COUNTING {
                *count = simd.select_u64s(is_neighbor, simd.add_u64s(*count, one), *count);
            }
        }
    }
    for register in 0..R {
        let own = own[register].lanes();
        for axis in 0..D {
            sums.sum[axis][own.clone()].copy_from_slice(lanes(&sum[register][axis]));
        }
        if IS_COUNTING {
            sums.count[own].copy_from_slice(lanes(&count[register]));
        }
    }
}

/// Loads one register of eight integers.
#[inline(always)]
fn load<S: Simd>(_: S, values: &[i64; FANOUT], register: usize) -> S::u64s {
    let values: &[u64; FANOUT] = cast_ref(values);
    S::as_simd_u64s(values).0[register]
}
