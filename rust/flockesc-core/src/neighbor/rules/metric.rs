//! The metric neighbor rule of the paper: neighbors are the agents within the interaction range.

use serde::{Deserialize, Serialize};

use super::rule::{Criterion, Rule};

/// All agents within the interaction range, boundary included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Metric {}

impl Rule for Metric {
    fn criterion(&self) -> Criterion {
        Criterion::Range
    }
}
