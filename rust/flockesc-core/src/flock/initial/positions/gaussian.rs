//! Normally distributed initial positions.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::base::check::quantity;
use crate::base::error::Result;
use crate::flock::initial::distribution::{Distribution, repeat};
use crate::flock::initial::space::Space;

/// Normal around the center of the initial region, independently in every coordinate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gaussian {
    /// Standard deviation of every coordinate in m, at least 0.
    pub standard_deviation: f64,
}

impl Distribution for Gaussian {
    fn check(&self, path: &str, _space: &Space, _count: usize) -> Result<()> {
        let field = format!("{path}.standard_deviation");
        quantity(&field, self.standard_deviation)
    }

    fn draw<const D: usize>(
        &self,
        space: &Space,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<SVector<f64, D>> {
        let deviation = self.standard_deviation;
        repeat(count, || space.center() + space.normal(deviation, rng))
    }
}
