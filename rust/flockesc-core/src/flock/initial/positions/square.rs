//! The paper's: uniform in the initial region.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::flock::initial::distribution::{Distribution, times};
use crate::flock::initial::space::Space;

/// Uniform in `[0, side]^D`, or `[0, side]^2` for a flock that starts in the plane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Square {}

impl Distribution for Square {
    fn draw<const D: usize>(
        &self,
        space: &Space,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<SVector<f64, D>> {
        times(count, || space.uniform(rng))
    }
}
