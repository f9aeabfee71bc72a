//! Rewards of one step of the model, team and individual (docs/model.md, "Rewards").

pub(crate) mod difference;
mod neighborhood;
mod objective;

use serde::Deserialize;

pub use objective::Objective;

use crate::flock::World;

/// The reward term; a team reward is the same for every agent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reward {
    /// m_t - m_(t-1), m the running minimum of the objective's value; sums to J - m_0 exactly.
    RunningMinimum,
    /// The objective's value over T steps, so that an episode sums to its time mean; dense.
    Distance,
    /// As `Distance`, each agent its own distance.
    IndividualDistance,
    /// d_i(t) - d_i(t-1), each agent the change of its own distance; sums to d_i(T) - d_i(0).
    IndividualDistanceChange,
    /// Each agent's part of `RunningMinimum` of the mean distance: d_i where the minimum falls, minus d_i where it fell
    /// last.
    IndividualRunningMinimum,
    /// As `IndividualDistanceChange`, each agent the mean over those near it.
    NeighborhoodDistanceChange,
    /// G - G_-i, what the objective's value after an action gains by what agent i hears during it.
    Difference,
    /// J - m_0 on the last step, 0 before.
    Terminal,
}

/// What the terms look at after a step; distances in m, 0 of agents that were caught.
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
    /// Every agent's distance before and after the step.
    pub(crate) own_distances_before: &'a [f64],
    pub(crate) own_distances: &'a [f64],
    /// The same when the running minimum fell last before this step, or at the start.
    pub(crate) own_distances_at_minimum: &'a [f64],
    pub(crate) is_last: bool,
}

impl Reward {
    /// Whether rewards differ between agents, which needs one range per agent.
    pub(crate) fn is_individual(self) -> bool {
        match self {
            Self::IndividualDistance
            | Self::IndividualDistanceChange
            | Self::IndividualRunningMinimum
            | Self::NeighborhoodDistanceChange
            | Self::Difference => true,
            Self::RunningMinimum | Self::Distance | Self::Terminal => false,
        }
    }

    /// Adds the reward of `moment` to `rewards`: one entry for the flock, or one per agent. `Difference` is a reward of
    /// the whole action, so it adds nothing here.
    pub(crate) fn add<const D: usize>(self, moment: &Moment<'_, D>, rewards: &mut [f64]) {
        let share = (moment.world.config().num_steps as f64).recip();
        let team = match self {
            Self::RunningMinimum => moment.minimum - moment.minimum_before,
            Self::Distance => moment.value * share,
            Self::IndividualDistance => {
                for (reward, own) in rewards.iter_mut().zip(moment.own_distances) {
                    *reward += own * share;
                }
                return;
            }
            Self::IndividualDistanceChange => {
                add_changes(moment.own_distances, moment.own_distances_before, rewards);
                return;
            }
            Self::IndividualRunningMinimum => {
                if moment.minimum < moment.minimum_before {
                    add_changes(
                        moment.own_distances,
                        moment.own_distances_at_minimum,
                        rewards,
                    );
                }
                return;
            }
            Self::NeighborhoodDistanceChange => {
                neighborhood::add_mean_changes(moment, rewards);
                return;
            }
            Self::Difference => return,
            Self::Terminal if moment.is_last => moment.minimum - moment.minimum_at_start,
            Self::Terminal => 0.0,
        };
        for reward in rewards {
            *reward += team;
        }
    }
}

fn add_changes(now: &[f64], before: &[f64], rewards: &mut [f64]) {
    for ((reward, now), before) in rewards.iter_mut().zip(now).zip(before) {
        *reward += now - before;
    }
}
