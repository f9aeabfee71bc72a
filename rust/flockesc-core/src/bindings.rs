//! Items for the Python bindings. Not part of the public API.

pub use crate::episode::{AtEnd, Reset, SlotReset};
pub use crate::parallel::forked;
