//! Snapshots of a predator. Its strategy comes from the scenario.

use serde::{Deserialize, Serialize};

use super::{Predator, PredatorConfig, StrategyState};
use crate::base::error::Result;
use crate::snapshot::{check, is_bounded, vector};

/// The serialized form of a [`Predator`]; fields have the same meaning.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct PredatorState {
    position: Vec<f64>,
    velocity: Vec<f64>,
    speed: f64,
    memory: Vec<u8>,
}

impl<const D: usize> Predator<D> {
    pub(crate) fn save(&self) -> PredatorState {
        PredatorState {
            position: self.position.as_slice().to_vec(),
            velocity: self.velocity.as_slice().to_vec(),
            speed: self.speed,
            memory: self.strategy.save(),
        }
    }

    pub(crate) fn restore(
        state: &PredatorState,
        config: &PredatorConfig,
        num_agents: usize,
    ) -> Result<Self> {
        let is_speed = is_bounded(state.speed) && state.speed >= 0.0;
        check(is_speed, "a predator's speed")?;
        Ok(Self {
            position: vector(&state.position, "a predator's position")?,
            velocity: vector(&state.velocity, "a predator's velocity")?,
            speed: state.speed,
            strategy: StrategyState::restore(config, &state.memory, num_agents)?,
        })
    }
}
