//! Uniform initial positions in a square, as in the paper, or in a cube for D = 3.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::flock::initial::distribution::{Distribution, repeat};
use crate::flock::initial::space::Space;

/// Uniform in `[0, side]^D`, or in `[0, side]^2` if the flock starts in the plane.
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
        repeat(count, || space.uniform(rng))
    }
}
