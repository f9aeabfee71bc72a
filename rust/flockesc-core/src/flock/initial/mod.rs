//! Distributions of the initial positions and headings.

mod distribution;
mod headings;
mod positions;
mod space;

pub use headings::{AlignedHeadings, GivenHeadings, InitialHeadings, RandomHeadings};
pub use positions::{
    Clusters, Disc, Gaussian, GivenPositions, InitialPositions, Ring, Segment, Square,
};
pub(crate) use space::Space;
