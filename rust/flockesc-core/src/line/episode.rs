//! An episode of a line, from its start to its steady state: actions, rewards, observations.

mod state;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::step::{Line, check_range};
use crate::base::check::{MAX_STEPS, positive, within};
use crate::base::document::parse;
use crate::base::entry::Entry;
use crate::base::error::{Error, Result};
use crate::line::scenario::LineConfig;
use crate::parallel::Progress;

/// The options of a line environment (docs/model.md).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LineEpisodeConfig {
    /// The reward of a step.
    pub reward: LineReward,
    /// Largest range that an action can set, above 0; scales the observed last range.
    pub max_range: f64,
    /// Steps of the model during which one action holds, at least 1.
    pub steps_per_action: usize,
}

/// The reward of the line; both sum to d_ss - d(0) exactly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, strum::VariantNames)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum LineReward {
    /// d(t) - d(t-1).
    Change,
    /// d - d(0) on the last step, 0 before.
    Terminal,
}

impl LineReward {
    /// The names of all terms in documents.
    pub const KINDS: &[&str] = <Self as strum::VariantNames>::VARIANTS;
}

impl Default for LineEpisodeConfig {
    fn default() -> Self {
        Self {
            reward: LineReward::Change,
            max_range: 1.0,
            steps_per_action: 1,
        }
    }
}

impl LineEpisodeConfig {
    /// Parses and checks a document.
    ///
    /// # Errors
    /// [`Error::Config`] naming the field that is unknown, missing, of a wrong type or out of bounds.
    pub fn from_json(document: &str) -> Result<Self> {
        let config: Self = parse(document)?;
        positive("max_range", config.max_range)?;
        within("steps_per_action", config.steps_per_action, 1, MAX_STEPS)?;
        Ok(config)
    }
}

/// A line in an episode.
#[derive(Debug, Clone)]
pub struct LineEpisode {
    config: LineEpisodeConfig,
    line: Line,
    course: Course,
}

/// The course of an episode so far.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Course {
    /// Steps made.
    step: usize,
    /// d(0).
    start_distance: f64,
    /// Range of the last action; 0 before the first.
    last_range: f64,
    /// Whether the last step moved no agent by more than the tolerance.
    is_steady: bool,
}

impl LineEpisode {
    /// The episode at t = 0.
    ///
    /// # Errors
    /// [`Error::Config`] if the scenario has no predator; otherwise as [`Line::new`].
    pub fn new(
        scenario: Arc<LineConfig>,
        config: LineEpisodeConfig,
        seed: u64,
        initial_state: Option<&[f64]>,
    ) -> Result<Self> {
        if scenario.predator_position.is_none() {
            let why = "a number: rewards depend on the distance to the predator";
            return Err(Error::config("predator_position", why, "none"));
        }
        let line = Line::new(scenario, seed, initial_state)?;
        let course = Course {
            step: 0,
            start_distance: line.escape_distance(),
            last_range: 0.0,
            is_steady: false,
        };
        Ok(Self {
            config,
            line,
            course,
        })
    }

    /// Holds `range` for `steps_per_action` steps or until the end, and returns the reward.
    ///
    /// # Errors
    /// [`Error::Argument`] for a range that is negative or not finite; [`Error::Episode`] after the end.
    /// These change nothing. [`Error::Interrupted`] if `progress` was cancelled, after part of the action was applied.
    pub fn advance(&mut self, range: f64, progress: &Progress) -> Result<f64> {
        check_range(range)?;
        if self.has_ended() {
            return Err(Error::episode(
                "step",
                "a reset: the episode has ended",
                "a step",
            ));
        }
        let before = self.line.escape_distance();
        self.course.last_range = range;
        for _ in 0..self.config.steps_per_action {
            if self.has_ended() {
                break;
            }
            progress.check()?;
            let moved = self.line.step(range)?;
            self.course.is_steady = self.line.is_steady(moved);
            self.course.step += 1;
        }
        let now = self.line.escape_distance();
        Ok(match self.config.reward {
            LineReward::Change => now - before,
            LineReward::Terminal if self.has_ended() => now - self.course.start_distance,
            LineReward::Terminal => 0.0,
        })
    }

    /// The observation: t / max_steps, d / (1 + d), rho / max_range, then the offsets u = x_i - x_p in
    /// rising order as u / (1 + |u|).
    ///
    /// The order statistics are the whole state up to the agents' ids, so the problem stays Markov.
    #[must_use]
    pub fn observation(&self) -> Vec<f32> {
        let scenario = self.line.config();
        let predator = scenario.predator_position.unwrap_or_default();
        let distance = self.line.escape_distance();
        let offsets = self.line.sorted_states().map(|x| x - predator);
        let scalars = [
            self.course.step as f64 / scenario.max_steps as f64,
            distance / (1.0 + distance),
            (self.course.last_range / self.config.max_range).min(1.0),
        ];
        scalars
            .into_iter()
            .chain(offsets.map(|u| u / (1.0 + u.abs())))
            .map(|entry| entry as f32)
            .collect()
    }

    /// Estimated number of agents that an action visits; a measure of its run time.
    #[must_use]
    pub fn work(&self) -> usize {
        let scenario = self.line.config();
        let steps = self.config.steps_per_action.min(scenario.max_steps);
        scenario.num_agents.saturating_mul(steps)
    }

    /// Steps made so far.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.course.step
    }

    /// Whether the line stands still or has made `max_steps`.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.course.is_steady || self.course.step >= self.line.config().max_steps
    }

    /// Whether the last step moved no agent by more than the tolerance.
    #[must_use]
    pub fn is_steady(&self) -> bool {
        self.course.is_steady
    }

    /// The line itself.
    #[must_use]
    pub fn line(&self) -> &Line {
        &self.line
    }

    /// Range of the last action; 0 before the first.
    #[must_use]
    pub fn last_range(&self) -> f64 {
        self.course.last_range
    }
}

/// The entries of a line observation, in order: name, lower and upper bound.
#[must_use]
pub fn line_entries(num_agents: usize) -> Vec<Entry> {
    let scalars = ["time", "escape_distance", "last_range"].map(|name| (name.to_owned(), 0.0));
    let offsets = (0..num_agents).map(|rank| (format!("offset_{rank}"), -1.0));
    scalars
        .into_iter()
        .chain(offsets)
        .map(|(name, low)| Entry {
            name,
            low,
            high: 1.0,
        })
        .collect()
}
