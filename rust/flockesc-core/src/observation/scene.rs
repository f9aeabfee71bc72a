//! What observations are made from.

use super::SensingRange;
use super::table::squash;
use crate::flock::{FlockConfig, Summary, World};
use crate::reward::Objective;

/// A flock at one moment of an episode.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scene<'a, const D: usize> {
    pub(crate) world: &'a World<D>,
    pub(crate) summary: &'a Summary<D>,
    pub(crate) objective: Objective,
    /// Running minimum of the objective's value.
    pub(crate) minimum: f64,
    /// Ranges of the last action in m: one, or one per agent.
    pub(crate) ranges: &'a [f64],
    /// In m.
    pub(crate) max_range: f64,
    /// `None`: predators are seen from any distance.
    pub(crate) sensing_range: Option<SensingRange>,
    /// Steps made.
    pub(crate) step: usize,
}

impl<'a, const D: usize> Scene<'a, D> {
    pub(super) fn scenario(&self) -> &'a FlockConfig {
        self.world.config()
    }

    /// Distance in m up to which a predator is seen.
    pub(super) fn sensing_length(&self) -> f64 {
        self.sensing_range
            .map_or(f64::INFINITY, |range| range.length(self.scenario()))
    }

    /// Whether a predator is seen from this distance in m.
    pub(super) fn is_sensed(&self, distance: f64) -> bool {
        distance <= self.sensing_length()
    }

    /// The elapsed share of the episode.
    pub(super) fn time(&self) -> f64 {
        self.step as f64 / self.scenario().num_steps as f64
    }

    /// The running minimum: of a distance, scaled, or of the share of agents that were not caught.
    pub(super) fn running_minimum(&self) -> f64 {
        match self.objective {
            Objective::Mean | Objective::Minimum => squash(self.minimum, self.length()),
            Objective::Survival => self.minimum,
        }
    }

    /// Scale of lengths in m.
    pub(super) fn length(&self) -> f64 {
        self.scenario().initial_side
    }

    /// Scale of speeds in m/s.
    pub(super) fn speed(&self) -> f64 {
        self.scenario().speed.largest()
    }
}
