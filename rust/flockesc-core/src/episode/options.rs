//! `EpisodeConfig`: the options of an episode, such as reward, objective and observation.

use serde::{Deserialize, Serialize};

use crate::base::check::{
    MAX_MAGNITUDE, MAX_STEPS, not_negative, positive, profile_ranges, within, within_bounds,
};
use crate::base::document::parse;
use crate::base::entry::Entry;
use crate::base::error::{Error, Result};
use crate::flock::FlockConfig;
use crate::observation::{self, ExtraEntries, Extras, View};
use crate::reward::{Objective, Reward};

/// Options of an episode: reward, observation and action (docs/model.md). Every field has a default in
/// documents.
///
/// ```
/// use flockesc_core::{EpisodeConfig, Objective};
///
/// let config = EpisodeConfig { objective: Objective::MinMinDistance, ..EpisodeConfig::default() };
/// assert_eq!(EpisodeConfig::from_json(r#"{"objective": "min_min_distance"}"#)?, config);
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
    /// Reward that an action costs per m of range, at least 0.
    pub range_cost: f64,
    /// Largest interaction range in m that an action can set, above 0. The observed last range is divided by
    /// it.
    pub max_range: f64,
    /// Distance in m up to which agents sense a predator; `None` is any distance.
    pub predator_sensing_range: Option<f64>,
    /// Number of model steps per action, at least 1.
    pub steps_per_action: usize,
    /// Number of actions after which an episode is truncated, at least 1; `None` is no limit. Rewards and snapshots
    /// do not depend on it.
    #[serde(skip_serializing)]
    pub max_actions: Option<usize>,
    /// Candidate ranges in m, in ascending order, at most [`crate::MAX_CANDIDATES`]. The observation shows what
    /// every agent would hear under each of them. Empty with one range for the flock.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub profile_ranges: Vec<f64>,
    /// Optional entries of the observation.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub extra_entries: Vec<ExtraEntries>,
}

impl Default for EpisodeConfig {
    /// One range for the flock, with the mean predator distance as objective.
    fn default() -> Self {
        Self {
            view: View::Flock,
            objective: Objective::MinMeanDistance,
            reward: Reward::Team,
            range_cost: 0.0,
            max_range: 100.0,
            predator_sensing_range: None,
            steps_per_action: 1,
            max_actions: None,
            profile_ranges: Vec::new(),
            extra_entries: Vec::new(),
        }
    }
}

impl EpisodeConfig {
    /// Parses and checks a document.
    ///
    /// # Errors
    /// [`Error::Input`] if a field is unknown, has the wrong type or is out of bounds.
    pub fn from_json(document: &str) -> Result<Self> {
        let config: Self = parse(document)?;
        config.check()?;
        Ok(config)
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`Error::Input`] if a field is out of bounds.
    pub fn check(&self) -> Result<()> {
        positive("max_range", self.max_range)?;
        let most = MAX_MAGNITUDE / self.max_range.max(1.0);
        within_bounds("range_cost", self.range_cost, 0.0, most)?;
        if let Some(range) = self.predator_sensing_range {
            not_negative("predator_sensing_range", range)?;
        }
        within("steps_per_action", self.steps_per_action, 1, MAX_STEPS)?;
        if let Some(limit) = self.max_actions {
            within("max_actions", limit, 1, usize::MAX)?;
        }
        if !self.profile_ranges.is_empty() {
            if !self.view.is_per_agent() {
                let expected = "none with one range for the flock";
                return Err(Error::input("profile_ranges", expected, "some"));
            }
            profile_ranges("profile_ranges", &self.profile_ranges, self.max_range)?;
        }
        for (index, kind) in self.extra_entries.iter().enumerate() {
            if self.extra_entries[..index].contains(kind) {
                let field = format!("extra_entries[{index}]");
                return Err(Error::input(field, "different entries", "one twice"));
            }
        }
        if self.reward.is_individual() && !self.view.is_per_agent() {
            let team = Reward::team_kinds().join(", ");
            let expected = format!("one of {team} with the view of the whole flock");
            return Err(Error::input("reward", expected, "an individual reward"));
        }
        Ok(())
    }

    /// Checks that the scenario defines the optional entries of the observation.
    ///
    /// # Errors
    /// [`Error::Input`] naming the option that the scenario rules out.
    pub fn check_scenario(&self, scenario: &FlockConfig) -> Result<()> {
        if scenario.frozen_graph && !self.profile_ranges.is_empty() {
            let expected = "none with a frozen graph, whose neighbors do not depend on the range";
            return Err(Error::input("profile_ranges", expected, "some"));
        }
        Ok(())
    }

    /// Returns the entries of an observation row, in order, for dimension 2 or 3.
    pub fn entries(&self, dimension: usize) -> Vec<Entry> {
        observation::entries(self.view, self.extras(), dimension)
    }

    /// Returns the optional entries of the observation.
    pub(super) fn extras(&self) -> Extras<'_> {
        Extras {
            ranges: &self.profile_ranges,
            entries: &self.extra_entries,
        }
    }
}
