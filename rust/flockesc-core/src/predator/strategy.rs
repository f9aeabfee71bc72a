//! `Strategy`: the trait of a predator's strategy, and the macro that generates the enum of all strategies.

use std::fmt::Debug;

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::shared::prey::Prey;
use super::shared::start::Start;
use crate::base::error::Result;

/// The rule by which a predator sets its next velocity (step 5).
pub(super) trait Strategy: Start + Sized + 'static {
    /// The state of the strategy between steps.
    type Memory<const D: usize>: Memory;

    /// Checks the parameters of the predator at `index` of `count`. `path` is the strategy's path in the
    /// scenario.
    fn check(&self, path: &str, index: usize, count: usize) -> Result<()>;

    /// Checks the conditions on all predators with this strategy together.
    fn check_all<'a>(_predators: impl Iterator<Item = &'a Self>) -> Result<()> {
        Ok(())
    }

    /// Returns the limits of actions, if the predator is controlled by actions.
    fn action_limits(&self) -> Option<ActionLimits> {
        None
    }

    /// Stores the action for the next steps, a vector of norm at most 1.
    fn set_action<const D: usize>(_memory: &mut Self::Memory<D>, _action: SVector<f64, D>) {}

    /// Prepares a step from the state before it.
    fn prepare<const D: usize>(
        _pack: &mut (impl Pack<Self, D> + ?Sized),
        _time_step: f64,
        _prey: Prey<'_, D>,
    ) {
    }

    /// Makes the joint decisions of all predators with this strategy, before any of them turns.
    fn coordinate<const D: usize>(
        _pack: &mut (impl Pack<Self, D> + ?Sized),
        _time_step: f64,
        _prey: Prey<'_, D>,
    ) {
    }

    /// Returns the velocity in m/s for the next step, and its norm.
    fn steer<const D: usize>(
        &self,
        memory: &mut Self::Memory<D>,
        flight: &Flight<D>,
        surroundings: &mut Surroundings<'_, D>,
    ) -> (SVector<f64, D>, f64);
}

/// Position and velocity of a predator.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Flight<const D: usize> {
    /// r_p in m.
    pub(crate) position: SVector<f64, D>,
    /// v_p in m/s.
    pub(crate) velocity: SVector<f64, D>,
    /// ||v_p|| in m/s.
    pub(crate) speed: f64,
}

/// The input of a strategy: the agents at the end of a step, and the random stream of the predators.
#[derive(Debug)]
pub(crate) struct Surroundings<'a, const D: usize> {
    /// dt in s.
    pub(crate) time_step: f64,
    pub(crate) prey: Prey<'a, D>,
    pub(crate) rng: &'a mut ChaCha8Rng,
}

/// Limits of the actions of a learned predator.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ActionLimits {
    /// Largest speed in m/s.
    pub(crate) max_speed: f64,
}

/// The state of a strategy between steps, which is part of snapshots.
pub(crate) trait Memory: Debug + Clone + Default + Serialize + DeserializeOwned {
    /// Checks a memory from a snapshot of a flock that had `num_agents` agents at t = 0.
    fn check(&self, num_agents: usize) -> Result<()>;
}

impl Memory for () {
    fn check(&self, _num_agents: usize) -> Result<()> {
        Ok(())
    }
}

/// All predators of a flock, with access to the memory of those with the strategy `S`.
pub(crate) trait Pack<S: Strategy, const D: usize> {
    /// Returns the number of predators of all strategies.
    fn len(&self) -> usize;

    /// Returns the position and velocity of the predator at `index`.
    fn flight(&self, index: usize) -> Flight<D>;

    /// Returns the predator at `index`, if it has the strategy `S`.
    fn member(&mut self, index: usize) -> Option<Member<'_, S, D>>;

    /// Returns the predators with the strategy `S`.
    fn members(&mut self) -> impl Iterator<Item = Member<'_, S, D>>;
}

/// A predator with the strategy `S`.
pub(crate) struct Member<'a, S: Strategy, const D: usize> {
    /// r_p in m.
    pub(crate) position: SVector<f64, D>,
    pub(crate) strategy: &'a S,
    pub(crate) memory: &'a mut S::Memory<D>,
}

/// Generates [`PredatorConfig`](super::PredatorConfig) and all code that matches on a strategy. The name of a
/// strategy in documents is the name of its module.
macro_rules! strategies {
    ($($(#[$about:meta])* $module:ident::$Strategy:ident,)*) => {
        $(pub use $module::$Strategy;)*

        /// A predator of a scenario: its strategy and initial state.
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum PredatorConfig {
            $($(#[$about])* $Strategy($Strategy),)*
        }

        impl PredatorConfig {
            /// Names of all strategies in documents.
            pub const KINDS: &[&str] = &[$(stringify!($module)),*];

            /// Returns the name of the strategy in documents.
            fn kind(&self) -> &'static str {
                match self {
                    $(Self::$Strategy(_) => stringify!($module),)*
                }
            }

            /// Returns whether an initial state cannot replace the initial position and velocity.
            pub(crate) fn has_fixed_start(&self) -> bool {
                match self {
                    $(Self::$Strategy(_) => $Strategy::IS_FIXED,)*
                }
            }

            /// Checks the fields of the initial position and velocity.
            fn check_start(&self, path: &str, dimension: usize) -> Result<()> {
                match self {
                    $(Self::$Strategy(strategy) => strategy.check_start(path, dimension),)*
                }
            }

            /// Returns the initial position in m and velocity in m/s.
            fn start<const D: usize>(&self, time_step: f64) -> (SVector<f64, D>, SVector<f64, D>) {
                match self {
                    $(Self::$Strategy(strategy) => strategy.start(time_step),)*
                }
            }

            /// Checks the strategy's parameters.
            fn check_strategy(&self, path: &str, index: usize, count: usize) -> Result<()> {
                match self {
                    $(Self::$Strategy(strategy) => strategy.check(path, index, count),)*
                }
            }

            /// Returns the limits of actions, if the predator is controlled by actions.
            fn action_limits(&self) -> Option<ActionLimits> {
                match self {
                    $(Self::$Strategy(strategy) => strategy.action_limits(),)*
                }
            }

            /// Checks the conditions on all predators of a strategy together.
            fn check_all(predators: &[Self]) -> Result<()> {
                $($Strategy::check_all(predators.iter().filter_map($Strategy::of_config))?;)*
                Ok(())
            }
        }

        /// A strategy and its memory.
        #[derive(Debug, Clone)]
        enum StrategyState<const D: usize> {
            $($Strategy($Strategy, <$Strategy as Strategy>::Memory<D>),)*
        }

        impl<const D: usize> StrategyState<D> {
            fn new(config: &PredatorConfig) -> Self {
                match config {
                    $(PredatorConfig::$Strategy(strategy) => {
                        Self::$Strategy(strategy.clone(), Default::default())
                    })*
                }
            }

            /// Restores the memory from a snapshot.
            fn restore(config: &PredatorConfig, memory: &[u8], num_agents: usize) -> Result<Self> {
                Ok(match config {
                    $(PredatorConfig::$Strategy(strategy) => {
                        let memory: <$Strategy as Strategy>::Memory<D> = snapshot::read(memory)?;
                        memory.check(num_agents)?;
                        Self::$Strategy(strategy.clone(), memory)
                    })*
                })
            }

            /// Serializes the memory.
            fn save(&self) -> Vec<u8> {
                match self {
                    $(Self::$Strategy(_, memory) => snapshot::write(memory),)*
                }
            }

            fn action_limits(&self) -> Option<ActionLimits> {
                match self {
                    $(Self::$Strategy(strategy, _) => strategy.action_limits(),)*
                }
            }

            fn set_action(&mut self, action: SVector<f64, D>) {
                match self {
                    $(Self::$Strategy(_, memory) => $Strategy::set_action(memory, action),)*
                }
            }

            fn steer(&mut self, flight: &Flight<D>, surroundings: &mut Surroundings<'_, D>) -> (SVector<f64, D>, f64) {
                match self {
                    $(Self::$Strategy(strategy, memory) => strategy.steer(memory, flight, surroundings),)*
                }
            }
        }

        /// Prepares a step of all predators from the state before it.
        pub(crate) fn prepare<const D: usize>(predators: &mut [Predator<D>], time_step: f64, prey: Prey<'_, D>) {
            $($Strategy::prepare(predators, time_step, prey);)*
        }

        /// Makes the joint decisions of the predators of every strategy.
        fn coordinate<const D: usize>(predators: &mut [Predator<D>], time_step: f64, prey: Prey<'_, D>) {
            $($Strategy::coordinate(predators, time_step, prey);)*
        }

        $(impl Listed for $Strategy {
            fn of_config(config: &PredatorConfig) -> Option<&Self> {
                if let PredatorConfig::$Strategy(strategy) = config {
                    return Some(strategy);
                }
                None
            }

            fn of<const D: usize>(predator: &mut Predator<D>) -> Option<Member<'_, Self, D>> {
                let position = predator.position;
                if let StrategyState::$Strategy(strategy, memory) = &mut predator.strategy {
                    return Some(Member { position, strategy, memory });
                }
                None
            }
        })*
    };
}
pub(super) use strategies;
