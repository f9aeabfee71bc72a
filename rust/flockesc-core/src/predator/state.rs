//! A predator in flight as plain data, beside its strategy.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::{Predator, PredatorConfig};
use crate::base::error::Result;
use crate::snapshot::{check, is_sound, vector};

/// See the fields of [`Predator`].
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct PredatorState {
    position: Vec<f64>,
    velocity: Vec<f64>,
    speed: f64,
    kept: Option<usize>,
    agreed: Option<Vec<f64>>,
    steps: usize,
    control: Vec<f64>,
    push: Vec<f64>,
}

impl<const D: usize> Predator<D> {
    pub(crate) fn save(&self) -> PredatorState {
        let entries = |vector: &SVector<f64, D>| vector.as_slice().to_vec();
        PredatorState {
            position: entries(&self.position),
            velocity: entries(&self.velocity),
            speed: self.speed,
            kept: self.kept,
            agreed: self.agreed.as_ref().map(entries),
            steps: self.steps,
            control: entries(&self.control),
            push: entries(&self.push),
        }
    }

    pub(crate) fn restore(
        state: &PredatorState,
        config: &PredatorConfig,
        num_agents: usize,
    ) -> Result<Self> {
        let is_agent = state.kept.is_none_or(|name| name < num_agents);
        check(is_agent, "name of a predator's target")?;
        let is_speed = is_sound(state.speed) && state.speed >= 0.0;
        check(is_speed, "a predator's speed")?;
        let aim = |entries| vector(entries, "a predator's aim");
        Ok(Self {
            position: vector(&state.position, "a predator's position")?,
            velocity: vector(&state.velocity, "a predator's velocity")?,
            speed: state.speed,
            kept: state.kept,
            agreed: state.agreed.as_deref().map(aim).transpose()?,
            steps: state.steps,
            control: vector(&state.control, "a predator's control")?,
            push: vector(&state.push, "a predator's push")?,
            ..Self::new(config)
        })
    }
}
