//! The trait of a strategy, and what the list of all strategies generates.

use std::fmt::Debug;

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::shared::prey::Prey;
use crate::base::error::Result;

/// The rule by which a predator sets its next velocity (step 5).
pub(crate) trait Strategy: Sized + 'static {
    /// What a predator with this strategy remembers between steps.
    type Memory<const D: usize>: Recall;

    /// Checks the parameters of the predator with this `index` among `count`; errors begin with `path`.
    fn check(&self, path: &str, index: usize, count: usize) -> Result<()>;

    /// Checks what must hold for all predators of this strategy together.
    fn check_all<'a>(_predators: impl Iterator<Item = &'a Self>) -> Result<()> {
        Ok(())
    }

    /// What an action can do, if the predator is steered from outside.
    fn steered(&self) -> Option<Steered> {
        None
    }

    /// Stores the action that steers the predator from now on, of norm 1 at most.
    fn set_action<const D: usize>(_memory: &mut Self::Memory<D>, _action: SVector<f64, D>) {}

    /// Prepares a step, before anything moves.
    fn prepare<const D: usize>(
        _pack: &mut (impl Pack<Self, D> + ?Sized),
        _time_step: f64,
        _prey: Prey<'_, D>,
    ) {
    }

    /// Settles what predators of this strategy decide together, before any of them turns.
    fn agree<const D: usize>(
        _pack: &mut (impl Pack<Self, D> + ?Sized),
        _time_step: f64,
        _prey: Prey<'_, D>,
    ) {
    }

    /// The velocity in m/s for the next step, and its norm.
    fn steer<const D: usize>(
        &self,
        memory: &mut Self::Memory<D>,
        flight: &Flight<D>,
        surroundings: &mut Surroundings<'_, D>,
    ) -> (SVector<f64, D>, f64);
}

/// Where a predator is and how it moves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Flight<const D: usize> {
    /// r_p in m.
    pub(crate) position: SVector<f64, D>,
    /// v_p in m/s.
    pub(crate) velocity: SVector<f64, D>,
    /// ||v_p|| in m/s.
    pub(crate) speed: f64,
}

/// What a predator turns in: the agents at the end of a step, and the stream of what is random about predators.
#[derive(Debug)]
pub(crate) struct Surroundings<'a, const D: usize> {
    /// dt in s.
    pub(crate) time_step: f64,
    pub(crate) prey: Prey<'a, D>,
    pub(crate) rng: &'a mut ChaCha8Rng,
}

/// What an action from outside can do to a predator.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Steered {
    /// Largest speed in m/s.
    pub(crate) max_speed: f64,
}

/// What a predator remembers between steps; a snapshot holds it.
pub(crate) trait Recall: Debug + Clone + Default + Serialize + DeserializeOwned {
    /// Refuses a memory that no step of a flock of `num_agents` leaves.
    fn check(&self, num_agents: usize) -> Result<()>;
}

impl Recall for () {
    fn check(&self, _num_agents: usize) -> Result<()> {
        Ok(())
    }
}

/// All predators of a flock, as the strategy `S` sees them.
pub(crate) trait Pack<S: Strategy, const D: usize> {
    /// How many there are, of all strategies.
    fn len(&self) -> usize;

    /// Where the predator at `index` is and how it moves.
    fn flight(&self, index: usize) -> Flight<D>;

    /// The predator at `index`, if it is of this strategy.
    fn member(&mut self, index: usize) -> Option<Member<'_, S, D>>;

    /// The predators of this strategy.
    fn members(&mut self) -> impl Iterator<Item = Member<'_, S, D>>;
}

/// A predator of one strategy.
pub(crate) struct Member<'a, S: Strategy, const D: usize> {
    /// r_p in m.
    pub(crate) position: SVector<f64, D>,
    pub(crate) strategy: &'a S,
    pub(crate) memory: &'a mut S::Memory<D>,
}

/// Makes the list of all strategies: the enum of a scenario's predators, and everything that matches on a strategy.
/// A module has the name of its strategy in documents.
macro_rules! strategies {
    ($($(#[$about:meta])* $module:ident::$Strategy:ident,)*) => {
        $(pub use $module::$Strategy;)*

        /// A predator as a scenario names it.
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum PredatorConfig {
            $($(#[$about])* $Strategy($Strategy),)*
        }

        impl PredatorConfig {
            /// The names of all strategies in documents.
            pub const KINDS: &[&str] = &[$(stringify!($module)),*];

            /// The name of its strategy in documents.
            fn kind(&self) -> &'static str {
                match self {
                    $(Self::$Strategy(_) => stringify!($module),)*
                }
            }

            /// Position at t = 0 in m and velocity at t = 0 in m/s, each of length D or 2.
            fn start(&self) -> (&[f64], &[f64]) {
                match self {
                    $(Self::$Strategy(strategy) => (&strategy.position, &strategy.velocity),)*
                }
            }

            /// Checks the strategy's own parameters.
            fn check_strategy(&self, path: &str, index: usize, count: usize) -> Result<()> {
                match self {
                    $(Self::$Strategy(strategy) => strategy.check(path, index, count),)*
                }
            }

            /// What an action can do, if it is steered from outside.
            fn steered(&self) -> Option<Steered> {
                match self {
                    $(Self::$Strategy(strategy) => strategy.steered(),)*
                }
            }

            /// Checks what must hold for all predators of a strategy together.
            fn check_all(predators: &[Self]) -> Result<()> {
                $($Strategy::check_all(predators.iter().filter_map($Strategy::of_config))?;)*
                Ok(())
            }
        }

        /// A strategy and its memory.
        #[derive(Debug, Clone)]
        enum Mind<const D: usize> {
            $($Strategy($Strategy, <$Strategy as Strategy>::Memory<D>),)*
        }

        impl<const D: usize> Mind<D> {
            fn new(config: &PredatorConfig) -> Self {
                match config {
                    $(PredatorConfig::$Strategy(strategy) => {
                        Self::$Strategy(strategy.clone(), Default::default())
                    })*
                }
            }

            /// The memory of a snapshot, with its strategy.
            fn restore(config: &PredatorConfig, memory: &[u8], num_agents: usize) -> Result<Self> {
                Ok(match config {
                    $(PredatorConfig::$Strategy(strategy) => {
                        let memory: <$Strategy as Strategy>::Memory<D> = snapshot::read(memory)?;
                        memory.check(num_agents)?;
                        Self::$Strategy(strategy.clone(), memory)
                    })*
                })
            }

            /// The memory as bytes.
            fn save(&self) -> Vec<u8> {
                match self {
                    $(Self::$Strategy(_, memory) => snapshot::write(memory),)*
                }
            }

            fn steered(&self) -> Option<Steered> {
                match self {
                    $(Self::$Strategy(strategy, _) => strategy.steered(),)*
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

        /// Prepares a step for the predators of every strategy, before anything moves.
        pub(crate) fn prepare<const D: usize>(predators: &mut [Predator<D>], time_step: f64, prey: Prey<'_, D>) {
            $($Strategy::prepare(predators, time_step, prey);)*
        }

        /// Settles what the predators of every strategy decide together.
        fn agree<const D: usize>(predators: &mut [Predator<D>], time_step: f64, prey: Prey<'_, D>) {
            $($Strategy::agree(predators, time_step, prey);)*
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
                if let Mind::$Strategy(strategy, memory) = &mut predator.mind {
                    return Some(Member { position, strategy, memory });
                }
                None
            }
        })*
    };
}
pub(super) use strategies;
