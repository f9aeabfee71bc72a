//! An episode of a line as bytes.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::{LineEpisode, LineEpisodeConfig};
use crate::base::error::Result;
use crate::line::Line;
use crate::line::groups::Groups;
use crate::line::scenario::LineConfig;
use crate::snapshot::{Fingerprint, check, is_range, is_sound, open, seal};

/// See the fields of [`LineEpisode`].
#[derive(Debug, Serialize, Deserialize)]
struct LineState<'a> {
    /// Seed of the schedule that the episode belongs to, and number of the next episode in it.
    schedule: (u64, u64),
    groups: Cow<'a, Groups>,
    step: usize,
    start_distance: f64,
    last_range: f64,
    is_steady: bool,
}

impl LineEpisode {
    /// The episode, and the seed and the next number of the schedule that it belongs to, as bytes.
    ///
    /// # Errors
    /// None that a caller could cause.
    pub fn save(&self, schedule: (u64, u64)) -> Result<Vec<u8>> {
        let state = LineState {
            schedule,
            groups: Cow::Borrowed(self.line.groups()),
            step: self.step,
            start_distance: self.start_distance,
            last_range: self.last_range,
            is_steady: self.is_steady,
        };
        seal(fingerprint(self.line.config(), &self.config), &state)
    }

    /// What [`Self::save`] has saved of an episode of the same scenario and configuration.
    ///
    /// # Errors
    /// [`crate::Error::Argument`] for bytes that are damaged, of another version or of something else.
    pub fn restored(&self, state: &[u8]) -> Result<(Self, (u64, u64))> {
        let scenario = self.line.shared_config();
        let state: LineState<'static> = open(fingerprint(scenario, &self.config), state)?;
        check(state.groups.fit(scenario.num_agents), "states of agents")?;
        check(state.step <= scenario.max_steps, "step")?;
        check(is_sound(state.start_distance), "distance")?;
        check(is_range(state.last_range), "range")?;
        let episode = Self {
            config: self.config.clone(),
            line: Line::of_groups(scenario.clone(), state.groups.into_owned()),
            step: state.step,
            start_distance: state.start_distance,
            last_range: state.last_range,
            is_steady: state.is_steady,
        };
        Ok((episode, state.schedule))
    }
}

fn fingerprint(scenario: &LineConfig, config: &LineEpisodeConfig) -> Fingerprint {
    Fingerprint::of(&(scenario, config))
}
