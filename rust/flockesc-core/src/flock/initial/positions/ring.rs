//! A ring, in space a spherical shell.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

use crate::base::check::positive_quantity;
use crate::base::error::{Error, Result};
use crate::flock::initial::space::Space;

/// Uniform within `width` / 2 of the circle of `radius` around the center of the initial region.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ring {
    /// In m, from 1e-20 to 1e20.
    pub radius: f64,
    /// In m, from 0 to 2 `radius`.
    pub width: f64,
}

impl Ring {
    pub(super) fn check(&self) -> Result<()> {
        let field = "initial_positions.ring.radius";
        positive_quantity(field, self.radius)?;
        if (0.0..=2.0).contains(&(self.width / self.radius)) {
            return Ok(());
        }
        Err(Error::config(
            "initial_positions.ring.width",
            "a number from 0 to 2 radius",
            self.width,
        ))
    }

    pub(super) fn draw<const D: usize>(
        &self,
        space: &Space,
        rng: &mut ChaCha8Rng,
    ) -> SVector<f64, D> {
        let half = self.width / 2.0;
        space.shell(self.radius - half, self.radius + half, rng)
    }
}
