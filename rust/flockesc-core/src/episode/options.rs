//! The options of an episode: rewards, observations and how long an action holds.

use serde::{Deserialize, Serialize};

use crate::base::check::{MAX_STEPS, not_negative, positive, within};
use crate::base::document::parse;
use crate::base::error::{Error, Result};
use crate::observation::{SensingRange, View};
use crate::reward::{Objective, Reward};

/// What an environment rewards and shows (docs/model.md). A field that a document leaves out has its default.
///
/// ```
/// use flockesc_core::{EpisodeConfig, Objective};
///
/// let config = EpisodeConfig { objective: Objective::Minimum, ..EpisodeConfig::default() };
/// assert_eq!(EpisodeConfig::from_json(r#"{"objective": "minimum"}"#)?, config);
/// # Ok::<(), flockesc_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EpisodeConfig {
    /// Who observes: the flock as a whole, or every agent.
    pub view: View,
    /// The value that the episode is to keep large.
    pub objective: Objective,
    /// What a step earns.
    pub reward: Reward,
    /// Largest range in m that an action can set, above 0; scales the observed last range.
    pub max_range: f64,
    /// Distance up to which a predator is seen; `None`: any distance.
    pub predator_sensing_range: Option<SensingRange>,
    /// Steps of the model during which one action holds, at least 1.
    pub steps_per_action: usize,
}

impl Default for EpisodeConfig {
    /// One range for the flock, which keeps the mean distance large.
    fn default() -> Self {
        Self {
            view: View::Flock,
            objective: Objective::Mean,
            reward: Reward::RunningMinimum,
            max_range: 100.0,
            predator_sensing_range: Some(SensingRange::PredatorRange),
            steps_per_action: 1,
        }
    }
}

impl EpisodeConfig {
    /// Parses and checks a document.
    ///
    /// # Errors
    /// [`Error::Config`] naming the field that is unknown, of a wrong type or out of bounds.
    pub fn from_json(document: &str) -> Result<Self> {
        let config: Self = parse(document)?;
        config.check()?;
        Ok(config)
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::Config`] naming the field that is out of bounds.
    pub fn check(&self) -> Result<()> {
        positive("max_range", self.max_range)?;
        if let Some(SensingRange::Length(range)) = self.predator_sensing_range {
            not_negative("predator_sensing_range", range)?;
        }
        within("steps_per_action", self.steps_per_action, 1, MAX_STEPS)?;
        if self.reward.is_individual() && self.view == View::Flock {
            let team = Reward::team_kinds().join(", ");
            let expected = format!("one of {team} for the view of the whole flock");
            return Err(Error::config("reward", expected, "an individual reward"));
        }
        Ok(())
    }
}
