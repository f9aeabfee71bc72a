//! Small networks as policies: from observation rows to ranges, a lane per row. Every row's sums run in one fixed
//! order, so actions do not depend on the instruction set.

mod architecture;
mod forward;
mod networks;
mod ranges;
mod tanh;

pub use architecture::{Architecture, Squash};
pub use networks::Networks;
pub(crate) use networks::Player;
pub use ranges::NormalizedRange;
