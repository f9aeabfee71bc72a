//! Entries of observations: a visitor that collects names and bounds or writes values.

use std::fmt::Display;

/// Name and bounds of one entry of an observation.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Name, as in docs/model.md.
    pub name: String,
    /// Smallest value.
    pub low: f32,
    /// Largest value.
    pub high: f32,
}

/// Suffixes of a vector's coordinates.
const AXES: [&str; 3] = ["_ahead", "_left", "_up"];

/// A visitor of the entries of a row, in order. A value `V` is a number, or a column with one number per agent.
pub(crate) trait Row<V> {
    /// Adds an entry from `low` to 1. Its name is `name` followed by `axis`.
    fn push(&mut self, name: impl Display, axis: &str, low: f32, value: V);

    /// Begins the entries of the k-th candidate range.
    fn begin_candidate(&mut self, _k: usize) {}

    /// Adds a number from `low` to 1.
    #[inline(always)]
    fn number(&mut self, name: impl Display, low: f32, value: V) {
        self.push(name, "", low, value);
    }

    /// Adds the coordinates of a vector of norm at most 1.
    #[inline(always)]
    fn vector<const D: usize>(&mut self, name: &str, coordinates: [V; D]) {
        for (axis, coordinate) in AXES.into_iter().zip(coordinates) {
            self.push(name, axis, -1.0, coordinate);
        }
    }
}

/// Collects names and bounds.
#[derive(Debug, Default)]
pub(crate) struct Entries {
    pub(crate) entries: Vec<Entry>,
    /// What the names begin with.
    prefix: String,
}

impl<V> Row<V> for Entries {
    fn push(&mut self, name: impl Display, axis: &str, low: f32, _value: V) {
        let (name, high) = (format!("{}{name}{axis}", self.prefix), 1.0);
        self.entries.push(Entry { name, low, high });
    }

    fn begin_candidate(&mut self, k: usize) {
        self.prefix = format!("profile_{k}_");
    }
}

/// Writes the numbers of one row.
pub(crate) struct Numbers<'a>(pub(crate) std::slice::IterMut<'a, f32>);

impl Row<f64> for Numbers<'_> {
    #[inline(always)]
    fn push(&mut self, _name: impl Display, _axis: &str, _low: f32, value: f64) {
        if let Some(entry) = self.0.next() {
            *entry = clamped(value);
        }
    }
}

impl Row<f64> for Vec<f32> {
    fn push(&mut self, _name: impl Display, _axis: &str, _low: f32, value: f64) {
        Self::push(self, clamped(value));
    }
}

/// Returns a value within the bounds, which rounding may exceed.
#[inline(always)]
pub(crate) fn clamped(value: f64) -> f32 {
    value.clamp(-1.0, 1.0) as f32
}
