//! The flock model (paper, Section V): agents that align with their neighbors and flee from predators.

mod dynamics;
mod initial;
mod motion;
mod simulate;
mod summary;

pub use dynamics::World;
pub(crate) use dynamics::WorldState;
pub(crate) use initial::Space;
pub use initial::{
    AlignedHeadings, Clusters, Disc, Gaussian, GivenHeadings, GivenPositions, InitialHeadings,
    InitialPositions, InitialState, RandomHeadings, Ring, Segment, Square,
};
pub use motion::{Inertial, Motion, Reynolds, Vicsek};
pub use simulate::{Schedule, Trajectory, simulate_flock};
pub(crate) use simulate::{check_controls, check_ranges};
pub(crate) use summary::{HALF_COUNT, Summary};
