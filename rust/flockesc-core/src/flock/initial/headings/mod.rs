//! Distributions of the initial headings, one per file.

mod aligned;
mod given;
mod random;

use nalgebra::SVector;
use rand_chacha::ChaCha8Rng;

pub use aligned::AlignedHeadings;
pub use given::GivenHeadings;
pub use random::RandomHeadings;

use super::distribution::{Distribution, distributions};
use super::space::Space;
use crate::base::error::Result;

distributions! {
    /// The distribution of v(0) / v0.
    pub enum InitialHeadings in "initial_headings" {
        /// Uniform over all directions.
        Random(RandomHeadings),
        /// Uniform within an angle of one direction.
        Aligned(AlignedHeadings),
        /// Given directions.
        GivenHeadings(GivenHeadings),
    }
}
