//! `EpisodeConfig`: the options of an episode, such as reward, objective and observation.

use serde::{Deserialize, Serialize};

use crate::base::check::{MAX_STEPS, not_negative, positive, within};
use crate::base::document::parse;
use crate::base::error::{Error, Result};
use crate::observation::{SensingRange, View};
use crate::reward::{Objective, Reward};

/// Options of an episode: reward, observation and action (docs/model.md). Every field has a default in
/// documents.
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
    /// Whether there is one observation and range for the flock, or one per agent.
    pub view: View,
    /// The value whose running minimum an episode maximizes.
    pub objective: Objective,
    /// The reward term.
    pub reward: Reward,
    /// Largest interaction range in m that an action can set, above 0. The observed last range is divided by
    /// it.
    pub max_range: f64,
    /// Distance up to which agents sense a predator; `None` is any distance.
    pub predator_sensing_range: Option<SensingRange>,
    /// Number of model steps per action, at least 1.
    pub steps_per_action: usize,
}

impl Default for EpisodeConfig {
    /// One range for the flock, with the mean predator distance as objective.
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
    /// [`Error::Config`] if a field is unknown, has the wrong type or is out of bounds.
    pub fn from_json(document: &str) -> Result<Self> {
        let config: Self = parse(document)?;
        config.check()?;
        Ok(config)
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::Config`] if a field is out of bounds.
    pub fn check(&self) -> Result<()> {
        positive("max_range", self.max_range)?;
        if let Some(SensingRange::Length(range)) = self.predator_sensing_range {
            not_negative("predator_sensing_range", range)?;
        }
        within("steps_per_action", self.steps_per_action, 1, MAX_STEPS)?;
        if self.reward.is_individual() && self.view == View::Flock {
            let team = Reward::team_kinds().join(", ");
            let expected = format!("one of {team} with the view of the whole flock");
            return Err(Error::config("reward", expected, "an individual reward"));
        }
        Ok(())
    }
}
