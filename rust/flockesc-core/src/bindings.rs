//! What only the Python bindings need. It may change at any time.

pub use crate::episode::{AtEnd, Reset};
pub use crate::parallel::forked;
