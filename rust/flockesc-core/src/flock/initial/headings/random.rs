//! Uniformly random initial headings, as in the paper.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::flock::initial::distribution::{Distribution, repeat};
use crate::flock::initial::space::Space;

/// Uniform over all directions, or over the directions in the plane if the flock starts there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RandomHeadings {}

impl Distribution for RandomHeadings {
    fn draw<const D: usize>(
        &self,
        space: &Space,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<SVector<f64, D>> {
        repeat(count, || space.direction(rng))
    }
}
