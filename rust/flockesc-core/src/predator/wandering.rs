//! The wandering strategy: rotational diffusion of the heading at constant speed.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::shared::{Predator, Surroundings};
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

impl Wandering {
    pub(super) fn check(&self, path: &str) -> Result<()> {
        let field = format!("{path}.angular_diffusion");
        quantity(&field, self.angular_diffusion)
    }

    pub(super) fn steer<const D: usize>(
        &self,
        own: &mut Predator<D>,
        surroundings: &mut Surroundings<'_, D>,
    ) {
        let drawn = SVector::<f64, D>::from_fn(|_, _| rng::normal(surroundings.rng));
        let Some(heading) = unit(&own.velocity) else {
            return;
        };
        // The component across the heading is an isotropic normal vector with D - 1 coordinates.
        let size = (drawn - heading * heading.dot(&drawn)).norm();
        let angle = size * (2.0 * self.angular_diffusion * surroundings.time_step).sqrt();
        if let Some(side) = side_of(&heading, &drawn) {
            own.velocity = turn(&heading, &side, angle) * own.speed;
        }
    }
}
