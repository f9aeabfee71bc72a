//! Predators: one strategy per file, each the rule by which the next velocity is set (step 5).

mod constant_velocity;
mod encircle;
mod herd;
mod intercept;
mod learned;
mod pure_pursuit;
mod shared;
mod state;
mod wandering;

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

pub use constant_velocity::ConstantVelocity;
pub use encircle::Encircle;
pub use herd::Herd;
pub use intercept::Intercept;
pub use learned::Learned;
pub(crate) use learned::{accelerate, control};
pub use pure_pursuit::{PurePursuit, Target};
pub(crate) use shared::prey::Prey;
pub(crate) use shared::sighting::Sighting;
pub(crate) use state::PredatorState;
pub use wandering::Wandering;

use shared::assignment::MAX_SHARING;
use shared::flight::Limits;

use crate::base::check;
use crate::base::error::{Error, Result};

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
    /// Turns toward a station on a circle around the flock.
    Encircle(Encircle),
    /// Turns toward a place behind the flock.
    Herd(Herd),
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
            Self::Encircle(strategy) => (&strategy.position, &strategy.velocity),
            Self::Herd(strategy) => (&strategy.position, &strategy.velocity),
            Self::Learned(strategy) => (&strategy.position, &strategy.velocity),
        }
    }

    /// Whether it is steered from outside.
    pub(crate) fn is_learned(&self) -> bool {
        matches!(self, Self::Learned(_))
    }

    /// Checks the predator with this `index` among `count`.
    fn check(&self, index: usize, count: usize, dimension: usize) -> Result<()> {
        let kind = match self {
            Self::ConstantVelocity(_) => "constant_velocity",
            Self::PurePursuit(_) => "pure_pursuit",
            Self::Intercept(_) => "intercept",
            Self::Wandering(_) => "wandering",
            Self::Encircle(_) => "encircle",
            Self::Herd(_) => "herd",
            Self::Learned(_) => "learned",
        };
        let path = format!("predators[{index}].{kind}");
        let (position, velocity) = self.start();
        for (name, entries) in [("position", position), ("velocity", velocity)] {
            check::vector(&format!("{path}.{name}"), entries, dimension)?;
        }
        match self {
            Self::ConstantVelocity(_) => Ok(()),
            Self::PurePursuit(strategy) => strategy.check(&path),
            Self::Intercept(strategy) => strategy.check(&path),
            Self::Wandering(strategy) => strategy.check(&path),
            Self::Encircle(strategy) => strategy.check(&path),
            Self::Herd(strategy) => strategy.check(&path, index, count),
            Self::Learned(strategy) => strategy.check(&path),
        }
    }

    fn shares_targets(&self) -> bool {
        matches!(self, Self::PurePursuit(strategy) if strategy.target == Target::Assigned)
    }
}

/// Checks all predators of a scenario.
pub(crate) fn check(predators: &[PredatorConfig], dimension: usize) -> Result<()> {
    for (index, predator) in predators.iter().enumerate() {
        predator.check(index, predators.len(), dimension)?;
    }
    let sharing = predators.iter().filter(|p| p.shares_targets()).count();
    if sharing > MAX_SHARING {
        let expected = format!("at most {MAX_SHARING} with assigned targets");
        return Err(Error::config("predators", expected, sharing));
    }
    Ok(())
}

/// A predator in flight.
#[derive(Debug, Clone)]
pub struct Predator<const D: usize> {
    /// r_p in m.
    pub position: SVector<f64, D>,
    /// v_p in m/s.
    pub velocity: SVector<f64, D>,
    /// ||v_p|| in m/s, kept apart from v_p: the norm of what was turned a million times is off by as many roundings.
    speed: f64,
    strategy: PredatorConfig,
    /// Name of the agent that it is after, where it keeps to one.
    kept: Option<usize>,
    /// Where it aims as agreed with others, in m.
    agreed: Option<SVector<f64, D>>,
    /// Steps for which it has encircled the flock.
    steps: usize,
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
        let velocity: SVector<f64, D> = embed(velocity);
        Self {
            position: embed(position),
            velocity,
            speed: velocity.norm(),
            strategy: config.clone(),
            kept: None,
            agreed: None,
            steps: 0,
            control: SVector::zeros(),
            push: SVector::zeros(),
        }
    }

    /// Gives it another velocity, of any norm.
    pub(crate) fn fly(&mut self, velocity: SVector<f64, D>) {
        self.velocity = velocity;
        self.speed = velocity.norm();
    }

    fn shares_targets(&self) -> bool {
        self.strategy.shares_targets()
    }

    fn steer(&mut self, time_step: f64, prey: Prey<'_, D>, rng: &mut ChaCha8Rng) {
        let (position, velocity, agreed) = (&self.position, &self.velocity, self.agreed);
        let heading_toward = |aim: Option<SVector<f64, D>>, limits: &Limits| {
            aim.and_then(|aim| {
                let limit = limits.max_turn_rate * time_step;
                shared::steering::heading_toward(velocity, &(aim - position), limit)
            })
        };
        let (heading, limits) = match &self.strategy {
            PredatorConfig::ConstantVelocity(_) => return,
            PredatorConfig::Wandering(strategy) => {
                self.velocity = strategy.steer(velocity, self.speed, time_step, rng);
                return;
            }
            PredatorConfig::PurePursuit(strategy) => {
                let (limits, kept) = (strategy.limits(), &mut self.kept);
                let aim = strategy.aim(position, time_step, prey, agreed, kept, rng);
                (heading_toward(aim, &limits), limits)
            }
            PredatorConfig::Intercept(strategy) => {
                let heading = strategy.heading(position, velocity, time_step, prey);
                (heading, strategy.limits())
            }
            PredatorConfig::Encircle(strategy) => {
                let limits = strategy.limits();
                (heading_toward(agreed, &limits), limits)
            }
            PredatorConfig::Learned(strategy) => {
                self.fly(strategy.steer(velocity, &self.push));
                return;
            }
            PredatorConfig::Herd(strategy) => {
                let limits = strategy.limits();
                (heading_toward(agreed, &limits), limits)
            }
        };
        (self.velocity, self.speed) = limits.next(velocity, self.speed, heading, time_step);
    }
}

/// Sets the next velocities of all predators, which see each other and the agents where they now are; what is random
/// comes from `rng`.
pub(crate) fn steer<const D: usize>(
    predators: &mut [Predator<D>],
    time_step: f64,
    prey: Prey<'_, D>,
    rng: &mut ChaCha8Rng,
) {
    // First all agree on where to fly, then everybody turns.
    shared::assignment::share_out(predators, prey);
    encircle::take_stations(predators, time_step, prey);
    herd::take_posts(predators, prey);
    for predator in predators {
        predator.steer(time_step, prey, rng);
    }
}
