//! The paper's: every direction is as likely.

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::flock::initial::distribution::{Distribution, times};
use crate::flock::initial::space::Space;

/// Uniform over all directions, or those of the plane for a flock that starts there.
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
        times(count, || space.direction(rng))
    }
}
