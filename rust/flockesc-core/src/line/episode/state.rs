//! Snapshots of a line's episode.

use super::{LineEpisode, LineEpisodeConfig, Status};
use crate::base::error::Result;
use crate::line::groups::Groups;
use crate::line::scenario::LineConfig;
use crate::line::step::Line;
use crate::snapshot::{Fingerprint, check, decode, encode, is_bounded, is_range};

impl LineEpisode {
    /// Returns a snapshot of the episode and of `schedule`, a pair of the first seed and the number of the
    /// next episode.
    ///
    /// # Errors
    /// [`crate::Error::Argument`] if serialization fails.
    pub fn save(&self, schedule: (u64, u64)) -> Result<Vec<u8>> {
        let state = (schedule, self.line.groups(), &self.status);
        encode(fingerprint(self.line.config(), &self.config), &state)
    }

    /// Returns the episode and schedule of a snapshot by [`Self::save`]. The snapshot must have this
    /// episode's scenario and options.
    ///
    /// # Errors
    /// [`crate::Error::Argument`] if the bytes are damaged or have another version, scenario or options.
    pub fn restored(&self, state: &[u8]) -> Result<(Self, (u64, u64))> {
        let scenario = self.line.shared_config();
        let (schedule, groups, status): (_, Groups, Status) =
            decode(fingerprint(scenario, &self.config), state)?;
        check(groups.fit(scenario.num_agents), "states of agents")?;
        check(status.step <= scenario.max_steps, "step")?;
        check(is_bounded(status.start_distance), "distance")?;
        check(is_range(status.last_range), "range")?;
        let episode = Self {
            config: self.config.clone(),
            line: Line::of_groups(scenario.clone(), groups),
            status,
        };
        Ok((episode, schedule))
    }
}

fn fingerprint(scenario: &LineConfig, config: &LineEpisodeConfig) -> Fingerprint {
    Fingerprint::of(&(scenario, config))
}
