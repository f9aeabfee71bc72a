//! Small neural networks as policies: they compute ranges from observation rows.
//!
//! Several rows are computed together, one per SIMD lane. The order of the additions is the same in
//! every lane and on every instruction set. Actions are therefore the same on all machines.

mod actions;
mod architecture;
mod forward;
mod networks;
mod tanh;

pub use actions::{ActionMode, ActionOptions, NormalizedRange, RangeMap};
pub use architecture::{Activation, Architecture, Head, Squash};
pub use forward::{tanh_layers, work};
pub(crate) use networks::EpisodeNetwork;
pub use networks::{NetworkRanges, Networks};
