//! Snapshots of a line's episode.

use super::{Course, LineEpisode, LineEpisodeConfig};
use crate::base::error::Result;
use crate::line::groups::Groups;
use crate::line::scenario::LineConfig;
use crate::line::step::Line;
use crate::snapshot::{Fingerprint, check, is_range, is_sound, open, seal};

impl LineEpisode {
    /// The episode as bytes, with the seed of its schedule and the number of the next episode in the schedule.
    ///
    /// # Errors
    /// None that a caller could cause.
    pub fn save(&self, schedule: (u64, u64)) -> Result<Vec<u8>> {
        let state = (schedule, self.line.groups(), &self.course);
        seal(fingerprint(self.line.config(), &self.config), &state)
    }

    /// The episode and schedule that [`Self::save`] has saved, under the scenario and configuration of this episode.
    ///
    /// # Errors
    /// [`crate::Error::Argument`] for bytes that are damaged, of another version, scenario or configuration.
    pub fn restored(&self, state: &[u8]) -> Result<(Self, (u64, u64))> {
        let scenario = self.line.shared_config();
        let (schedule, groups, course): (_, Groups, Course) =
            open(fingerprint(scenario, &self.config), state)?;
        check(groups.fit(scenario.num_agents), "states of agents")?;
        check(course.step <= scenario.max_steps, "step")?;
        check(is_sound(course.start_distance), "distance")?;
        check(is_range(course.last_range), "range")?;
        let episode = Self {
            config: self.config.clone(),
            line: Line::of_groups(scenario.clone(), groups),
            course,
        };
        Ok((episode, schedule))
    }
}

fn fingerprint(scenario: &LineConfig, config: &LineEpisodeConfig) -> Fingerprint {
    Fingerprint::of(&(scenario, config))
}
