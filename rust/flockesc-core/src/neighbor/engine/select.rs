//! The k-th smallest number of every column of a table with one column per agent of a tile.

use pulp::{Arch, Simd, WithSimd};

use crate::agents::TILE;
use crate::base::vector::{larger, smaller};
use crate::neighbor::engine::reach::bits;

/// One value for every agent of a tile.
pub(in crate::neighbor) type TileColumn<T> = [T; TILE];

/// Returns the second smallest number of every column.
#[inline(always)]
pub(in crate::neighbor) fn second_smallest(rows: &[TileColumn<f64>]) -> TileColumn<f64> {
    let (mut first, mut second) = ([f64::INFINITY; TILE], [f64::INFINITY; TILE]);
    for row in rows {
        for agent in 0..TILE {
            second[agent] = smaller(second[agent], larger(first[agent], row[agent]));
            first[agent] = smaller(first[agent], row[agent]);
        }
    }
    second
}

/// Returns the number of every column at the index `indices` of its sorted order, or a number above `limit` if it is
/// above `limit`. Numbers are at least 0. The search starts at `guess`.
pub(in crate::neighbor) fn nth_smallest(
    rows: &[TileColumn<f64>],
    indices: &TileColumn<usize>,
    limit: f64,
    guess: &TileColumn<f64>,
) -> TileColumn<f64> {
    Arch::new().dispatch(NthSmallest {
        rows,
        indices,
        limit,
        guess,
    })
}

/// The arguments of [`nth_smallest`], for dispatch to an instruction set.
struct NthSmallest<'a> {
    rows: &'a [TileColumn<f64>],
    indices: &'a TileColumn<usize>,
    limit: f64,
    guess: &'a TileColumn<f64>,
}

impl WithSimd for NthSmallest<'_> {
    type Output = TileColumn<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let indices = self.indices.map(|index| index as f64);
        let mut results = [0.0; TILE];
        for register in 0..TILE / S::F64_LANES {
            let indices = S::as_simd_f64s(&indices).0[register];
            let guess = S::as_simd_f64s(self.guess).0[register];
            let result = self.search(simd, register, indices, guess);
            S::as_mut_simd_f64s(&mut results).0[register] = result;
        }
        results
    }
}

impl NthSmallest<'_> {
    /// Searches the columns of one register. Halves the intervals from `low` to `high` that contain the results. Both
    /// ends are numbers of the column, so that equal numbers end the search.
    #[inline(always)]
    fn search<S: Simd>(
        &self,
        simd: S,
        register: usize,
        indices: S::f64s,
        guess: S::f64s,
    ) -> S::f64s {
        let (zero, one, half) = (
            simd.splat_f64s(0.0),
            simd.splat_f64s(1.0),
            simd.splat_f64s(0.5),
        );
        let (infinity, limit) = (simd.splat_f64s(f64::INFINITY), simd.splat_f64s(self.limit));
        let (mut low, mut high, mut pivot) = (zero, infinity, simd.min_f64s(guess, limit));
        loop {
            let (mut count, mut below, mut above) = (zero, zero, infinity);
            for row in self.rows {
                let number = S::as_simd_f64s(row).0[register];
                let is_below = simd.less_than_or_equal_f64s(number, pivot);
                count = simd.select_f64s(is_below, simd.add_f64s(count, one), count);
                below = simd.max_f64s(below, simd.select_f64s(is_below, number, zero));
                above = simd.min_f64s(above, simd.select_f64s(is_below, infinity, number));
            }
            let is_high = simd.less_than_f64s(indices, count);
            high = simd.select_f64s(is_high, below, high);
            low = simd.select_f64s(is_high, low, above);
            // A result above the limit is not searched for.
            high = simd.select_f64s(simd.less_than_f64s(limit, low), low, high);
            if bits(simd, simd.less_than_f64s(low, high)) == 0 {
                return high;
            }
            let middle = simd.add_f64s(low, simd.mul_f64s(half, simd.sub_f64s(high, low)));
            // Rounding may move the middle of neighboring numbers to the upper one.
            let middle = simd.select_f64s(simd.less_than_f64s(middle, high), middle, low);
            pivot = simd.select_f64s(simd.less_than_f64s(limit, high), limit, middle);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Few different numbers, so that many are equal, and numbers above the limit.
        #[test]
        fn equals_the_sorted_columns(
            rows in prop::collection::vec(
                prop::array::uniform8(prop_oneof![
                    (0..9_u8).prop_map(f64::from),
                    0.0..9.0_f64,
                    Just(f64::INFINITY),
                ]),
                2..60,
            ),
            indices in prop::array::uniform8(0..60_usize),
            limit in prop_oneof![0.0..9.0_f64, Just(f64::MAX)],
            guess in prop::array::uniform8(prop_oneof![Just(0.0), 0.0..9.0_f64, Just(f64::MAX)]),
        ) {
            let indices = indices.map(|index| index % rows.len());
            let expected: TileColumn<Vec<f64>> = std::array::from_fn(|agent| {
                let mut column: Vec<f64> = rows.iter().map(|row| row[agent]).collect();
                column.sort_by(f64::total_cmp);
                column
            });
            let search = || NthSmallest { rows: &rows, indices: &indices, limit, guess: &guess };
            let mut found = vec![pulp::Scalar::new().vectorize(search()), Arch::new().dispatch(search())];
            #[cfg(target_arch = "x86_64")]
            if let Some(simd) = pulp::x86::V3::try_new() {
                found.push(Simd::vectorize(simd, search()));
            }
            for agent in 0..TILE {
                prop_assert_eq!(second_smallest(&rows)[agent], expected[agent][1]);
                let number = expected[agent][indices[agent]];
                for found in &found {
                    let is_right = found[agent] == number || (found[agent] > limit && number > limit);
                    prop_assert!(is_right, "{} instead of {}", found[agent], number);
                }
            }
        }
    }
}
