//! Rewards: what a step of the model earns, for the team or for each agent (docs/model.md, "Rewards").

mod difference;
mod distance;
mod distance_change;
mod objective;
mod running_minimum;
mod term;
mod terminal;
mod total;

use serde::{Deserialize, Serialize};

pub use objective::Objective;
pub(crate) use term::{Action, Moment, Term};
pub(crate) use total::exact_sum;

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
