//! Items for the Python bindings. Not part of the public API.

pub use crate::episode::{AtEnd, SlotReset};
pub use crate::parallel::forked;

/// Checks of the available memory, and allocations that can fail.
pub mod memory {
    pub use crate::base::memory::{check, set_machine, vector};
}
