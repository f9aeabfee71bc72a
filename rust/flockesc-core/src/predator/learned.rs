//! A predator that is steered from outside: an action accelerates it in its own frame.

use nalgebra::SVector;
use serde::Deserialize;

use super::shared::prey::Prey;
use super::shared::sighting::Sighting;
use super::{Predator, PredatorConfig};
use crate::base::check::{positive_quantity, quantity};
use crate::base::error::Result;

/// Accelerates as an action says; without one it flies straight on.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Learned {
    /// r_p(0) in m.
    pub position: Vec<f64>,
    /// v_p(0) in m/s.
    pub velocity: Vec<f64>,
    /// Acceleration in m/s^2 of an action of norm 1, at least 0.
    pub max_acceleration: f64,
    /// Speed in m/s that no step leaves it beyond, from 1e-20 to 1e20.
    pub max_speed: f64,
}

impl Learned {
    pub(super) fn check(&self, path: &str) -> Result<()> {
        quantity(&format!("{path}.max_acceleration"), self.max_acceleration)?;
        positive_quantity(&format!("{path}.max_speed"), self.max_speed)
    }

    /// v_p + `push`, shortened to `max_speed` where it is longer.
    pub(super) fn steer<const D: usize>(
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

/// Sets what learned predators are steered by: D entries in [-1, 1] for each of them, in order; none: 0.
pub(crate) fn control<const D: usize>(predators: &mut [Predator<D>], controls: &[f64]) {
    let mut given = controls.chunks_exact(D);
    for predator in predators.iter_mut().filter(|p| p.learned().is_some()) {
        let control = given.next().map(SVector::<f64, D>::from_column_slice);
        let control = control.unwrap_or_else(SVector::zeros);
        // An action in a corner of its box is no stronger than one along an axis.
        predator.control = control / control.norm().max(1.0);
    }
}

/// Works out the accelerations of the step to come, from what learned predators see before anything moves.
pub(crate) fn accelerate<const D: usize>(
    predators: &mut [Predator<D>],
    time_step: f64,
    prey: Prey<'_, D>,
) {
    for index in 0..predators.len() {
        let Some(strategy) = predators[index].learned() else {
            continue;
        };
        let size = strategy.max_acceleration * time_step;
        let control = predators[index].control;
        predators[index].push = if control.norm() > 0.0 {
            Sighting::of(predators, index, prey)
                .frame()
                .vector(&control)
                * size
        } else {
            SVector::zeros()
        };
    }
}

impl<const D: usize> Predator<D> {
    /// Its parameters, if it is learned.
    pub(crate) fn learned(&self) -> Option<&Learned> {
        match &self.strategy {
            PredatorConfig::Learned(strategy) => Some(strategy),
            PredatorConfig::ConstantVelocity(_)
            | PredatorConfig::PurePursuit(_)
            | PredatorConfig::Intercept(_)
            | PredatorConfig::Wandering(_)
            | PredatorConfig::Encircle(_)
            | PredatorConfig::Herd(_) => None,
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
        let next = learned.steer(&vector![3.0, 0.0], &vector![0.0, 4.0]);
        assert_eq!(next, vector![3.0, 4.0]);
        let next = learned.steer(&vector![3.0, 0.0], &vector![3.0, 8.0]);
        assert!((next - vector![3.0, 4.0]).norm() < 1e-15);
    }
}
