//! Distributions of the initial positions, one per file.

mod clusters;
mod disc;
mod gaussian;
mod given;
mod ring;
mod segment;
mod square;

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;

pub use clusters::Clusters;
pub use disc::Disc;
pub use gaussian::Gaussian;
pub use given::GivenPositions;
pub use ring::Ring;
pub use segment::Segment;
pub use square::Square;

use super::distribution::{Distribution, distributions};
use super::space::Space;
use crate::base::error::Result;

distributions! {
    /// The distribution of r(0). Variants are named after shapes in the plane.
    pub enum InitialPositions in "initial_positions" {
        /// Uniform in the initial region: a square, or a cube for D = 3.
        Square(Square),
        /// Uniform in a disc, or in a ball for D = 3.
        Disc(Disc),
        /// Uniform in a ring, or in a spherical shell for D = 3.
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
}
