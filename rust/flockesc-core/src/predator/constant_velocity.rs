//! The strategy of the paper's predator: constant velocity.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::shared::start::given_start;
use super::strategy::{Flight, Strategy, Surroundings};
use crate::base::error::Result;

/// Keeps its velocity: v_p(t + dt) = v_p(t) (paper, Section V).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConstantVelocity {
    /// r_p(0) in m.
    pub position: Vec<f64>,
    /// v_p in m/s.
    pub velocity: Vec<f64>,
}

given_start!(ConstantVelocity);

impl Strategy for ConstantVelocity {
    type Memory<const D: usize> = ();

    fn check(&self, _path: &str, _index: usize, _count: usize) -> Result<()> {
        Ok(())
    }

    fn steer<const D: usize>(
        &self,
        (): &mut (),
        flight: &Flight<D>,
        _surroundings: &mut Surroundings<'_, D>,
    ) -> (SVector<f64, D>, f64) {
        (flight.velocity, flight.speed)
    }
}
