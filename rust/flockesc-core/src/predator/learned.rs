//! The learned strategy: an action sets the predator's acceleration in its body frame.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::shared::Predator;
use super::shared::prey::Prey;
use super::shared::sighting::Sighting;
use crate::base::check::{positive_quantity, quantity};
use crate::base::error::Result;

/// Accelerates by the action of a policy; without an action it flies straight on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Learned {
    /// r_p(0) in m.
    pub position: Vec<f64>,
    /// v_p(0) in m/s.
    pub velocity: Vec<f64>,
    /// Acceleration in m/s^2 for an action of norm 1, at least 0.
    pub max_acceleration: f64,
    /// Largest speed in m/s, from 1e-20 to 1e20.
    pub max_speed: f64,
}

impl Learned {
    pub(super) fn check(&self, path: &str) -> Result<()> {
        quantity(&format!("{path}.max_acceleration"), self.max_acceleration)?;
        positive_quantity(&format!("{path}.max_speed"), self.max_speed)
    }

    /// Returns the change of velocity in m/s that the action of the predator at `index` causes.
    pub(super) fn push<const D: usize>(
        &self,
        index: usize,
        predators: &[Predator<D>],
        time_step: f64,
        prey: Prey<'_, D>,
    ) -> SVector<f64, D> {
        let action = predators[index].action;
        if action.norm() <= 0.0 {
            return SVector::zeros();
        }
        let sighting = Sighting::of(index, predators, self.max_speed, prey);
        sighting.frame().vector(&action) * (self.max_acceleration * time_step)
    }

    pub(super) fn steer<const D: usize>(&self, own: &mut Predator<D>) {
        own.set_velocity(self.pushed(&own.velocity, &own.push));
    }

    /// Returns v_p + `push`, scaled down to `max_speed` if it is faster.
    fn pushed<const D: usize>(
        &self,
        velocity: &SVector<f64, D>,
        push: &SVector<f64, D>,
    ) -> SVector<f64, D> {
        let pushed = velocity + push;
        let speed = pushed.norm();
        if speed > self.max_speed {
            pushed * (self.max_speed / speed)
        } else {
            pushed
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::vector;

    #[test]
    fn is_no_faster_than_its_limit() {
        let learned = Learned {
            position: vec![],
            velocity: vec![],
            max_acceleration: 20.0,
            max_speed: 5.0,
        };
        let next = learned.pushed(&vector![3.0, 0.0], &vector![0.0, 4.0]);
        assert_eq!(next, vector![3.0, 4.0]);
        let next = learned.pushed(&vector![3.0, 0.0], &vector![3.0, 8.0]);
        assert!((next - vector![3.0, 4.0]).norm() < 1e-15);
    }
}
