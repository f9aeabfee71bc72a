//! Rewards, for the team or for each agent (docs/model.md, "Rewards").

mod objective;
mod step;

use serde::{Deserialize, Serialize};
use strum::{IntoStaticStr, VariantArray, VariantNames};

pub use objective::Objective;
pub(crate) use step::{ActionContext, StepContext};

/// The reward term of an episode. Team terms give every agent the same reward.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[derive(VariantNames, VariantArray, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum Reward {
    /// m_t - m_(t-1), where m is the running minimum of the objective. Sums to J - m_0 exactly.
    Team,
    /// The objective's value divided by the number of steps. Sums to the time average of the objective.
    Distance,
    /// d_i divided by the number of steps. Sums to the time average of d_i.
    IndividualDistance,
    /// d_i(t) - d_i(t-1). Sums to d_i(T) - d_i(0).
    IndividualDistanceChange,
    /// Each agent's part of `Team` of the mean distance: when the minimum falls, d_i minus d_i at
    /// the previous fall; 0 otherwise.
    Individual,
    /// G - G_-i: the objective's value after an action minus its value with a range of 0 for agent i.
    Difference,
    /// J - m_0 in the last step, 0 before.
    Terminal,
}

impl Reward {
    /// Returns whether agents have different rewards, which needs the view of the agents.
    pub(crate) fn is_individual(self) -> bool {
        match self {
            Self::Team | Self::Distance | Self::Terminal => false,
            Self::IndividualDistance
            | Self::IndividualDistanceChange
            | Self::Individual
            | Self::Difference => true,
        }
    }

    /// Returns whether the reward repeats every action once per agent.
    pub(crate) fn repeats_actions(self) -> bool {
        self == Self::Difference
    }

    /// Returns the names of the team terms.
    pub(crate) fn team_kinds() -> Vec<&'static str> {
        let team = <Self as VariantArray>::VARIANTS
            .iter()
            .filter(|reward| !reward.is_individual());
        team.map(|reward| reward.into()).collect()
    }

    /// Returns the reward of a step that all agents share; 0 for individual terms.
    pub(crate) fn of_team<const D: usize>(self, step: &StepContext<'_, D>) -> f64 {
        match self {
            Self::Team => step.minimum - step.minimum_before,
            Self::Distance => step.value * step.share(),
            Self::Terminal if step.is_last => step.minimum - step.minimum_at_start,
            Self::Terminal
            | Self::IndividualDistance
            | Self::IndividualDistanceChange
            | Self::Individual
            | Self::Difference => 0.0,
        }
    }

    /// Adds the reward of a step of each agent to `rewards`; nothing for team terms.
    pub(crate) fn add_individual<const D: usize>(
        self,
        step: &StepContext<'_, D>,
        rewards: &mut [f64],
    ) {
        match self {
            Self::IndividualDistance => {
                let share = step.share();
                for (reward, distance) in rewards.iter_mut().zip(step.distances) {
                    *reward += distance * share;
                }
            }
            Self::IndividualDistanceChange => step.add_changes(step.distances_before, rewards),
            Self::Individual if step.minimum < step.minimum_before => {
                step.add_changes(step.distances_at_minimum, rewards);
            }
            Self::Individual | Self::Team | Self::Distance | Self::Terminal | Self::Difference => {}
        }
    }
}
