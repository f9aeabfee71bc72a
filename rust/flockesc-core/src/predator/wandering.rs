//! The wandering strategy: rotational diffusion of the heading at constant speed.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::shared::start::given_start;
use super::strategy::{Flight, Strategy, Surroundings};
use crate::base::check::quantity;
use crate::base::error::Result;
use crate::base::rng;
use crate::base::vector::{side_of, turn, unit};

/// Turns at random, independently of the flock.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wandering {
    /// r_p(0) in m.
    pub position: Vec<f64>,
    /// v_p(0) in m/s. The speed is constant.
    pub velocity: Vec<f64>,
    /// Rotational diffusion coefficient of the heading in rad^2/s, at least 0.
    pub angular_diffusion: f64,
}

given_start!(Wandering);

impl Wandering {
    /// Returns the next velocity; `speed` is the norm of `velocity`.
    fn turned<const D: usize>(
        &self,
        velocity: &SVector<f64, D>,
        speed: f64,
        time_step: f64,
        rng: &mut ChaCha8Rng,
    ) -> SVector<f64, D> {
        let drawn = SVector::<f64, D>::from_fn(|_, _| rng::normal(rng));
        let Some(heading) = unit(velocity) else {
            return *velocity;
        };
        // The component across the heading is an isotropic normal vector with D - 1 coordinates.
        let size = (drawn - heading * heading.dot(&drawn)).norm();
        let angle = size * (2.0 * self.angular_diffusion * time_step).sqrt();
        match side_of(&heading, &drawn) {
            Some(side) => turn(&heading, &side, angle) * speed,
            None => *velocity,
        }
    }
}

impl Strategy for Wandering {
    type Memory<const D: usize> = ();

    fn check(&self, path: &str, _index: usize, _count: usize) -> Result<()> {
        let field = format!("{path}.angular_diffusion");
        quantity(&field, self.angular_diffusion)
    }

    fn steer<const D: usize>(
        &self,
        (): &mut (),
        flight: &Flight<D>,
        surroundings: &mut Surroundings<'_, D>,
    ) -> (SVector<f64, D>, f64) {
        let (velocity, speed) = (&flight.velocity, flight.speed);
        let turned = self.turned(velocity, speed, surroundings.time_step, surroundings.rng);
        (turned, speed)
    }
}
