//! Initial headings: one distribution per file, and the list of all.

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
        /// Uniform around one direction.
        Aligned(AlignedHeadings),
        /// Given directions.
        GivenHeadings(GivenHeadings),
    }
}
