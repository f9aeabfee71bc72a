//! `Terms`: the contributions of close neighbors to the separation force on the agents of one tile, and their exact
//! sums.
//!
//! Weights of close neighbors differ by many orders of magnitude, so the scale of an agent's sum follows from its
//! largest term. All terms are therefore collected before they are added.

use bytemuck::cast_slice;
use pulp::{Arch, Simd, WithSimd};

use crate::agents::{Column, FANOUT, GROUP, TILE};
use crate::base::exact::{Scale, truncated_parts, whole};
use crate::neighbor::engine::select::TileColumn;

/// Terms in 1/m, row by row. A row has at most one term of every agent, and 0 for the others.
#[derive(Debug, Clone)]
pub(super) struct Terms<const D: usize> {
    rows: Vec<[TileColumn<f64>; D]>,
    /// Number of terms of every agent.
    pub(super) counts: TileColumn<i64>,
}

impl<const D: usize> Default for Terms<D> {
    fn default() -> Self {
        Self {
            rows: Vec::new(),
            counts: [0; TILE],
        }
    }
}

impl<const D: usize> Terms<D> {
    /// Returns the memory in bytes.
    pub(super) fn bytes(&self) -> usize {
        self.rows.capacity() * size_of::<[TileColumn<f64>; D]>()
    }

    pub(super) fn clear(&mut self) {
        self.rows.clear();
        self.counts = [0; TILE];
    }

    /// Makes room for `count` rows, so that steps stop allocating once all agents have been candidates.
    pub(super) fn reserve(&mut self, count: usize) {
        self.rows.reserve(count);
    }

    /// Adds a term of one agent.
    pub(super) fn push(&mut self, agent: usize, term: [f64; D]) {
        let row = self.row(self.counts[agent] as usize);
        for axis in 0..D {
            row[axis][agent] = term[axis];
        }
        self.counts[agent] += 1;
    }

    /// Returns a row; a new one if `index` is the number of rows.
    #[inline(always)]
    pub(super) fn row(&mut self, index: usize) -> &mut [TileColumn<f64>; D] {
        if index == self.rows.len() {
            self.rows.push([[0.0; TILE]; D]);
        }
        &mut self.rows[index]
    }
}

/// Returns the sums of the terms of all agents of a group. They do not depend on the order of the terms.
pub(super) fn sum_terms<const D: usize>(tiles: &[Terms<D>; FANOUT]) -> [Column<f64>; D] {
    Arch::new().dispatch(SumTerms { tiles })
}

/// The argument of [`sum_terms`], for dispatch to an instruction set.
struct SumTerms<'a, const D: usize> {
    tiles: &'a [Terms<D>; FANOUT],
}

impl<const D: usize> WithSimd for SumTerms<'_, D> {
    type Output = [Column<f64>; D];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let zero = simd.splat_f64s(0.0);
        let mut sums = [[0.0; GROUP]; D];
        for (tile, Terms { rows, counts }) in self.tiles.iter().enumerate() {
            if rows.is_empty() {
                continue;
            }
            for register in 0..TILE / S::F64_LANES {
                let mut largest = zero;
                for row in rows {
                    for column in row {
                        let term = S::as_simd_f64s(column).0[register];
                        let size = simd.max_f64s(term, simd.sub_f64s(zero, term));
                        largest = simd.max_f64s(largest, size);
                    }
                }
                let largest: &[f64] = cast_slice(std::slice::from_ref(&largest));
                let (mut scales, mut up) = ([Scale::new(0.0, 1); TILE], [0.0; TILE]);
                let first = register * S::F64_LANES;
                for lane in 0..S::F64_LANES {
                    scales[lane] = Scale::new(largest[lane], counts[first + lane] as usize);
                    up[lane] = scales[lane].units_of_one();
                }
                let up = S::as_simd_f64s(&up).0[0];
                let mut parts = [[zero; 2]; D];
                for row in rows {
                    for axis in 0..D {
                        let term = S::as_simd_f64s(&row[axis]).0[register];
                        let [high, low] = truncated_parts(simd, simd.mul_f64s(term, up));
                        let sum = parts[axis];
                        parts[axis] = [simd.add_f64s(sum[0], high), simd.add_f64s(sum[1], low)];
                    }
                }
                for axis in 0..D {
                    let [high, low]: [&[f64]; 2] = [
                        cast_slice(std::slice::from_ref(&parts[axis][0])),
                        cast_slice(std::slice::from_ref(&parts[axis][1])),
                    ];
                    for lane in 0..S::F64_LANES {
                        let units = whole([high[lane], low[lane]]);
                        sums[axis][tile * TILE + first + lane] = scales[lane].value(units);
                    }
                }
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Returns the sum of one agent's terms, by definition.
    fn sum(terms: &[f64], scale: Scale) -> f64 {
        scale.value(terms.iter().map(|term| scale.truncate(*term)).sum())
    }

    proptest! {
        #[test]
        fn equals_sums_of_truncated_terms(
            terms in prop::collection::vec(
                (0..TILE, prop::array::uniform2(-1.0..1.0_f64), -60..3_i32),
                0..200,
            ),
            magnitude in -100..100_i32,
        ) {
            let mut tiles: [Terms<2>; FANOUT] = Default::default();
            let mut columns: TileColumn<[Vec<f64>; 2]> = std::array::from_fn(|_| [const { Vec::new() }; 2]);
            for (agent, mantissas, exponent) in terms {
                let term = mantissas.map(|mantissa| mantissa * 2f64.powi(exponent + magnitude));
                tiles[3].push(agent, term);
                for axis in 0..2 {
                    columns[agent][axis].push(term[axis]);
                }
            }
            let mut found = vec![
                pulp::Scalar::new().vectorize(SumTerms { tiles: &tiles }),
                sum_terms(&tiles),
            ];
            #[cfg(target_arch = "x86_64")]
            if let Some(simd) = pulp::x86::V3::try_new() {
                found.push(Simd::vectorize(simd, SumTerms { tiles: &tiles }));
            }
            for (agent, columns) in columns.iter().enumerate() {
                let largest = columns.iter().flatten().fold(0.0, |l: f64, term| l.max(term.abs()));
                let scale = Scale::new(largest, columns[0].len());
                for axis in 0..2 {
                    for found in &found {
                        prop_assert_eq!(found[axis][3 * TILE + agent], sum(&columns[axis], scale));
                    }
                }
            }
        }
    }
}
