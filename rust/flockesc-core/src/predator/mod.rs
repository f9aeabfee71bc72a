//! Predators: one strategy per file, each the rule by which the next velocity is set (step 5).

mod constant_velocity;
mod intercept;
mod learned;
mod prey;
mod pure_pursuit;
mod sighting;
mod steering;
mod wandering;

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

pub use constant_velocity::ConstantVelocity;
pub use intercept::Intercept;
pub use learned::Learned;
pub(crate) use learned::{accelerate, control};
pub(crate) use prey::Prey;
pub use pure_pursuit::{PurePursuit, Target};
pub(crate) use sighting::Sighting;
pub use wandering::Wandering;

use crate::config;
use crate::error::Result;

/// A predator as a scenario names it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PredatorConfig {
    /// Flies straight on.
    ConstantVelocity(ConstantVelocity),
    /// Turns toward an agent or the whole flock.
    PurePursuit(PurePursuit),
    /// Turns as the line of sight to the nearest agent turns.
    Intercept(Intercept),
    /// Turns at random.
    Wandering(Wandering),
    /// Is steered from outside.
    Learned(Learned),
}

impl PredatorConfig {
    /// Position at t = 0 in m and velocity at t = 0 in m/s, of length D, or 2 for a predator in the plane.
    fn start(&self) -> (&[f64], &[f64]) {
        match self {
            Self::ConstantVelocity(strategy) => (&strategy.position, &strategy.velocity),
            Self::PurePursuit(strategy) => (&strategy.position, &strategy.velocity),
            Self::Intercept(strategy) => (&strategy.position, &strategy.velocity),
            Self::Wandering(strategy) => (&strategy.position, &strategy.velocity),
            Self::Learned(strategy) => (&strategy.position, &strategy.velocity),
        }
    }

    /// Whether it is steered from outside.
    pub(crate) fn is_learned(&self) -> bool {
        matches!(self, Self::Learned(_))
    }

    pub(crate) fn check(&self, path: &str, dimension: usize) -> Result<()> {
        let kind = match self {
            Self::ConstantVelocity(_) => "constant_velocity",
            Self::PurePursuit(_) => "pure_pursuit",
            Self::Intercept(_) => "intercept",
            Self::Wandering(_) => "wandering",
            Self::Learned(_) => "learned",
        };
        let (position, velocity) = self.start();
        for (name, entries) in [("position", position), ("velocity", velocity)] {
            config::vector(&format!("{path}.{kind}.{name}"), entries, dimension)?;
        }
        match self {
            Self::ConstantVelocity(_) => Ok(()),
            Self::PurePursuit(strategy) => strategy.check(&format!("{path}.{kind}")),
            Self::Intercept(strategy) => strategy.check(&format!("{path}.{kind}")),
            Self::Wandering(strategy) => strategy.check(&format!("{path}.{kind}")),
            Self::Learned(strategy) => strategy.check(&format!("{path}.{kind}")),
        }
    }
}

/// A predator in flight.
#[derive(Debug, Clone)]
pub struct Predator<const D: usize> {
    /// r_p in m.
    pub position: SVector<f64, D>,
    /// v_p in m/s.
    pub velocity: SVector<f64, D>,
    strategy: PredatorConfig,
    /// Name of the agent that it is after, where it keeps to one.
    kept: Option<usize>,
    /// What steers it, where it is learned: an action, and the change of velocity in m/s that the step being made owes to it.
    control: SVector<f64, D>,
    push: SVector<f64, D>,
}

impl<const D: usize> Predator<D> {
    /// The predator at t = 0; missing coordinates are 0.
    #[must_use]
    pub fn new(config: &PredatorConfig) -> Self {
        let (position, velocity) = config.start();
        let embed = |vector: &[f64]| SVector::from_fn(|k, _| vector.get(k).copied().unwrap_or(0.0));
        Self {
            position: embed(position),
            velocity: embed(velocity),
            strategy: config.clone(),
            kept: None,
            control: SVector::zeros(),
            push: SVector::zeros(),
        }
    }

    /// Sets the next velocity, seeing the agents where they now are; what is random comes from `rng`.
    pub(crate) fn steer(&mut self, time_step: f64, prey: Prey<'_, D>, rng: &mut ChaCha8Rng) {
        match &self.strategy {
            PredatorConfig::ConstantVelocity(_) => {}
            PredatorConfig::PurePursuit(strategy) => {
                let (position, velocity) = (&self.position, &self.velocity);
                let kept = &mut self.kept;
                self.velocity = strategy.steer(position, velocity, time_step, prey, kept, rng);
            }
            PredatorConfig::Intercept(strategy) => {
                self.velocity = strategy.steer(&self.position, &self.velocity, time_step, prey);
            }
            PredatorConfig::Wandering(strategy) => {
                self.velocity = strategy.steer(&self.velocity, time_step, rng);
            }
            PredatorConfig::Learned(strategy) => {
                self.velocity = strategy.steer(&self.velocity, &self.push);
            }
        }
    }
}
