//! The metrics of an episode.

use super::{Episode, Running};
use crate::reward::Objective;

/// Metrics of one episode, as the environments' `info` reports them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metrics {
    /// The values of all objectives, in the order of [`Objective`].
    pub objectives: [Running; Objective::COUNT],
    /// Norm of the mean heading.
    pub polarization: f64,
}

impl Metrics {
    /// Returns the metrics of an episode.
    #[must_use]
    pub fn of<const D: usize>(episode: &Episode<D>) -> Self {
        Self {
            objectives: episode.objectives,
            polarization: episode.polarization(),
        }
    }
}
