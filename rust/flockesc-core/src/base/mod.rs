//! Foundations of the crate: errors, validation, documents, random streams, exact sums and vectors.

pub(crate) mod check;
pub(crate) mod document;
pub(crate) mod entry;
pub(crate) mod error;
pub(crate) mod exact;
pub(crate) mod load;
pub mod memory;
pub(crate) mod rng;
pub(crate) mod vector;
