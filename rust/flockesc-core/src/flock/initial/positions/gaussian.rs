//! One normal distribution.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

use crate::base::check::quantity;
use crate::base::error::Result;
use crate::flock::initial::space::Space;

/// Normal around the center of the initial region, every coordinate on its own.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gaussian {
    /// Of every coordinate in m, at least 0.
    pub standard_deviation: f64,
}

impl Gaussian {
    pub(super) fn check(&self) -> Result<()> {
        let field = "initial_positions.gaussian.standard_deviation";
        quantity(field, self.standard_deviation)
    }

    pub(super) fn draw<const D: usize>(
        &self,
        space: &Space,
        rng: &mut ChaCha8Rng,
    ) -> SVector<f64, D> {
        space.center() + space.normal(self.standard_deviation, rng)
    }
}
