//! Rewards: what a step of the model earns, for the team or for each agent (docs/model.md, "Rewards").

mod difference;
mod distance;
mod distance_change;
mod objective;
mod running_minimum;
mod terminal;
mod total;

use serde::{Deserialize, Serialize};

pub use objective::Objective;
pub(crate) use total::exact_sum;

use crate::base::error::Result;
use crate::flock::World;
use crate::parallel::Progress;

/// Makes the table of rewards: the enum of an episode's options, and the term of each.
macro_rules! rewards {
    ($($(#[$about:meta])* $Reward:ident = $Kind:ident($function:expr),)*) => {
        /// The reward term. Team terms give every agent the same reward.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, strum::VariantNames)]
        #[serde(rename_all = "snake_case")]
        #[strum(serialize_all = "snake_case")]
        pub enum Reward {
            $($(#[$about])* $Reward,)*
        }

        impl Reward {
            /// The names of all terms in documents.
            pub const KINDS: &[&str] = <Self as strum::VariantNames>::VARIANTS;

            const ALL: &[Self] = &[$(Self::$Reward),*];

            /// How it is computed.
            pub(crate) fn term<const D: usize>(self) -> Term<D> {
                match self {
                    $(Self::$Reward => Term::$Kind($function),)*
                }
            }
        }
    };
}

rewards! {
    /// m_t - m_(t-1), where m is the running minimum of the objective's value. Sums to J - m_0 exactly.
    RunningMinimum = Team(running_minimum::team),
    /// The objective's value over T steps, so that an episode sums to its time mean. Dense.
    Distance = Team(distance::team),
    /// As `Distance`, for each agent its own distance.
    IndividualDistance = Individual(distance::individual),
    /// d_i(t) - d_i(t-1), for each agent the change of its own distance. Sums to d_i(T) - d_i(0).
    IndividualDistanceChange = Individual(distance_change::individual),
    /// Each agent's part of `RunningMinimum` of the mean distance: when the minimum falls, d_i minus d_i at its last
    /// fall.
    IndividualRunningMinimum = Individual(running_minimum::individual),
    /// As `IndividualDistanceChange`, for each agent the mean over its neighborhood.
    NeighborhoodDistanceChange = Individual(distance_change::neighborhood),
    /// G - G_-i, by how much the objective's value after an action grows because agent i hears its neighbors.
    Difference = Counterfactual(difference::add),
    /// J - m_0 on the last step, 0 before.
    Terminal = Team(terminal::team),
}

impl Reward {
    /// Whether agents earn different rewards, which needs one range per agent.
    pub(crate) fn is_individual(self) -> bool {
        match self.term::<2>() {
            Term::Team(_) => false,
            Term::Individual(_) | Term::Counterfactual(_) => true,
        }
    }

    /// The names of the team terms.
    pub(crate) fn team_kinds() -> Vec<&'static str> {
        let rewards = Self::ALL.iter().zip(Self::KINDS);
        let team = rewards.filter(|(reward, _)| !reward.is_individual());
        team.map(|(_, kind)| *kind).collect()
    }
}

/// How a reward is computed.
#[derive(Clone, Copy)]
pub(crate) enum Term<const D: usize> {
    /// The reward of every agent for a step.
    Team(fn(&Moment<'_, D>) -> f64),
    /// Adds the reward of each agent for a step.
    Individual(fn(&Moment<'_, D>, &mut [f64])),
    /// Adds the reward of each agent for an action, which the flock repeats once per agent.
    Counterfactual(fn(&Action<'_, D>, &mut [f64], &Progress) -> Result<()>),
}

impl<const D: usize> Term<D> {
    /// Adds the rewards of a step to `rewards`: one entry for the flock, or one per agent. Returns the team's reward,
    /// 0 for other terms.
    pub(crate) fn add_step(&self, moment: &Moment<'_, D>, rewards: &mut [f64]) -> f64 {
        match self {
            Self::Team(reward) => {
                let team = reward(moment);
                for reward in rewards {
                    *reward += team;
                }
                team
            }
            Self::Individual(add) => {
                add(moment, rewards);
                0.0
            }
            Self::Counterfactual(_) => 0.0,
        }
    }
}

/// A step that was just made. Distances are in m, 0 for agents that were caught.
#[derive(Debug)]
pub(crate) struct Moment<'a, const D: usize> {
    pub(crate) world: &'a World<D>,
    /// In m.
    pub(crate) max_range: f64,
    /// The objective's value now.
    pub(crate) value: f64,
    /// Its running minimum before and after the step, and at the start of the episode.
    pub(crate) minimum_before: f64,
    pub(crate) minimum: f64,
    pub(crate) minimum_at_start: f64,
    /// Every agent's distance before and after the step; empty for team terms.
    pub(crate) distances_before: &'a [f64],
    pub(crate) distances: &'a [f64],
    /// The same when the running minimum fell last before this step, or at the start.
    pub(crate) distances_at_minimum: &'a [f64],
    pub(crate) is_last: bool,
}

/// An action that was just held.
#[derive(Debug)]
pub(crate) struct Action<'a, const D: usize> {
    /// The flock before it.
    pub(crate) before: &'a World<D>,
    pub(crate) objective: Objective,
    /// Every agent's range in m.
    pub(crate) ranges: &'a [f64],
    /// Steps for which they were held, or until no agent was left.
    pub(crate) num_steps: usize,
    /// The objective's value after it.
    pub(crate) value: f64,
}

/// Adds the differences of `now` and `before`.
fn add_changes(now: &[f64], before: &[f64], rewards: &mut [f64]) {
    for ((reward, now), before) in rewards.iter_mut().zip(now).zip(before) {
        *reward += now - before;
    }
}
