//! Reward terms, for the team or for each agent (docs/model.md, "Rewards").

mod difference;
mod distance;
mod distance_change;
mod objective;
mod running_minimum;
mod term;
mod terminal;
mod total;

use serde::{Deserialize, Serialize};

pub use objective::{Objective, ObjectiveSpec, objectives};
pub(crate) use term::{ActionContext, StepContext, Term};
pub(crate) use total::exact_sum;

/// Generates [`Reward`] and the term of each variant from a table.
macro_rules! rewards {
    ($($(#[$about:meta])* $Reward:ident = $Kind:ident($function:expr),)*) => {
        /// The reward term of an episode. Team terms give every agent the same reward.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, strum::VariantNames)]
        #[serde(rename_all = "snake_case")]
        #[strum(serialize_all = "snake_case")]
        pub enum Reward {
            $($(#[$about])* $Reward,)*
        }

        impl Reward {
            /// Names of all terms in documents.
            pub const KINDS: &[&str] = <Self as strum::VariantNames>::VARIANTS;

            const ALL: &[Self] = &[$(Self::$Reward),*];

            /// Returns the function that computes the reward.
            pub(crate) fn term<const D: usize>(self) -> Term<D> {
                match self {
                    $(Self::$Reward => Term::$Kind($function),)*
                }
            }
        }
    };
}

rewards! {
    /// m_t - m_(t-1), where m is the running minimum of the objective. Sums to J - m_0 exactly.
    RunningMinimum = Team(running_minimum::team),
    /// The objective's value divided by the number of steps. Sums to the time average of the objective.
    Distance = Team(distance::team),
    /// d_i divided by the number of steps. Sums to the time average of d_i.
    IndividualDistance = Individual(distance::individual),
    /// d_i(t) - d_i(t-1). Sums to d_i(T) - d_i(0).
    IndividualDistanceChange = Individual(distance_change::individual),
    /// Each agent's part of `RunningMinimum` of the mean distance: when the minimum falls, d_i minus d_i at
    /// the previous fall; 0 otherwise.
    IndividualRunningMinimum = Individual(running_minimum::individual),
    /// `IndividualDistanceChange`, averaged over the agent's neighborhood.
    NeighborhoodDistanceChange = Individual(distance_change::neighborhood),
    /// G - G_-i: the objective's value after an action minus its value with a range of 0 for agent i.
    Difference = Counterfactual(difference::add),
    /// J - m_0 in the last step, 0 before.
    Terminal = Team(terminal::team),
}

impl Reward {
    /// Returns whether agents have different rewards, which needs the view of the agents.
    pub(crate) fn is_individual(self) -> bool {
        match self.term::<2>() {
            Term::Team(_) => false,
            Term::Individual(_) | Term::Counterfactual(_) => true,
        }
    }

    /// Returns the names of the team terms.
    pub(crate) fn team_kinds() -> Vec<&'static str> {
        let rewards = Self::ALL.iter().zip(Self::KINDS);
        let team = rewards.filter(|(reward, _)| !reward.is_individual());
        team.map(|(_, kind)| *kind).collect()
    }
}
