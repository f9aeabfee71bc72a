//! Sums over the offsets from every agent to its neighbors: of the offsets, and of the offsets from close neighbors
//! divided by the squared distances.

use pulp::{Arch, Simd, WithSimd};

use crate::agents::{Column, FANOUT, GROUP, TILE};
use crate::base::exact::Scale;
use crate::base::vector::SHORTEST;
use crate::neighbor::engine::candidates::{Candidates, Search};
use crate::neighbor::engine::field_of_view::FieldOfView;
use crate::neighbor::engine::own::{Own, lanes};
use crate::neighbor::engine::pairs::Pairs;
use crate::neighbor::engine::reach::{bits, squared_norm};
use crate::neighbor::engine::select::TileColumn;
use crate::neighbor::engine::separation::{Terms, sum_terms};
use crate::neighbor::engine::sums::Scratch;
use crate::neighbor::ranges::Reaches;

/// The sums of the agents of one group.
pub(crate) struct OffsetSums<const D: usize> {
    /// Sums of the offsets to all neighbors, in units of the scale of the call.
    pub(crate) toward_all: [Column<i64>; D],
    /// Sums over close neighbors of the offset from the neighbor divided by the squared distance, in 1/m.
    pub(crate) from_close: [Column<f64>; D],
}

/// Buffers of [`Pairs::sum_offsets`].
#[derive(Debug, Clone, Default)]
pub(crate) struct OffsetBuffers<const D: usize> {
    tiles: Vec<u32>,
    candidates: Candidates,
    /// Terms of the close neighbors of every tile.
    terms: [Terms<D>; FANOUT],
}

impl<const D: usize> OffsetBuffers<D> {
    /// Largest memory in bytes that is kept from step to step.
    const MOST_BYTES: usize = 1 << 20;

    /// Returns the memory in bytes that the buffers of a chunk keep in a flock of this many agents.
    pub(crate) fn most_bytes(num_agents: usize) -> usize {
        let rows = FANOUT * 2 * num_agents.max(4) * size_of::<[TileColumn<f64>; D]>();
        let candidates = Scratch::most_bytes(2 * num_agents, num_agents);
        size_of::<Self>() + Self::MOST_BYTES.min(rows + candidates)
    }

    /// Frees the buffers if they are too large to keep.
    pub(crate) fn trim(&mut self) {
        let terms: usize = self.terms.iter().map(Terms::bytes).sum();
        if terms + self.candidates.bytes() + self.tiles.capacity() * size_of::<u32>()
            > Self::MOST_BYTES
        {
            *self = Self::default();
        }
    }
}

impl<const D: usize> Pairs<'_, D> {
    /// Returns the sums of a group. `scale` is the scale of the sums of offsets, and neighbors up to `range` in m are
    /// close.
    pub(crate) fn sum_offsets(
        &self,
        group: usize,
        scale: Scale,
        range: f64,
        buffers: &mut OffsetBuffers<D>,
    ) -> OffsetSums<D> {
        for terms in &mut buffers.terms {
            terms.clear();
        }
        let squared_range = range * range;
        let toward_all = if self.options.is_by_view() {
            Arch::new().dispatch(SumOffsets {
                search: Search {
                    agents: self.agents,
                    tree: self.tree,
                    reaches: Reaches::Squares(self.squares),
                    margin: 0.0,
                    is_each: true,
                },
                field_of_view: self.options.field_of_view,
                scale,
                squared_range,
                group,
                buffers,
            })
        } else {
            self.visit_offsets(group, scale, squared_range, buffers)
        };
        OffsetSums {
            toward_all,
            from_close: sum_terms(&buffers.terms),
        }
    }

    /// Returns the sums of the offsets to all neighbors, from all pairs, and stores the terms of close neighbors.
    fn visit_offsets(
        &self,
        group: usize,
        scale: Scale,
        squared_range: f64,
        buffers: &mut OffsetBuffers<D>,
    ) -> [Column<i64>; D] {
        let mut sums = [[0; GROUP]; D];
        self.visit(group, &mut buffers.tiles, |lane, place| {
            let (offset, squared) = self.offset(group, lane, place);
            for axis in 0..D {
                sums[axis][lane] += scale.quantize(offset[axis]);
            }
            if squared > SHORTEST * SHORTEST && squared <= squared_range {
                let term = offset.map(|entry| -entry / squared);
                buffers.terms[lane / TILE].push(lane % TILE, term);
            }
        });
        sums
    }
}

/// The sums if neighbors are determined by distances and fields of view, for dispatch to an instruction set.
struct SumOffsets<'a, const D: usize> {
    /// Lists each candidate.
    search: Search<'a, D>,
    field_of_view: FieldOfView,
    scale: Scale,
    squared_range: f64,
    group: usize,
    buffers: &'a mut OffsetBuffers<D>,
}

impl<const D: usize> WithSimd for SumOffsets<'_, D> {
    type Output = [Column<i64>; D];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        if self.field_of_view == FieldOfView::ALL_ROUND {
            self.sum::<S, false>(simd)
        } else {
            self.sum::<S, true>(simd)
        }
    }
}

impl<const D: usize> SumOffsets<'_, D> {
    /// Computes the sums. `IS_BLIND`: whether agents have a blind sector.
    #[inline(always)]
    fn sum<S: Simd, const IS_BLIND: bool>(self, simd: S) -> [Column<i64>; D] {
        let Self {
            search,
            field_of_view,
            scale,
            squared_range,
            group,
            buffers,
        } = self;
        let OffsetBuffers {
            candidates, terms, ..
        } = buffers;
        candidates.clear();
        candidates.find(simd, search, group);
        let ids = search.agents.ids_of(group);
        let (mut squared, mut sums) = ([0.0; GROUP], [[0; GROUP]; D]);
        search.reaches.square(group, ids, &mut squared);
        let agents = &search.agents.groups[group];
        let (zero, one) = (simd.splat_u64s(0), simd.splat_u64s(1));
        let nearest = simd.splat_f64s(SHORTEST * SHORTEST);
        let farthest = simd.splat_f64s(squared_range);
        for tile in 0..ids.len().div_ceil(TILE) {
            let (candidates, terms) = (candidates.of(0, tile), &mut terms[tile]);
            terms.reserve(candidates.across.len());
            for first in (0..TILE).step_by(S::F64_LANES) {
                let start = tile * TILE + first;
                let own =
                    Own::<S, D>::load::<IS_BLIND>(simd, agents, &squared, field_of_view, start);
                let (mut sum, mut count, mut num_rows) = ([zero; D], zero, 0);
                for &place in candidates.across {
                    let other = search.agents.position(place as usize);
                    let (offset, is_neighbor) = own.senses::<IS_BLIND>(simd, &other);
                    for axis in 0..D {
                        let added =
                            simd.add_u64s(sum[axis], scale.quantize_register(simd, offset[axis]));
                        sum[axis] = simd.select_u64s(is_neighbor, added, sum[axis]);
                    }
                    let squared = squared_norm(simd, offset);
                    let is_apart = simd.less_than_f64s(nearest, squared);
                    let is_close = simd.less_than_or_equal_f64s(squared, farthest);
                    let is_close = simd.and_m64s(is_neighbor, simd.and_m64s(is_apart, is_close));
                    if bits(simd, is_close) != 0 {
                        count = simd.select_u64s(is_close, simd.add_u64s(count, one), count);
                        let row = terms.row(num_rows);
                        num_rows += 1;
                        for axis in 0..D {
                            let term = simd.div_f64s(offset[axis], squared);
                            let term = simd.sub_f64s(simd.splat_f64s(0.0), term);
                            let term = simd.select_f64s(is_close, term, simd.splat_f64s(0.0));
                            let columns = &mut row[axis][first..first + S::F64_LANES];
                            S::as_mut_simd_f64s(columns).0[0] = term;
                        }
                    }
                }
                for axis in 0..D {
                    sums[axis][own.lanes()].copy_from_slice(lanes(&sum[axis]));
                }
                terms.counts[first..first + S::F64_LANES].copy_from_slice(lanes(&count));
            }
        }
        sums
    }
}
