//! The flock model (paper, Section V): agents align with their neighbors and flee from predators.

mod approach;
mod initial;
mod initial_state;
mod metrics;
mod motion;
mod randomization;
mod run;
mod scenario;
mod summary;
mod world;

pub(crate) use approach::{Approach, Drift, approach, approaches, heading_escape};
pub use initial::{InitialHeadings, InitialPositions};
pub use initial_state::InitialState;
pub use metrics::PredatorDistance;
pub use motion::*;
pub use randomization::Distribution;
pub use run::{Action, Run, check_predator_actions, check_ranges};
pub(crate) use run::{flock_bytes, probe_flocks};
pub use scenario::FlockConfig;
pub(crate) use summary::{HALF_COUNT, Summary};
pub use world::World;
pub(crate) use world::WorldState;
