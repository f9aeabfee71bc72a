//! Sums over the offsets from every agent to its neighbors: of the offsets, of the offsets from close neighbors
//! divided by the squared distances, and of any terms.

use bytemuck::cast_slice;
use pulp::{Arch, Simd, WithSimd};

use crate::agents::{Column, GROUP, LEAF};
use crate::base::exact::Scale;
use crate::base::vector::{SHORTEST, larger, squared_norm};
use crate::neighbor::engine::candidates::{Candidates, Search};
use crate::neighbor::engine::field_of_view::{FieldOfView, Own, Torus, lanes, register_norm};
use crate::neighbor::engine::pairs::Pairs;
use crate::neighbor::engine::reach::bits;
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
    leaves: Vec<u32>,
    candidates: Candidates,
    /// The terms of sums: the index of the sum times [`GROUP`] plus the lane, and the term.
    terms: Vec<(u32, [f64; D])>,
}

impl<const D: usize> OffsetBuffers<D> {
    /// Largest memory in bytes that is kept from step to step.
    const MOST_BYTES: usize = 1 << 20;

    /// Frees the buffers if they are too large to keep.
    pub(crate) fn trim(&mut self) {
        let terms = self.terms.capacity() * size_of::<(u32, [f64; D])>();
        let leaves = self.leaves.capacity() * size_of::<u32>();
        if terms + leaves + self.candidates.bytes() > Self::MOST_BYTES {
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
        buffers.terms.clear();
        let mut sums = [[0; GROUP]; D];
        if self.options.is_by_view() {
            Arch::new().dispatch(SumOffsets {
                pairs: self,
                group,
                scale,
                range,
                sums: &mut sums,
                buffers,
            });
        } else {
            let OffsetBuffers { leaves, terms, .. } = buffers;
            self.visit(group, leaves, |lane, place| {
                let offset = self.distances().offset(group * GROUP + lane, place);
                for axis in 0..D {
                    sums[axis][lane] += scale.quantize(offset[axis]);
                }
                push_close(terms, lane, offset, range);
            });
        }
        let [from_close] = add_up(&buffers.terms);
        OffsetSums {
            toward_all: sums,
            from_close,
        }
    }

    /// Returns K sums over the other neighbors of every agent of a group. `term(place, offset)` returns the index of a
    /// sum and the term that the neighbor at `place` adds to it. `offset` leads to the neighbor, in m.
    pub(crate) fn sum_terms<const K: usize>(
        &self,
        group: usize,
        buffers: &mut OffsetBuffers<D>,
        term: impl Fn(usize, [f64; D]) -> Option<(usize, [f64; D])>,
    ) -> [[Column<f64>; D]; K] {
        let OffsetBuffers { leaves, terms, .. } = buffers;
        terms.clear();
        self.visit(group, leaves, |lane, place| {
            let own = group * GROUP + lane;
            if place != own {
                let found = term(place, self.distances().offset(own, place));
                terms.extend(found.map(|(sum, term)| ((sum * GROUP + lane) as u32, term)));
            }
        });
        add_up(terms)
    }
}

/// Adds the term of a neighbor if it is close.
#[inline(always)]
fn push_close<const D: usize>(
    terms: &mut Vec<(u32, [f64; D])>,
    lane: usize,
    offset: [f64; D],
    range: f64,
) {
    let squared = squared_norm(&offset);
    if squared > SHORTEST * SHORTEST && squared <= range * range {
        terms.push((lane as u32, offset.map(|entry| -entry / squared)));
    }
}

/// Returns K exact sums of the terms of every agent. Terms differ by many orders of magnitude, so the scale of a sum
/// follows from its largest term.
fn add_up<const K: usize, const D: usize>(terms: &[(u32, [f64; D])]) -> [[Column<f64>; D]; K] {
    let (mut largest, mut counts) = ([[0.0; GROUP]; K], [[0; GROUP]; K]);
    let place = |index: u32| (index as usize / GROUP, index as usize % GROUP);
    for (index, term) in terms {
        let (sum, lane) = place(*index);
        let most = largest[sum][lane];
        largest[sum][lane] = term.iter().fold(most, |most, x| larger(most, x.abs()));
        counts[sum][lane] += 1;
    }
    let scales: [Column<Scale>; K] = std::array::from_fn(|sum| {
        std::array::from_fn(|lane| Scale::new(largest[sum][lane], counts[sum][lane]))
    });
    let mut totals = [[[0; GROUP]; D]; K];
    for (index, term) in terms {
        let (sum, lane) = place(*index);
        for axis in 0..D {
            totals[sum][axis][lane] += scales[sum][lane].truncate(term[axis]);
        }
    }
    std::array::from_fn(|sum| {
        let value = |axis: usize, lane: usize| scales[sum][lane].value(totals[sum][axis][lane]);
        std::array::from_fn(|axis| std::array::from_fn(|lane| value(axis, lane)))
    })
}

/// The sums if neighbors are determined by distances and fields of view, for dispatch to an instruction set.
struct SumOffsets<'a, 'b, const D: usize> {
    pairs: &'a Pairs<'b, D>,
    group: usize,
    scale: Scale,
    range: f64,
    sums: &'a mut [Column<i64>; D],
    buffers: &'a mut OffsetBuffers<D>,
}

impl<const D: usize> WithSimd for SumOffsets<'_, '_, D> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let options = self.pairs.options;
        let is_blind = options.field_of_view != FieldOfView::ALL_ROUND;
        match (options.torus, is_blind) {
            (Torus::NONE, false) => self.sum::<S, false>(simd, Torus::NONE),
            (torus, false) => self.sum::<S, false>(simd, torus),
            (torus, true) => self.sum::<S, true>(simd, torus),
        }
    }
}

impl<const D: usize> SumOffsets<'_, '_, D> {
    /// Computes the sums. `IS_BLIND`: whether agents have a blind sector.
    #[inline(always)]
    fn sum<S: Simd, const IS_BLIND: bool>(self, simd: S, torus: Torus) {
        let (agents, group, scale) = (self.pairs.agents, self.group, self.scale);
        let search = Search {
            agents,
            tree: self.pairs.tree,
            torus,
            reaches: Reaches::Squares(self.pairs.squares),
            margin: 0.0,
            is_each: true,
        };
        let OffsetBuffers {
            candidates, terms, ..
        } = self.buffers;
        candidates.clear();
        let (squares, view) = (&self.pairs.squares[group], self.pairs.options.field_of_view);
        candidates.find(simd, search, group, squares);
        let farthest = simd.splat_f64s(self.range * self.range);
        for start in (0..agents.ids_of(group).len()).step_by(S::F64_LANES) {
            let own =
                Own::<S, D>::load::<IS_BLIND>(simd, &agents.groups[group], squares, view, start);
            let mut sum = [simd.splat_u64s(0); D];
            for &place in candidates.of(0, start / LEAF).across {
                let (offset, is_neighbor) =
                    own.senses::<IS_BLIND>(simd, torus, &agents.position(place as usize));
                for axis in 0..D {
                    let added =
                        simd.add_u64s(sum[axis], scale.quantize_register(simd, offset[axis]));
                    sum[axis] = simd.select_u64s(is_neighbor, added, sum[axis]);
                }
                let is_close = simd.less_than_or_equal_f64s(register_norm(simd, offset), farthest);
                let mut close = bits(simd, simd.and_m64s(is_neighbor, is_close));
                while close != 0 {
                    let lane = close.trailing_zeros() as usize;
                    close &= close - 1;
                    let offset = offset.map(|register| cast_slice::<_, f64>(&[register])[lane]);
                    push_close(terms, start + lane, offset, self.range);
                }
            }
            for axis in 0..D {
                self.sums[axis][own.lanes()].copy_from_slice(lanes(&sum[axis]));
            }
        }
    }
}
