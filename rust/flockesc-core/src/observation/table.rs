//! Tables of observation entries. Each entry is defined once, with name, lower bound and value.

use crate::base::entry::Entry;

/// Suffixes of a vector's coordinates.
const AXES: [&str; 3] = ["ahead", "left", "up"];

/// A visitor of the entries of a row. It collects their names and bounds, or computes their values
/// from the features `S`.
pub(super) trait Table<S> {
    /// Adds a number from `low` to 1.
    fn number(&mut self, name: &str, low: f32, value: impl Fn(&S) -> f64);

    /// Adds the coordinates of a vector of norm at most 1.
    fn vector<const D: usize>(&mut self, name: &str, value: impl Fn(&S) -> [f64; D]);

    /// Begins the entries of the k-th candidate range.
    fn begin_candidate(&mut self, k: usize);
}

/// Collects names and bounds.
#[derive(Debug, Default)]
pub(super) struct Entries {
    pub(super) entries: Vec<Entry>,
    /// What the names begin with.
    prefix: String,
}

impl Entries {
    fn push(&mut self, name: &str, low: f32) {
        let (name, high) = (format!("{}{name}", self.prefix), 1.0);
        self.entries.push(Entry { name, low, high });
    }
}

impl<S> Table<S> for Entries {
    fn number(&mut self, name: &str, low: f32, _value: impl Fn(&S) -> f64) {
        self.push(name, low);
    }

    fn vector<const D: usize>(&mut self, name: &str, _value: impl Fn(&S) -> [f64; D]) {
        for axis in &AXES[..D] {
            self.push(&format!("{name}_{axis}"), -1.0);
        }
    }

    fn begin_candidate(&mut self, k: usize) {
        self.prefix = format!("profile_{k}_");
    }
}

/// Writes the values of one row.
#[derive(Debug)]
pub(super) struct Row<'a, S> {
    features: &'a S,
    out: std::slice::IterMut<'a, f32>,
}

impl<'a, S> Row<'a, S> {
    pub(super) fn new(features: &'a S, out: &'a mut [f32]) -> Self {
        let out = out.iter_mut();
        Self { features, out }
    }

    /// Returns the values that were not written.
    pub(super) fn rest(self) -> &'a mut [f32] {
        self.out.into_slice()
    }

    /// Writes the next value, clamped to [-1, 1] because rounding may exceed the bounds.
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
        self.push(value(self.features));
    }

    #[inline(always)]
    fn vector<const D: usize>(&mut self, _name: &str, value: impl Fn(&S) -> [f64; D]) {
        for coordinate in value(self.features) {
            self.push(coordinate);
        }
    }

    #[inline(always)]
    fn begin_candidate(&mut self, _k: usize) {}
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
