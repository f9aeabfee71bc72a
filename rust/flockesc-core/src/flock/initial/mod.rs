//! Distributions of the agents' positions and headings at t = 0.

mod distribution;
mod headings;
mod positions;
mod space;

pub use headings::{AlignedHeadings, GivenHeadings, InitialHeadings, RandomHeadings};
pub use positions::{
    Clusters, Disc, Gaussian, GivenPositions, InitialPositions, Ring, Segment, Square,
};
pub(crate) use space::Space;
