//! The metrics of an episode.

use super::Episode;

/// Metrics of one episode, as the environments' `info` reports them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metrics {
    /// Mean predator distance in the current step, in m.
    pub mean_distance: f64,
    /// Minimum predator distance in the current step, in m.
    pub min_distance: f64,
    /// Smallest mean predator distance so far, in m.
    pub min_mean_distance: f64,
    /// Smallest minimum predator distance so far, in m.
    pub min_min_distance: f64,
    /// Norm of the mean heading.
    pub polarization: f64,
    /// Fraction of the agents that were not caught.
    pub fraction_surviving: f64,
}

impl Metrics {
    /// Returns the metrics of an episode.
    #[must_use]
    pub fn of<const D: usize>(episode: &Episode<D>) -> Self {
        Self {
            mean_distance: episode.mean_distance().now,
            min_distance: episode.min_distance().now,
            min_mean_distance: episode.mean_distance().minimum,
            min_min_distance: episode.min_distance().minimum,
            polarization: episode.polarization(),
            fraction_surviving: episode.fraction_surviving().now,
        }
    }
}
