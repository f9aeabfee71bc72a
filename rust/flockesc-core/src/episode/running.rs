//! Running minimum of a value over an episode.

use serde::{Deserialize, Serialize};

/// A value over an episode: a predator distance in m, or the fraction of the agents that were not caught.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Running {
    /// Value at t = 0.
    pub start: f64,
    /// Current value.
    pub now: f64,
    /// Smallest value so far. At the horizon it is the objective J.
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
