//! The SIMD kernel of the sums of the offsets to all neighbors, if neighbors are determined by distances and
//! fields of view.

use pulp::{Arch, Simd, WithSimd};

use crate::agents::{Column, GROUP, TILE};
use crate::base::exact::Scale;
use crate::neighbor::engine::candidates::{Candidates, Search};
use crate::neighbor::engine::field_of_view::FieldOfView;
use crate::neighbor::engine::own::{Own, lanes};

/// Returns the sums of one group in units of `scale`. The search must list each candidate.
pub(super) fn sum_offsets<const D: usize>(
    search: Search<'_, D>,
    field_of_view: FieldOfView,
    scale: Scale,
    group: usize,
    candidates: &mut Candidates,
) -> [Column<i64>; D] {
    Arch::new().dispatch(SumOffsets {
        search,
        field_of_view,
        scale,
        group,
        candidates,
    })
}

struct SumOffsets<'a, const D: usize> {
    search: Search<'a, D>,
    field_of_view: FieldOfView,
    scale: Scale,
    group: usize,
    candidates: &'a mut Candidates,
}

impl<const D: usize> WithSimd for SumOffsets<'_, D> {
    type Output = [Column<i64>; D];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self {
            search,
            field_of_view,
            scale,
            group,
            candidates,
        } = self;
        candidates.clear();
        candidates.find(simd, search, group);
        let ids = search.agents.ids_of(group);
        let (mut squared, mut sums) = ([0.0; GROUP], [[0; GROUP]; D]);
        search.reaches.square(group, ids, &mut squared);
        let agents = &search.agents.groups[group];
        let rows = search.tree.agents.as_flattened();
        for tile in 0..ids.len().div_ceil(TILE) {
            let candidates = candidates.of(0, tile);
            for start in (tile * TILE..(tile + 1) * TILE).step_by(S::F64_LANES) {
                let own = Own::<S, D>::load::<true>(simd, agents, &squared, field_of_view, start);
                let zero = simd.splat_u64s(0);
                let mut sum = [zero; D];
                for &place in candidates.across {
                    let (offset, is_neighbor) =
                        own.senses::<true>(simd, &rows[place as usize].position);
                    for axis in 0..D {
                        let added =
                            simd.add_u64s(sum[axis], scale.quantize_register(simd, offset[axis]));
                        sum[axis] = simd.select_u64s(is_neighbor, added, sum[axis]);
                    }
                }
                for axis in 0..D {
                    sums[axis][own.lanes()].copy_from_slice(lanes(&sum[axis]));
                }
            }
        }
        sums
    }
}
