//! Where agents head at the start: one distribution per file.

mod aligned;
mod random;

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

pub use aligned::AlignedHeadings;
pub use random::RandomHeadings;

use super::space::Space;
use crate::error::Result;

/// The distribution of v(0) / v0.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InitialHeadings {
    /// Uniform over all directions.
    Random(RandomHeadings),
    /// Uniform around one direction.
    Aligned(AlignedHeadings),
}

impl InitialHeadings {
    pub(crate) fn check(&self, space: &Space) -> Result<()> {
        match self {
            Self::Random(_) => Ok(()),
            Self::Aligned(aligned) => aligned.check(space),
        }
    }

    /// One agent's heading, of length 1 up to rounding.
    pub(super) fn draw<const D: usize>(
        &self,
        space: &Space,
        rng: &mut ChaCha8Rng,
    ) -> SVector<f64, D> {
        match self {
            Self::Random(_) => space.direction(rng),
            Self::Aligned(aligned) => aligned.draw(space, rng),
        }
    }
}
