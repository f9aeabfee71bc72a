//! Snapshots of a predator. Its strategy comes from the scenario.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::PredatorConfig;
use super::shared::predator::Predator;
use crate::base::check::MAX_STEPS;
use crate::base::error::Result;
use crate::snapshot::{are_bounded, check, is_bounded, vector};

/// The serialized form of a [`Predator`]; fields have the same meaning.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct PredatorState {
    position: Vec<f64>,
    velocity: Vec<f64>,
    speed: f64,
    /// The fields that the strategy uses.
    memory: Vec<u8>,
}

impl<const D: usize> Predator<D> {
    pub(crate) fn save(&self, config: &PredatorConfig) -> PredatorState {
        PredatorState {
            position: self.position.as_slice().to_vec(),
            velocity: self.velocity.as_slice().to_vec(),
            speed: self.speed,
            memory: config.memory_of(self),
        }
    }

    pub(crate) fn restore(
        state: &PredatorState,
        config: &PredatorConfig,
        num_agents: usize,
    ) -> Result<Self> {
        let position = vector(&state.position, "a predator's position")?;
        let mut own = Self::new(position, vector(&state.velocity, "a predator's velocity")?);
        own.speed = state.speed;
        config.remember(&mut own, &state.memory)?;
        let is_speed = is_bounded(own.speed) && own.speed >= 0.0;
        check(is_speed, "a predator's speed")?;
        let vectors = [own.aim.unwrap_or_else(SVector::zeros), own.action, own.push];
        let is_memory = own.steps <= MAX_STEPS
            && own.target.is_none_or(|target| target < num_agents)
            && are_bounded(vectors.iter().flatten());
        check(is_memory, "a predator's memory")?;
        Ok(own)
    }
}
