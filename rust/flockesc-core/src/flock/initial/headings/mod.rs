//! Where agents head at the start: one distribution per file.

mod aligned;
mod given;
mod random;

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

pub use aligned::AlignedHeadings;
pub use given::GivenHeadings;
pub use random::RandomHeadings;

use super::positions::times;
use super::space::{Space, embed};
use crate::base::error::{Error, Result};
use crate::base::vector::SHORTEST;

/// The distribution of v(0) / v0.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InitialHeadings {
    /// Uniform over all directions.
    Random(RandomHeadings),
    /// Uniform around one direction.
    Aligned(AlignedHeadings),
    /// Given directions.
    GivenHeadings(GivenHeadings),
}

impl InitialHeadings {
    pub(crate) fn check(&self, space: &Space, count: usize) -> Result<()> {
        match self {
            Self::Random(_) => Ok(()),
            Self::Aligned(aligned) => aligned.check(space),
            Self::GivenHeadings(given) => given.check(space, count),
        }
    }

    /// Headings of `count` agents, of length 1 up to rounding.
    pub(super) fn draw<const D: usize>(
        &self,
        space: &Space,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<SVector<f64, D>> {
        match self {
            Self::Random(_) => times(count, || space.direction(rng)),
            Self::Aligned(aligned) => times(count, || aligned.draw(space, rng)),
            Self::GivenHeadings(given) => given.vectors(),
        }
    }
}

/// Refuses a vector that has no direction.
fn check_direction(field: impl FnOnce() -> String, entries: &[f64]) -> Result<()> {
    let norm = embed::<3>(entries).norm();
    if norm > SHORTEST {
        return Ok(());
    }
    let expected = format!("a vector longer than {SHORTEST:?}");
    Err(Error::config(field(), expected, norm))
}
