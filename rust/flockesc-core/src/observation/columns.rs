//! Tables of observation entries whose values are columns: one value for every agent of a group.

use multiversion::multiversion;

use super::table::{Entries, Table};
use crate::agents::{Column, GROUP};

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

/// The entries of the rows of one group, column by column.
#[derive(Debug)]
pub(super) struct Rows<'a, S> {
    features: &'a S,
    out: &'a mut Vec<Column<f32>>,
    /// Number of columns so far.
    count: usize,
}

impl<'a, S> Rows<'a, S> {
    /// Replaces the columns in `out`. It may have columns of another group.
    pub(super) fn new(features: &'a S, out: &'a mut Vec<Column<f32>>) -> Self {
        Self {
            features,
            out,
            count: 0,
        }
    }

    fn push(&mut self, values: &Column<f64>) {
        if self.count == self.out.len() {
            self.out.push([0.0; GROUP]);
        }
        clamp(values, &mut self.out[self.count]);
        self.count += 1;
    }
}

impl<S> ColumnTable<S> for Rows<'_, S> {
    fn numbers(&mut self, _name: &str, _low: f32, values: impl Fn(&S) -> &Column<f64>) {
        self.push(values(self.features));
    }

    fn vectors<const D: usize>(&mut self, _name: &str, values: impl Fn(&S) -> &[Column<f64>; D]) {
        for column in values(self.features) {
            self.push(column);
        }
    }

    fn begin_candidate(&mut self, _k: usize) {}
}

/// Clamps values to [-1, 1] because rounding may exceed the bounds.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2"))]
fn clamp(values: &Column<f64>, out: &mut Column<f32>) {
    for lane in 0..GROUP {
        out[lane] = values[lane].clamp(-1.0, 1.0) as f32;
    }
}
