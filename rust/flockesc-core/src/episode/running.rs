//! A value over an episode, and its running minimum.

use serde::{Deserialize, Serialize};

/// One distance over an episode, in m; or the share of agents that were not caught.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Running {
    /// Value at t = 0.
    pub start: f64,
    /// Value now.
    pub now: f64,
    /// Smallest value so far; at the horizon, the objective.
    pub minimum: f64,
}

impl Running {
    pub(super) fn new(value: f64) -> Self {
        Self {
            start: value,
            now: value,
            minimum: value,
        }
    }

    pub(super) fn update(&mut self, value: f64) {
        self.now = value;
        self.minimum = self.minimum.min(value);
    }
}
