//! `Predator`: position, velocity and memory of a predator; `Limits`: turns by a limited angle, and limits of the speed.

pub(super) mod prey;
pub(super) mod sighting;

use nalgebra::SVector;
use prey::Prey;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::base::check::{MAX_MAGNITUDE, quantity, require};
use crate::base::error::Result;
use crate::base::vector::{heading_toward, unit};

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
    pub(crate) target: Option<u32>,
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

/// Relative error of the norm of a velocity that was scaled to `max_speed`.
const ROUNDING: f64 = 1e-12;

/// Limits of a predator's turn rate and speed.
pub(crate) struct Limits {
    /// Largest turn rate in rad/s.
    turn_rate: f64,
    /// Largest speed in m/s; `None` is a constant speed.
    speed: Option<f64>,
    /// Rate in m/s^2 at which the speed increases.
    acceleration: f64,
}

impl Limits {
    pub(crate) fn new(turn_rate: f64, speed: Option<f64>, acceleration: f64) -> Self {
        Self {
            turn_rate,
            speed,
            acceleration,
        }
    }

    /// Checks the limits for a predator with the initial velocity `velocity`.
    pub(crate) fn check(&self, path: &str, velocity: &[f64]) -> Result<()> {
        quantity(&format!("{path}.max_turn_rate"), self.turn_rate)?;
        quantity(&format!("{path}.acceleration"), self.acceleration)?;
        let speed = velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
        let Some(fastest) = self.speed else {
            let (field, rate) = (format!("{path}.acceleration"), self.acceleration);
            return require(rate <= 0.0, &field, "0 without a max_speed", rate);
        };
        let is_fast = (speed * (1.0 - ROUNDING)..=MAX_MAGNITUDE).contains(&fastest);
        let expected = format!("a number from the initial speed {speed} to {MAX_MAGNITUDE:?}");
        require(is_fast, &format!("{path}.max_speed"), &expected, fastest)
    }

    /// Turns the velocity toward the point `aim` in m. Without an aim the predator flies straight on.
    pub(crate) fn turn_toward<const D: usize>(
        &self,
        aim: Option<SVector<f64, D>>,
        own: &mut Predator<D>,
        time_step: f64,
    ) {
        let limit = self.turn_rate * time_step;
        let heading =
            aim.and_then(|aim| heading_toward(&own.velocity, &(aim - own.position), limit));
        self.fly_along(heading, own, time_step);
    }

    /// Sets the velocity along the unit vector `heading`. Without a heading the predator flies straight on.
    pub(crate) fn fly_along<const D: usize>(
        &self,
        heading: Option<SVector<f64, D>>,
        own: &mut Predator<D>,
        time_step: f64,
    ) {
        let speed = match self.speed {
            Some(fastest) if own.speed < fastest => {
                (own.speed + self.acceleration * time_step).min(fastest)
            }
            _ => own.speed,
        };
        let straight_on = || unit(&own.velocity).filter(|_| speed > own.speed);
        // At a constant speed, a velocity straight on stays bitwise equal.
        if let Some(heading) = heading.or_else(straight_on) {
            own.velocity = heading * speed;
            own.speed = speed;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;

    #[test]
    fn the_speed_increases_to_its_limit_and_never_decreases() {
        let next = |max_speed, velocity: SVector<f64, 2>, heading| {
            let mut predator = Predator::new(vector![0.0, 0.0], velocity);
            Limits::new(1.0, max_speed, 4.0).fly_along(heading, &mut predator, 0.5);
            assert_eq!(predator.velocity.norm(), predator.speed);
            predator.velocity
        };
        let (up, still) = (Some(vector![0.0, 1.0]), vector![0.0, 0.0]);
        assert_eq!(next(Some(9.0), vector![3.0, 0.0], up), vector![0.0, 5.0]);
        assert_eq!(next(Some(4.5), vector![3.0, 0.0], up), vector![0.0, 4.5]);
        assert_eq!(next(Some(2.0), vector![3.0, 0.0], up), vector![0.0, 3.0]);
        assert_eq!(next(None, vector![3.0, 0.0], up), vector![0.0, 3.0]);
        assert_eq!(next(Some(9.0), vector![3.0, 0.0], None), vector![5.0, 0.0]);
        assert_eq!(next(Some(9.0), still, up), vector![0.0, 2.0]);
        assert_eq!(next(Some(9.0), still, None), still);
    }
}
