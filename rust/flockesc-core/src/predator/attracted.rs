//! The attracted strategy: the velocity is a weighted sum over all agents, as in Y. Chen and T. Kolokolnikov, J. R. Soc.
//! Interface 11 (2014).

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::shared::{Predator, Surroundings};
use crate::base::check::{quantity, within_bounds};
use crate::base::error::Result;
use crate::base::exact::Scale;
use crate::base::vector::SHORTEST;

/// Largest weight of an agent in the sum. The weight divided by a distance above [`SHORTEST`], and the square of the
/// largest strength times the sum, are then finite.
const MAX_WEIGHT: f64 = 1e130;

/// Moves toward all agents at once: v_p = (c / n) times the sum of (r_i - r_p) / ||r_i - r_p||^p.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Attracted {
    /// r_p(0) in m.
    pub position: Vec<f64>,
    /// v_p(0) in m/s.
    pub velocity: Vec<f64>,
    /// Strength c in m^p/s, at least 0.
    pub strength: f64,
    /// Exponent p, from 0 to 10. An agent at the distance d contributes a speed proportional to d^(1 - p).
    pub exponent: f64,
    /// Largest speed in m/s, at least 0.
    pub max_speed: f64,
}

impl Attracted {
    pub(super) fn check(&self, path: &str) -> Result<()> {
        quantity(&format!("{path}.strength"), self.strength)?;
        within_bounds(&format!("{path}.exponent"), self.exponent, 0.0, 10.0)?;
        quantity(&format!("{path}.max_speed"), self.max_speed)
    }

    pub(super) fn steer<const D: usize>(
        &self,
        own: &mut Predator<D>,
        surroundings: &Surroundings<'_, D>,
    ) {
        let agents = surroundings.prey.agents;
        if agents.len() == 0 {
            return;
        }
        let pulls: Vec<SVector<f64, D>> = agents
            .iter()
            .map(|agent| self.pull(&(agent.position - own.position)))
            .collect();
        let largest = pulls.iter().map(SVector::amax).fold(0.0, f64::max);
        // Integers, because agents are not stored in the order of ids.
        let scale = Scale::new(largest, pulls.len());
        let mut sum = SVector::<i64, D>::zeros();
        for pull in &pulls {
            sum += pull.map(|entry| scale.truncate(entry));
        }
        let n = agents.len() as f64;
        let velocity = sum.map(|entry| scale.value(entry)) * (self.strength / n);
        let speed = velocity.norm();
        own.set_velocity(velocity * (self.max_speed / speed).min(1.0));
    }

    /// Returns the pull of an agent at `offset`.
    fn pull<const D: usize>(&self, offset: &SVector<f64, D>) -> SVector<f64, D> {
        let distance = offset.norm();
        if distance <= SHORTEST {
            return SVector::zeros();
        }
        let weight = libm::pow(distance, 1.0 - self.exponent).min(MAX_WEIGHT);
        offset * (weight / distance)
    }
}
