//! A disc, in space a ball.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

use crate::base::check::positive_quantity;
use crate::base::error::Result;
use crate::flock::initial::space::Space;

/// Uniform within `radius` of the center of the initial region.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Disc {
    /// In m, from 1e-20 to 1e20.
    pub radius: f64,
}

impl Disc {
    pub(super) fn check(&self) -> Result<()> {
        let field = "initial_positions.disc.radius";
        positive_quantity(field, self.radius)
    }

    pub(super) fn draw<const D: usize>(
        &self,
        space: &Space,
        rng: &mut ChaCha8Rng,
    ) -> SVector<f64, D> {
        space.shell(0.0, self.radius, rng)
    }
}
