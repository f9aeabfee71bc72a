//! `Scene`: the state of an episode that observations are computed from.

use std::sync::OnceLock;

use super::table::squash;
use super::{Extras, SensingRange};
use crate::flock::{FlockConfig, Summary, World};
use crate::reward::Objective;

/// The input of observations.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scene<'a, const D: usize> {
    pub(crate) world: &'a World<D>,
    pub(crate) summary: &'a OnceLock<Summary<D>>,
    pub(crate) objective: Objective,
    /// Running minimum of the objective's value.
    pub(crate) minimum: f64,
    /// Ranges of the last action in m: one, or one per agent.
    pub(crate) ranges: &'a [f64],
    /// Largest range of an action in m.
    pub(crate) max_range: f64,
    /// Distance up to which agents sense predators. `None` is an infinite distance.
    pub(crate) sensing_range: Option<SensingRange>,
    /// The optional entries.
    pub(crate) extras: Extras<'a>,
    /// Number of steps so far.
    pub(crate) step: usize,
}

impl<'a, const D: usize> Scene<'a, D> {
    pub(super) fn scenario(&self) -> &'a FlockConfig {
        self.world.config()
    }

    /// Returns the averages over the flock.
    pub(crate) fn summary(&self) -> &'a Summary<D> {
        self.summary.get_or_init(|| Summary::of(self.world))
    }

    /// Returns the distance in m up to which a predator is sensed.
    pub(super) fn sensing_length(&self) -> f64 {
        self.sensing_range
            .map_or(f64::INFINITY, |range| range.length(self.scenario()))
    }

    /// Returns whether an agent senses a predator at this distance in m.
    pub(super) fn is_sensed(&self, distance: f64) -> bool {
        distance <= self.sensing_length()
    }

    /// Returns the elapsed fraction of the episode.
    pub(super) fn time(&self) -> f64 {
        self.step as f64 / self.scenario().num_steps as f64
    }

    /// Returns the objective's running minimum; distances are scaled to [0, 1).
    pub(super) fn running_minimum(&self) -> f64 {
        match self.objective {
            Objective::Mean | Objective::Minimum => squash(self.minimum, self.length()),
            Objective::Survival => self.minimum,
        }
    }

    /// Returns the mean range of the last action in m.
    pub(super) fn mean_range(&self) -> f64 {
        self.ranges.iter().sum::<f64>() / self.ranges.len() as f64
    }

    /// Returns the scale of lengths in m.
    pub(super) fn length(&self) -> f64 {
        self.scenario().initial_side
    }

    /// Returns the scale of speeds in m/s.
    pub(super) fn speed(&self) -> f64 {
        self.scenario().speed.largest()
    }
}
