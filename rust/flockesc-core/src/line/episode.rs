//! `LineEpisode`: an episode of a line with actions, rewards and observations, up to its steady state.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::step::{Groups, Line};
use crate::base::check::{MAX_STEPS, not_negative, positive, require, rounding, within};
use crate::base::document::parse;
use crate::base::entry::{Entries, Entry, Row};
use crate::base::error::{Error, Result};
use crate::line::scenario::LineConfig;
use crate::parallel::Progress;
use crate::snapshot::{Fingerprint, decode, encode};

/// Options of a line's episode: reward and action (docs/model.md). Every field has a default in documents.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LineEpisodeConfig {
    /// The reward term.
    pub reward: LineReward,
    /// Largest interaction range that an action can set, above 0. The observed last range is divided by it.
    pub max_range: f64,
    /// Number of model steps per action, at least 1.
    pub steps_per_action: usize,
}

/// The reward term of a line's episode. Both terms sum to d_ss - d(0) exactly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, strum::VariantNames)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum LineReward {
    /// d(t) - d(t-1).
    Change,
    /// d - d(0) in the last step, 0 before.
    Terminal,
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
    /// [`Error::Input`] if a field is unknown, has the wrong type or is out of bounds.
    pub fn from_json(document: &str) -> Result<Self> {
        let config: Self = parse(document)?;
        positive("max_range", config.max_range)?;
        within("steps_per_action", config.steps_per_action, 1, MAX_STEPS)?;
        Ok(config)
    }
}

/// An episode of a line.
#[derive(Debug, Clone)]
pub struct LineEpisode {
    config: LineEpisodeConfig,
    line: Line,
    status: Status,
}

/// The state of an episode except the line itself.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Status {
    /// Number of steps so far.
    step: usize,
    /// Escape distance d(0).
    start_distance: f64,
    /// Range of the last action; 0 before the first action.
    last_range: f64,
    /// Whether the last step moved no agent by more than the tolerance.
    is_steady: bool,
}

impl LineEpisode {
    /// Creates the episode at t = 0, from `initial_state` or, if it is `None`, from a state drawn from
    /// `seed`.
    ///
    /// # Errors
    /// [`Error::Input`] if the scenario has no predator; otherwise as [`Line::new`].
    pub fn new(
        scenario: Arc<LineConfig>,
        config: LineEpisodeConfig,
        seed: u64,
        initial_state: Option<&[f64]>,
    ) -> Result<Self> {
        let has_predator = scenario.predator_position.is_some();
        let expected = "a number, because rewards depend on the distance to the predator";
        require(has_predator, "predator_position", expected, "none")?;
        let line = Line::new(scenario, seed, initial_state)?;
        let status = Status {
            step: 0,
            start_distance: line.escape_distance(),
            last_range: 0.0,
            is_steady: false,
        };
        Ok(Self {
            config,
            line,
            status,
        })
    }

    /// Applies one action for `steps_per_action` steps or until the end of the episode, and returns the
    /// reward.
    ///
    /// # Errors
    /// [`Error::Input`] if `range` is negative or not finite; [`Error::Episode`] after the end of the
    /// episode; [`Error::Rounding`]. The episode is then unchanged. [`Error::Interrupted`] if `progress` was cancelled; part of
    /// the action was then applied.
    pub fn advance(&mut self, range: f64, progress: &Progress) -> Result<f64> {
        rounding()?;
        not_negative("interaction_range", range)?;
        if self.has_ended() {
            let message = "step() called after the end of the episode; call reset()";
            return Err(Error::episode(message));
        }
        let before = self.line.escape_distance();
        self.status.last_range = range;
        for _ in 0..self.config.steps_per_action {
            if self.has_ended() {
                break;
            }
            progress.check()?;
            let moved = self.line.step(range)?;
            self.status.is_steady = self.line.is_steady(moved);
            self.status.step += 1;
        }
        let now = self.line.escape_distance();
        Ok(match self.config.reward {
            LineReward::Change => now - before,
            LineReward::Terminal if self.has_ended() => now - self.status.start_distance,
            LineReward::Terminal => 0.0,
        })
    }

    /// Returns the observation: t / max_steps, d / (1 + d), rho / max_range, and u / (1 + |u|) of the offsets
    /// u = x_i - x_p in ascending order.
    ///
    /// The sorted offsets determine the state up to the agents' ids, so that the decision process is Markov.
    pub fn observation(&self) -> Vec<f32> {
        let time = self.status.step as f64 / self.line.config().max_steps as f64;
        let last_range = self.status.last_range / self.config.max_range;
        let scalars = [time, self.line.escape_distance(), last_range];
        let mut observation = Vec::new();
        observe(&mut observation, scalars, self.line.offsets());
        observation
    }

    /// Estimates the number of agents that an action and its observation visit, a measure of the run time.
    pub fn work(&self) -> usize {
        let scenario = self.line.config();
        let steps = self.config.steps_per_action.min(scenario.max_steps);
        scenario.num_agents.saturating_mul(steps + 1)
    }

    /// Returns the number of steps so far.
    pub fn steps(&self) -> usize {
        self.status.step
    }

    /// Returns whether the line is in its steady state or has made `max_steps` steps.
    pub fn has_ended(&self) -> bool {
        self.status.is_steady || self.status.step >= self.line.config().max_steps
    }

    /// Returns whether the last step moved no agent by more than the tolerance.
    pub fn is_steady(&self) -> bool {
        self.status.is_steady
    }

    /// Returns the line.
    pub fn line(&self) -> &Line {
        &self.line
    }

    /// Returns the range of the last action; 0 before the first action.
    pub fn last_range(&self) -> f64 {
        self.status.last_range
    }

    /// Returns a snapshot of the episode and of `schedule`, a pair of the first seed and the number of the
    /// next episode.
    ///
    /// # Errors
    /// [`crate::Error::Input`] if serialization fails.
    pub fn save(&self, schedule: (u64, u64)) -> Result<Vec<u8>> {
        let state = (schedule, self.line.groups(), &self.status);
        encode(self.fingerprint(), &state)
    }

    /// Returns the episode and schedule of a snapshot by [`Self::save`]. The snapshot must have this
    /// episode's scenario and options.
    ///
    /// # Errors
    /// [`crate::Error::Input`] if the bytes are damaged or have another version, scenario or options.
    pub fn restored(&self, state: &[u8]) -> Result<(Self, (u64, u64))> {
        let (schedule, groups, status): (_, Groups, Status) = decode(self.fingerprint(), state)?;
        let episode = Self {
            config: self.config.clone(),
            line: Line::of_groups(self.line.config().clone(), groups),
            status,
        };
        Ok((episode, schedule))
    }

    fn fingerprint(&self) -> Fingerprint {
        Fingerprint::of(&(self.line.config().as_ref(), &self.config))
    }
}

/// Adds all entries of an observation to `row`. `scalars` are the elapsed fraction, the escape distance and the
/// last range as a fraction of the largest one.
fn observe(
    row: &mut impl Row<f64>,
    [time, escape_distance, last_range]: [f64; 3],
    offsets: impl Iterator<Item = f64>,
) {
    let scaled = |length: f64| length / (1.0 + length.abs());
    row.number("time", 0.0, time);
    row.number("escape_distance", 0.0, scaled(escape_distance));
    row.number("last_range", 0.0, last_range);
    for (rank, offset) in offsets.enumerate() {
        row.number(format_args!("offset_{rank}"), -1.0, scaled(offset));
    }
}

/// Returns the names and bounds of a line's observation entries, in order.
pub fn line_entries(num_agents: usize) -> Vec<Entry> {
    let mut entries = Entries::default();
    observe(&mut entries, [0.0; 3], std::iter::repeat_n(0.0, num_agents));
    entries.entries
}
