//! Items for the Python bindings. Not part of the public API.

pub use crate::base::memory;
pub use crate::episode::{AtEnd, Reset};
pub use crate::parallel::forked;
