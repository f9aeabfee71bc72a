//! One normal distribution.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::base::check::quantity;
use crate::base::error::Result;
use crate::flock::initial::distribution::{Distribution, times};
use crate::flock::initial::space::Space;

/// Normal around the center of the initial region, every coordinate on its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gaussian {
    /// Of every coordinate in m, at least 0.
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
        times(count, || space.center() + space.normal(deviation, rng))
    }
}
