//! Snapshots of a predator. Its strategy comes from the scenario.

use serde::{Deserialize, Serialize};

use super::PredatorConfig;
use super::shared::predator::Predator;
use crate::base::error::Result;
use crate::snapshot::damaged;

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

    pub(crate) fn restore(state: &PredatorState, config: &PredatorConfig) -> Result<Self> {
        let vector = |entries: &[f64]| <[f64; D]>::try_from(entries).map_err(damaged);
        let (position, velocity) = (vector(&state.position)?, vector(&state.velocity)?);
        let mut own = Self::new(position.into(), velocity.into());
        own.speed = state.speed;
        config.remember(&mut own, &state.memory)?;
        Ok(own)
    }
}
