//! Names and bounds of observation entries.

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
