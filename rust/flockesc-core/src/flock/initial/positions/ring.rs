//! Initial positions in a ring, or in a spherical shell for D = 3.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::base::check::positive_quantity;
use crate::base::error::{Error, Result};
use crate::flock::initial::distribution::{Distribution, repeat};
use crate::flock::initial::space::Space;

/// Uniform within `width` / 2 of the circle (D = 3: sphere) of `radius` around the center of the initial
/// region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ring {
    /// Radius in m, from 1e-20 to 1e20.
    pub radius: f64,
    /// Width in m, from 0 to twice the radius.
    pub width: f64,
}

impl Distribution for Ring {
    fn check(&self, path: &str, _space: &Space, _count: usize) -> Result<()> {
        positive_quantity(&format!("{path}.radius"), self.radius)?;
        if (0.0..=2.0).contains(&(self.width / self.radius)) {
            return Ok(());
        }
        let expected = "a number from 0 to twice the radius";
        Err(Error::config(format!("{path}.width"), expected, self.width))
    }

    fn draw<const D: usize>(
        &self,
        space: &Space,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<SVector<f64, D>> {
        let half = self.width / 2.0;
        let (inner, outer) = (self.radius - half, self.radius + half);
        repeat(count, || space.shell(inner, outer, rng))
    }
}
