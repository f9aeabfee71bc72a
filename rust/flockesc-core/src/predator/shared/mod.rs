//! `Predator`: position, velocity and memory of a predator, and code that several strategies share.

pub(super) mod prey;
pub(super) mod sighting;
pub(super) mod steering;

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use prey::Prey;

/// A predator and what its strategy remembers between steps. Each strategy uses some of the private fields.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Predator<const D: usize> {
    /// r_p in m.
    pub position: SVector<f64, D>,
    /// v_p in m/s.
    pub velocity: SVector<f64, D>,
    /// ||v_p|| in m/s. It is stored, because the norm of the velocity accumulates a rounding error in every
    /// turn.
    pub(crate) speed: f64,
    /// Number of steps so far.
    pub(crate) steps: usize,
    /// Id of the target of a predator with a confusion rate.
    pub(crate) target: Option<usize>,
    /// The point in m to turn toward: an assigned agent, a station or a driving position.
    pub(crate) aim: Option<SVector<f64, D>>,
    /// The action in the predator's body frame, of norm at most 1.
    pub(crate) action: SVector<f64, D>,
    /// The change of velocity in m/s that the action causes in the current step.
    pub(crate) push: SVector<f64, D>,
}

impl<const D: usize> Predator<D> {
    /// Creates a predator without memory.
    pub(crate) fn new(position: SVector<f64, D>, velocity: SVector<f64, D>) -> Self {
        Self {
            position,
            velocity,
            speed: velocity.norm(),
            steps: 0,
            target: None,
            aim: None,
            action: SVector::zeros(),
            push: SVector::zeros(),
        }
    }

    /// Sets the velocity in m/s.
    pub(crate) fn set_velocity(&mut self, velocity: SVector<f64, D>) {
        self.velocity = velocity;
        self.speed = velocity.norm();
    }
}

/// The input of a strategy: the agents at the end of a step, and the random stream of the predators.
#[derive(Debug)]
pub(crate) struct Surroundings<'a, const D: usize> {
    /// dt in s.
    pub(crate) time_step: f64,
    pub(crate) prey: Prey<'a, D>,
    pub(crate) rng: &'a mut ChaCha8Rng,
}
