//! Initial positions: one shape per file, and the list of all.

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
    /// The distribution of r(0), named by its shape in the plane.
    pub enum InitialPositions in "initial_positions" {
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
}
