//! Which optional entries an observation has.

use serde::{Deserialize, Serialize};
use strum::VariantNames;

/// Optional entries of an observation that are computed from the velocities of the agents and the predators.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, VariantNames)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum ExtraEntries {
    /// The direction away from the place of the predator at its closest approach to the flock.
    EscapeDirection,
    /// Distance and time of the closest approach of the predator.
    ClosestApproach,
}

impl ExtraEntries {
    /// Names of all extra entries in documents.
    pub const KINDS: &[&str] = <Self as VariantNames>::VARIANTS;
}

/// The optional entries of an observation.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Extras<'a> {
    /// Candidate ranges, in ascending order.
    pub(crate) ranges: &'a [f64],
    /// Kinds of further entries.
    pub(crate) entries: &'a [ExtraEntries],
}

impl Extras<'_> {
    pub(super) fn is_empty(self) -> bool {
        self.ranges.is_empty() && self.entries.is_empty()
    }

    pub(super) fn has_escape(self) -> bool {
        self.entries.contains(&ExtraEntries::EscapeDirection)
    }

    pub(super) fn has_approach(self) -> bool {
        self.entries.contains(&ExtraEntries::ClosestApproach)
    }
}
