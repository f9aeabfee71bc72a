//! `GroupRows`: the observation rows of the agents of one group.

use std::fmt::Display;

use multiversion::multiversion;

use crate::agents::{Column, FANOUT, LEAF};
use crate::base::entry::{Row, clamped};

/// Number of entries of a row that are written together.
const BLOCK: usize = 8;

/// The rows of the agents of one group, for each leaf column by column.
pub(super) struct GroupRows {
    /// Number of entries of a row.
    length: usize,
    /// Number of entries that were added.
    added: usize,
    /// Entry e of leaf t is `leaves[t * length + e]`, with one lane per agent.
    leaves: Vec<[f32; LEAF]>,
}

impl Row<&Column<f64>> for GroupRows {
    #[inline(always)]
    fn push(&mut self, _name: impl Display, _axis: &str, _low: f32, values: &Column<f64>) {
        for leaf in 0..FANOUT {
            self.leaves[leaf * self.length + self.added] =
                std::array::from_fn(|lane| clamped(values[leaf * LEAF + lane]));
        }
        self.added += 1;
    }
}

impl GroupRows {
    /// Creates rows of at least [`BLOCK`] entries.
    pub(super) fn new(length: usize) -> Self {
        Self {
            length,
            added: 0,
            leaves: vec![[0.0; LEAF]; FANOUT * length],
        }
    }

    /// Writes the rows of the agents with these `ids` to `out`, and begins the rows of the next group.
    pub(super) fn flush(&mut self, ids: &[u32], out: &mut [f32]) {
        debug_assert_eq!(self.added, self.length);
        self.added = 0;
        transpose(&self.leaves, self.length, ids, out);
    }
}

/// Transposes leaves, as in [`GroupRows`], and writes them to the rows of the agents with these `ids`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn transpose(leaves: &[[f32; LEAF]], length: usize, ids: &[u32], out: &mut [f32]) {
    for (leaf, ids) in leaves.chunks_exact(length).zip(ids.chunks(LEAF)) {
        for first in (0..length).step_by(BLOCK) {
            // The last block overlaps the one before if it would not be full.
            let first = first.min(length - BLOCK);
            let Some(block) = leaf[first..].first_chunk::<BLOCK>() else {
                continue;
            };
            let rows: [[f32; BLOCK]; LEAF] =
                std::array::from_fn(|lane| std::array::from_fn(|entry| block[entry][lane]));
            for (row, id) in rows.iter().zip(ids) {
                out[*id as usize * length + first..][..BLOCK].copy_from_slice(row);
            }
        }
    }
}

/// Maps a length or speed x >= 0 to x / (x + `scale`), in [0, 1).
#[inline(always)]
pub(super) fn squash(value: f64, scale: f64) -> f64 {
    if value.is_finite() {
        value / (value + scale)
    } else {
        1.0
    }
}
