//! Initial positions given in the scenario.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::base::error::Result;
use crate::flock::initial::distribution::Distribution;
use crate::flock::initial::space::{Space, embed};

/// One point per agent, in the order of ids.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GivenPositions {
    /// n points in m, each with D coordinates, or 2 for a point in the plane.
    pub points: Vec<Vec<f64>>,
}

impl Distribution for GivenPositions {
    fn check(&self, path: &str, space: &Space, count: usize) -> Result<()> {
        space.check_each(&format!("{path}.points"), &self.points, count)
    }

    fn draw<const D: usize>(
        &self,
        _space: &Space,
        _count: usize,
        _rng: &mut ChaCha8Rng,
    ) -> Vec<SVector<f64, D>> {
        self.points.iter().map(|point| embed(point)).collect()
    }
}
