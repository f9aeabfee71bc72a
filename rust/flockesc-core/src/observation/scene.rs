//! `Scene`: the state of an episode that observations are computed from, and which optional entries they have.

use std::sync::OnceLock;

use serde::{Deserialize, Serialize};
use strum::VariantNames;

use super::row::squash;
use crate::flock::{Summary, World};
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
    pub(crate) sensing_range: Option<f64>,
    /// The optional entries.
    pub(crate) extras: Extras<'a>,
    /// Number of steps so far.
    pub(crate) step: usize,
}

/// The numbers that every row of a flock uses.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Common {
    /// Elapsed fraction of the episode.
    pub(super) time: f64,
    /// The objective's running minimum; distances are scaled to [0, 1).
    pub(super) running_minimum: f64,
    /// Largest range of an action in m.
    pub(super) max_range: f64,
    /// Distance in m up to which a predator is sensed.
    pub(super) sensing_length: f64,
    /// Scale of lengths in m.
    pub(super) length: f64,
    /// Scale of speeds in m/s.
    pub(super) speed: f64,
}

impl<'a, const D: usize> Scene<'a, D> {
    /// Returns the averages over the flock.
    pub(crate) fn summary(&self) -> &'a Summary<D> {
        self.summary.get_or_init(|| Summary::of(self.world))
    }

    pub(super) fn common(&self) -> Common {
        let scenario = self.world.config();
        let length = scenario.initial_side;
        Common {
            time: self.step as f64 / scenario.num_steps as f64,
            running_minimum: if self.objective.is_distance() {
                squash(self.minimum, length)
            } else {
                self.minimum
            },
            max_range: self.max_range,
            sensing_length: self.sensing_range.unwrap_or(f64::INFINITY),
            length,
            speed: scenario.speed.largest(),
        }
    }
}

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
