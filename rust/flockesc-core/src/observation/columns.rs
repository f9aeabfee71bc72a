//! Tables of observation entries whose values are columns: one value for every agent of a group.

use multiversion::multiversion;

use super::table::{Entries, Table};
use crate::agents::{Column, FANOUT, GROUP, TILE};

/// Number of entries of a row that are written together.
const BLOCK: usize = 8;

/// A visitor of the entries of the rows of one group, as [`Table`] is one of a single row.
pub(super) trait ColumnTable<S> {
    /// Adds numbers from `low` to 1.
    fn numbers(&mut self, name: &str, low: f32, values: impl Fn(&S) -> &Column<f64>);

    /// Adds the coordinates of vectors of norm at most 1.
    fn vectors<const D: usize>(&mut self, name: &str, values: impl Fn(&S) -> &[Column<f64>; D]);

    /// Begins the entries of the k-th candidate range.
    fn begin_candidate(&mut self, k: usize);
}

impl<S> ColumnTable<S> for Entries {
    fn numbers(&mut self, name: &str, low: f32, _values: impl Fn(&S) -> &Column<f64>) {
        Table::<()>::number(self, name, low, |()| 0.0);
    }

    fn vectors<const D: usize>(&mut self, name: &str, _values: impl Fn(&S) -> &[Column<f64>; D]) {
        Table::<()>::vector(self, name, |()| [0.0; D]);
    }

    fn begin_candidate(&mut self, k: usize) {
        Table::<()>::begin_candidate(self, k);
    }
}

/// The entries of the rows of one group, for each tile column by column.
#[derive(Debug)]
pub(super) struct GroupRows {
    /// Number of entries of a row.
    length: usize,
    /// Number of entries that were added.
    added: usize,
    /// Entry e of tile t is `tiles[t * length + e]`, with one lane per agent.
    tiles: Vec<[f32; TILE]>,
}

impl GroupRows {
    /// Creates rows of at least [`BLOCK`] entries.
    pub(super) fn new(length: usize) -> Self {
        Self {
            length,
            added: 0,
            tiles: vec![[0.0; TILE]; FANOUT * length],
        }
    }

    /// Adds an entry, clamped to [-1, 1] because rounding may exceed the bounds.
    #[inline(always)]
    fn push(&mut self, values: &Column<f64>) {
        for tile in 0..FANOUT {
            self.tiles[tile * self.length + self.added] =
                std::array::from_fn(|lane| values[tile * TILE + lane].clamp(-1.0, 1.0) as f32);
        }
        self.added += 1;
    }

    /// Writes the rows of the agents with these `ids` to `out`, and begins the rows of the next group.
    pub(super) fn flush(&mut self, ids: &[u32], out: &mut [f32]) {
        debug_assert_eq!(self.added, self.length);
        self.added = 0;
        write(&self.tiles, self.length, ids, out);
    }
}

/// Transposes tiles, as in [`GroupRows`], and writes them to the rows of the agents with these `ids`.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn write(tiles: &[[f32; TILE]], length: usize, ids: &[u32], out: &mut [f32]) {
    for (tile, ids) in tiles.chunks_exact(length).zip(ids.chunks(TILE)) {
        for first in (0..length).step_by(BLOCK) {
            // The last block overlaps the one before if it would not be full.
            let first = first.min(length - BLOCK);
            let Some(block) = tile[first..].first_chunk::<BLOCK>() else {
                continue;
            };
            let rows: [[f32; BLOCK]; TILE] =
                std::array::from_fn(|lane| std::array::from_fn(|entry| block[entry][lane]));
            for (row, id) in rows.iter().zip(ids) {
                out[*id as usize * length + first..][..BLOCK].copy_from_slice(row);
            }
        }
    }
}

/// Adds the entries of features to the rows of a group.
#[derive(Debug)]
pub(super) struct Rows<'a, S> {
    pub(super) features: &'a S,
    pub(super) rows: &'a mut GroupRows,
}

impl<S> ColumnTable<S> for Rows<'_, S> {
    #[inline(always)]
    fn numbers(&mut self, _name: &str, _low: f32, values: impl Fn(&S) -> &Column<f64>) {
        self.rows.push(values(self.features));
    }

    #[inline(always)]
    fn vectors<const D: usize>(&mut self, _name: &str, values: impl Fn(&S) -> &[Column<f64>; D]) {
        for column in values(self.features) {
            self.rows.push(column);
        }
    }

    fn begin_candidate(&mut self, _k: usize) {}
}

/// Computes the coordinates of vectors in the agents' body frames with these `axes`.
#[inline(always)]
pub(super) fn put_in_frames<const D: usize>(
    axes: &[[Column<f64>; D]; D],
    vectors: &[Column<f64>; D],
    coordinates: &mut [Column<f64>; D],
) {
    for k in 0..D {
        for lane in 0..GROUP {
            let first = axes[k][0][lane] * vectors[0][lane];
            coordinates[k][lane] = (1..D).fold(first, |sum, axis| {
                sum + axes[k][axis][lane] * vectors[axis][lane]
            });
        }
    }
}
