//! What an environment makes of the flock model.

use serde::Deserialize;

use crate::base::check::{MAX_STEPS, not_negative, positive, within};
use crate::base::document::parse;
use crate::base::error::{Error, Result};
use crate::flock::FlockConfig;
use crate::observation::{SensingRange, View};
use crate::reward::{Objective, Reward};

/// What an environment rewards and shows (docs/model.md).
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EpisodeConfig {
    /// Whose eyes the observation is made for.
    pub view: View,
    /// Which distance the episode is about.
    pub objective: Objective,
    /// What a step pays.
    pub reward: Reward,
    /// Largest range in m that an action can set, above 0; scales the observed last range.
    pub max_range: f64,
    /// Distance up to which a predator is seen; `None`: any distance.
    pub predator_sensing_range: Option<SensingRange>,
    /// Steps of the model during which one action holds, at least 1.
    pub steps_per_action: usize,
}

impl EpisodeConfig {
    /// Parses and checks a document.
    ///
    /// # Errors
    /// [`Error::Config`] naming the field that is unknown, missing, of a wrong type or out of bounds.
    pub fn from_json(document: &str) -> Result<Self> {
        let config: Self = parse(document)?;
        positive("max_range", config.max_range)?;
        if let Some(SensingRange::Length(range)) = config.predator_sensing_range {
            not_negative("predator_sensing_range", range)?;
        }
        within("steps_per_action", config.steps_per_action, 1, MAX_STEPS)?;
        if config.reward.is_individual() && config.view == View::Flock {
            let team = Reward::team_kinds().join(", ");
            let expected = format!("one of {team} for the view of the whole flock");
            return Err(Error::config("reward", expected, "an individual reward"));
        }
        Ok(config)
    }

    /// Whether a predator is seen from this distance in m.
    pub(crate) fn is_sensed(&self, distance: f64, scenario: &FlockConfig) -> bool {
        self.predator_sensing_range
            .is_none_or(|range| range.reaches(distance, scenario))
    }
}
