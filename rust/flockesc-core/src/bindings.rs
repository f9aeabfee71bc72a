//! Items for the Python bindings. Not part of the public API.

pub use crate::base::memory;
pub use crate::episode::{AtEnd, SlotReset};
pub use crate::parallel::forked;
