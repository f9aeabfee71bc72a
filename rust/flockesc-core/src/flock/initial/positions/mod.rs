//! Where agents start: one shape per file.

mod clusters;
mod disc;
mod gaussian;
mod given;
mod ring;
mod segment;
mod square;

use std::iter::repeat_with;

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;

pub use clusters::Clusters;
pub use disc::Disc;
pub use gaussian::Gaussian;
pub use given::GivenPositions;
pub use ring::Ring;
pub use segment::Segment;
pub use square::Square;

use super::space::Space;
use crate::base::error::Result;

/// The distribution of r(0), named by its shape in the plane.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InitialPositions {
    /// Uniform in the initial region; in space a cube.
    Square(Square),
    /// Uniform in a disc; in space a ball.
    Disc(Disc),
    /// Uniform in a ring; in space a spherical shell.
    Ring(Ring),
    /// Uniform along a line segment.
    Segment(Segment),
    /// Normal around the center of the initial region.
    Gaussian(Gaussian),
    /// Normal around several centers.
    Clusters(Clusters),
    /// Given points.
    GivenPositions(GivenPositions),
}

impl InitialPositions {
    pub(crate) fn check(&self, space: &Space, count: usize) -> Result<()> {
        match self {
            Self::Square(_) => Ok(()),
            Self::Disc(disc) => disc.check(),
            Self::Ring(ring) => ring.check(),
            Self::Segment(segment) => segment.check(space),
            Self::Gaussian(gaussian) => gaussian.check(),
            Self::Clusters(clusters) => clusters.check(),
            Self::GivenPositions(given) => given.check(space, count),
        }
    }

    /// r(0) in m of `count` agents.
    pub(super) fn draw<const D: usize>(
        &self,
        space: &Space,
        count: usize,
        rng: &mut ChaCha8Rng,
    ) -> Vec<SVector<f64, D>> {
        match self {
            Self::Square(_) => times(count, || space.uniform(rng)),
            Self::Disc(disc) => times(count, || disc.draw(space, rng)),
            Self::Ring(ring) => times(count, || ring.draw(space, rng)),
            Self::Segment(segment) => times(count, || segment.draw(rng)),
            Self::Gaussian(gaussian) => times(count, || gaussian.draw(space, rng)),
            Self::Clusters(clusters) => clusters.draw(space, count, rng),
            Self::GivenPositions(given) => given.vectors(),
        }
    }
}

pub(super) fn times<T>(count: usize, draw: impl FnMut() -> T) -> Vec<T> {
    repeat_with(draw).take(count).collect()
}
