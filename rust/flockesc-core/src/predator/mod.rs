//! Predators: one strategy per file, each the rule that sets a predator's next velocity (step 5).

mod constant_velocity;
mod encircle;
mod herd;
mod intercept;
mod learned;
mod pure_pursuit;
mod shared;
mod state;
mod strategy;
mod wandering;

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;

pub use pure_pursuit::Target;
pub(crate) use shared::prey::Prey;
pub(crate) use shared::sighting::Sighting;
pub(crate) use state::PredatorState;

use strategy::{Flight, Member, Pack, Recall, Steered, Strategy, Surroundings, strategies};

use crate::base::check;
use crate::base::error::Result;
use crate::snapshot;

strategies! {
    /// Flies straight on.
    constant_velocity::ConstantVelocity,
    /// Turns toward an agent or the whole flock.
    pure_pursuit::PurePursuit,
    /// Turns as the line of sight to the nearest agent turns.
    intercept::Intercept,
    /// Turns at random.
    wandering::Wandering,
    /// Turns toward a station on a circle around the flock.
    encircle::Encircle,
    /// Turns toward a place behind the flock.
    herd::Herd,
    /// Accelerates as an action from outside says.
    learned::Learned,
}

impl PredatorConfig {
    /// Whether it is steered from outside.
    pub(crate) fn is_steered(&self) -> bool {
        self.steered().is_some()
    }

    /// Checks the predator with this `index` among `count`.
    fn check(&self, index: usize, count: usize, dimension: usize) -> Result<()> {
        let path = format!("predators[{index}].{}", self.kind());
        let (position, velocity) = self.start();
        for (name, entries) in [("position", position), ("velocity", velocity)] {
            check::vector(&format!("{path}.{name}"), entries, dimension)?;
        }
        self.check_strategy(&path, index, count)
    }
}

/// Checks all predators of a scenario.
pub(crate) fn check(predators: &[PredatorConfig], dimension: usize) -> Result<()> {
    for (index, predator) in predators.iter().enumerate() {
        predator.check(index, predators.len(), dimension)?;
    }
    PredatorConfig::check_all(predators)
}

/// A predator in flight.
#[derive(Debug, Clone)]
pub struct Predator<const D: usize> {
    /// r_p in m.
    pub position: SVector<f64, D>,
    /// v_p in m/s.
    pub velocity: SVector<f64, D>,
    /// ||v_p|| in m/s. Stored, because the norm of a velocity that turned a million times has as many rounding errors.
    speed: f64,
    mind: Mind<D>,
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
            mind: Mind::new(config),
        }
    }

    /// Replaces its velocity by one of any norm.
    pub(crate) fn fly(&mut self, velocity: SVector<f64, D>) {
        self.velocity = velocity;
        self.speed = velocity.norm();
    }

    fn flight(&self) -> Flight<D> {
        Flight {
            position: self.position,
            velocity: self.velocity,
            speed: self.speed,
        }
    }
}

/// A strategy in the list: access to its parameters and memory.
trait Listed: Strategy {
    /// The parameters, if `config` is of this strategy.
    fn of_config(config: &PredatorConfig) -> Option<&Self>;

    /// The predator, if it is of this strategy.
    fn of<const D: usize>(predator: &mut Predator<D>) -> Option<Member<'_, Self, D>>;
}

impl<S: Listed, const D: usize> Pack<S, D> for [Predator<D>] {
    fn len(&self) -> usize {
        self.len()
    }

    fn flight(&self, index: usize) -> Flight<D> {
        self[index].flight()
    }

    fn member(&mut self, index: usize) -> Option<Member<'_, S, D>> {
        S::of(&mut self[index])
    }

    fn members(&mut self) -> impl Iterator<Item = Member<'_, S, D>> {
        self.iter_mut().filter_map(S::of)
    }
}

/// What the predator at `index` sees; `None` if it is not steered from outside.
pub(crate) fn sighting<const D: usize>(
    predators: &[Predator<D>],
    index: usize,
    prey: Prey<'_, D>,
) -> Option<Sighting<D>> {
    let steered = predators[index].mind.steered()?;
    let others = predators.iter().enumerate().filter(|(k, _)| *k != index);
    let others = others.map(|(_, other)| other.position);
    let own = predators[index].flight();
    Some(Sighting::of(&own, steered, others, prey))
}

/// Sets the actions of the predators that are steered from outside: D entries in [-1, 1] for each, in order. Missing
/// ones are 0.
pub(crate) fn set_actions<const D: usize>(predators: &mut [Predator<D>], actions: &[f64]) {
    let mut given = actions.chunks_exact(D);
    for predator in predators.iter_mut().filter(|p| p.mind.steered().is_some()) {
        let action = given.next().map(SVector::<f64, D>::from_column_slice);
        let action = action.unwrap_or_else(SVector::zeros);
        // An action in a corner of its box is no stronger than one along an axis.
        predator.mind.set_action(action / action.norm().max(1.0));
    }
}

/// Sets the next velocities of all predators. They see each other and the agents at the end of the step. Random numbers
/// come from `rng`.
pub(crate) fn steer<const D: usize>(
    predators: &mut [Predator<D>],
    time_step: f64,
    prey: Prey<'_, D>,
    rng: &mut ChaCha8Rng,
) {
    agree(predators, time_step, prey);
    let mut surroundings = Surroundings {
        time_step,
        prey,
        rng,
    };
    for predator in predators {
        let flight = predator.flight();
        (predator.velocity, predator.speed) = predator.mind.steer(&flight, &mut surroundings);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Documents name a strategy by the name of its module.
    #[test]
    fn kinds_are_the_names_in_documents() {
        for kind in PredatorConfig::KINDS {
            let document = format!(r#"{{"{kind}": {{}}}}"#);
            let error = serde_json::from_str::<PredatorConfig>(&document).expect_err("no fields");
            assert!(error.to_string().starts_with("missing field"), "{error}");
        }
    }
}
