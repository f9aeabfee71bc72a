//! Items for the bindings. Not part of the public API.

pub use crate::base::check::clipped;
pub use crate::base::document::parse;
pub use crate::base::memory;
pub use crate::episode::{AtEnd, Observed, SlotReset};
pub use crate::flock::{check_predator_actions, check_ranges};
pub use crate::network::work;
pub use crate::parallel::forked;
pub use libm::log1p;
pub use strum::VariantNames;
