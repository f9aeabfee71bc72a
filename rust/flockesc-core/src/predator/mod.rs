//! Predators and their strategies, one per file. A strategy sets the predator's next velocity (step 5).

mod constant_velocity;
mod encircle;
mod herd;
mod intercept;
mod learned;
mod prescribed_path;
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

use shared::start::Start;
use strategy::{ActionLimits, Flight, Member, Memory, Pack, Strategy, Surroundings, strategies};

use crate::base::error::Result;
use crate::snapshot;

strategies! {
    /// Flies straight on.
    constant_velocity::ConstantVelocity,
    /// Turns toward an agent or the centroid of the flock.
    pure_pursuit::PurePursuit,
    /// Turns in proportion to the turn rate of the line of sight to the nearest agent.
    intercept::Intercept,
    /// Turns at random.
    wandering::Wandering,
    /// Turns toward a station on a circle around the flock.
    encircle::Encircle,
    /// Turns toward a point behind the flock.
    herd::Herd,
    /// Accelerates by the action of a policy.
    learned::Learned,
    /// Follows a prescribed path.
    prescribed_path::PrescribedPath,
}

impl PredatorConfig {
    /// Returns whether the predator is controlled by actions.
    pub(crate) fn is_learned(&self) -> bool {
        self.action_limits().is_some()
    }

    /// Checks the predator at `index` of `count`.
    fn check(&self, index: usize, count: usize, dimension: usize) -> Result<()> {
        let path = format!("predators[{index}].{}", self.kind());
        self.check_start(&path, dimension)?;
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

/// A predator and the state of its strategy.
#[derive(Debug, Clone)]
pub struct Predator<const D: usize> {
    /// r_p in m.
    pub position: SVector<f64, D>,
    /// v_p in m/s.
    pub velocity: SVector<f64, D>,
    /// ||v_p|| in m/s. It is stored, because the norm of the velocity accumulates a rounding error in every
    /// turn.
    speed: f64,
    strategy: StrategyState<D>,
}

impl<const D: usize> Predator<D> {
    /// Creates the predator at t = 0 for steps of `time_step` s. Missing coordinates are 0.
    #[must_use]
    pub fn new(config: &PredatorConfig, time_step: f64) -> Self {
        let (position, velocity) = config.start(time_step);
        Self {
            position,
            velocity,
            speed: velocity.norm(),
            strategy: StrategyState::new(config),
        }
    }

    /// Sets the velocity in m/s.
    pub(crate) fn set_velocity(&mut self, velocity: SVector<f64, D>) {
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

/// A strategy in the list of all strategies. Gives access to its parameters and memory.
trait Listed: Strategy {
    /// Returns the parameters, if `config` has this strategy.
    fn of_config(config: &PredatorConfig) -> Option<&Self>;

    /// Returns the predator, if it has this strategy.
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

/// Returns the observation of the predator at `index`, or `None` if it is not a learned predator.
pub(crate) fn sighting<const D: usize>(
    predators: &[Predator<D>],
    index: usize,
    prey: Prey<'_, D>,
) -> Option<Sighting<D>> {
    let limits = predators[index].strategy.action_limits()?;
    let others = predators.iter().enumerate().filter(|(k, _)| *k != index);
    let others = others.map(|(_, other)| other.position);
    let own = predators[index].flight();
    Some(Sighting::of(&own, limits, others, prey))
}

/// Sets the actions of the learned predators: D entries in [-1, 1] per predator, in order. Missing actions
/// are 0.
pub(crate) fn set_actions<const D: usize>(predators: &mut [Predator<D>], actions: &[f64]) {
    let mut given = actions.chunks_exact(D);
    let is_learned = |p: &&mut Predator<D>| p.strategy.action_limits().is_some();
    for predator in predators.iter_mut().filter(is_learned) {
        let action = given.next().map(SVector::<f64, D>::from_column_slice);
        let action = action.unwrap_or_else(SVector::zeros);
        // The norm is limited to 1, so that the acceleration does not depend on the direction of the action.
        predator
            .strategy
            .set_action(action / action.norm().max(1.0));
    }
}

/// Sets the next velocities of all predators, from the positions of agents and predators at the end of the
/// step. Random numbers come from `rng`.
pub(crate) fn steer<const D: usize>(
    predators: &mut [Predator<D>],
    time_step: f64,
    prey: Prey<'_, D>,
    rng: &mut ChaCha8Rng,
) {
    coordinate(predators, time_step, prey);
    let mut surroundings = Surroundings {
        time_step,
        prey,
        rng,
    };
    for predator in predators {
        let flight = predator.flight();
        (predator.velocity, predator.speed) = predator.strategy.steer(&flight, &mut surroundings);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The name of a strategy in documents is the name of its module.
    #[test]
    fn documents_accept_all_kinds() {
        for kind in PredatorConfig::KINDS {
            let document = format!(r#"{{"{kind}": {{}}}}"#);
            let error = serde_json::from_str::<PredatorConfig>(&document).expect_err("no fields");
            assert!(error.to_string().starts_with("missing field"), "{error}");
        }
    }
}
