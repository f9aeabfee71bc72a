//! Distributions of the initial positions and headings.

mod headings;
mod positions;
mod space;

pub use headings::InitialHeadings;
pub use positions::InitialPositions;
pub(crate) use space::Space;
