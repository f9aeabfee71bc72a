//! Maps from the outputs of networks to ranges.

/// A linear map from actions in [-1, 1] to ranges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalizedRange {
    /// Range in m of the action -1.
    pub min_range: f64,
    /// Range in m of the action 1.
    pub max_range: f64,
}

impl NormalizedRange {
    /// Returns the range in m of an action in [-1, 1].
    #[must_use]
    pub fn of(&self, action: f64) -> f64 {
        self.min_range + (action + 1.0) / 2.0 * (self.max_range - self.min_range)
    }
}

/// The ranges that networks can set.
#[derive(Debug, Clone)]
pub enum NetworkRanges {
    /// The output is a normalized action.
    Normalized(NormalizedRange),
    /// The output is the score of a candidate. The numbers are the ranges in m that the candidates set.
    Candidates(Vec<f64>),
}
