//! Tables of observation entries: name, lower bound and value together, so that names and values cannot part.

use crate::base::entry::Entry;

/// Suffixes of a vector's coordinates.
const AXES: [&str; 3] = ["ahead", "left", "up"];

/// What becomes of the entries of a row that is made from an `S`: their names, or their values.
pub(super) trait Table<S> {
    /// Adds a number from `low` to 1.
    fn number(&mut self, name: &str, low: f32, value: impl Fn(&S) -> f64);

    /// Adds a vector of norm 1 at most, coordinate by coordinate.
    fn vector<const D: usize>(&mut self, name: &str, value: impl Fn(&S) -> [f64; D]);
}

/// Collects names and bounds.
#[derive(Debug, Default)]
pub(super) struct Entries(pub(super) Vec<Entry>);

impl Entries {
    fn push(&mut self, name: String, low: f32) {
        let high = 1.0;
        self.0.push(Entry { name, low, high });
    }
}

impl<S> Table<S> for Entries {
    fn number(&mut self, name: &str, low: f32, _value: impl Fn(&S) -> f64) {
        self.push(name.to_owned(), low);
    }

    fn vector<const D: usize>(&mut self, name: &str, _value: impl Fn(&S) -> [f64; D]) {
        for axis in &AXES[..D] {
            self.push(format!("{name}_{axis}"), -1.0);
        }
    }
}

/// Writes the values of one row.
#[derive(Debug)]
pub(super) struct Row<'a, S> {
    seen: &'a S,
    out: std::slice::IterMut<'a, f32>,
}

impl<'a, S> Row<'a, S> {
    pub(super) fn new(seen: &'a S, out: &'a mut [f32]) -> Self {
        let out = out.iter_mut();
        Self { seen, out }
    }

    /// Rounding may carry a value out of [-1, 1] by a hair; it is clamped.
    #[inline(always)]
    fn push(&mut self, value: f64) {
        if let Some(slot) = self.out.next() {
            *slot = value.clamp(-1.0, 1.0) as f32;
        }
    }
}

impl<S> Table<S> for Row<'_, S> {
    #[inline(always)]
    fn number(&mut self, _name: &str, _low: f32, value: impl Fn(&S) -> f64) {
        self.push(value(self.seen));
    }

    #[inline(always)]
    fn vector<const D: usize>(&mut self, _name: &str, value: impl Fn(&S) -> [f64; D]) {
        for coordinate in value(self.seen) {
            self.push(coordinate);
        }
    }
}

/// Maps a length or speed of at least 0 onto [0, 1): half at `scale`.
#[inline(always)]
pub(super) fn squash(value: f64, scale: f64) -> f64 {
    if value.is_finite() {
        value / (value + scale)
    } else {
        1.0
    }
}
