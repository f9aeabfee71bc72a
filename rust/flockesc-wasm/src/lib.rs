//! JavaScript API of `flockesc-core`: flocks, networks and neighbor graphs in a web page, with the same bits as in
//! Python.

mod flock;
mod graph;
mod policy;

pub use flock::Flock;
pub use graph::neighbor_pairs;
pub use policy::{Network, Observer, PolicyFile};
