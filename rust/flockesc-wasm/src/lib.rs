//! JavaScript classes over `flockesc-core`: flocks and networks in a web page, with the same bits as in Python.

mod flock;
mod network;

pub use flock::Flock;
pub use network::Network;
