//! Initial positions in a disc, or in a ball for D = 3.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::base::check::positive_quantity;
use crate::base::error::Result;
use crate::flock::initial::distribution::{Distribution, repeat};
use crate::flock::initial::space::Space;

/// Uniform within `radius` of the center of the initial region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Disc {
    /// Radius in m, from 1e-20 to 1e20.
    pub radius: f64,
}

impl Distribution for Disc {
    fn check(&self, path: &str, _space: &Space, _count: usize) -> Result<()> {
        positive_quantity(&format!("{path}.radius"), self.radius)
    }

    fn draw<const D: usize>(
        &self,
        space: &Space,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<SVector<f64, D>> {
        repeat(count, || space.shell(0.0, self.radius, rng))
    }
}
