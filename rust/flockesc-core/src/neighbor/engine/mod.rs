//! The neighbor search and the sums over neighbors, for all neighbor rules.

pub(super) mod candidates;
pub(super) mod components;
pub(super) mod distances;
pub(super) mod field_of_view;
pub(super) mod kernel;
pub(super) mod links;
pub(super) mod lists;
pub(super) mod nodes;
pub(super) mod offsets;
pub(super) mod pairs;
mod places;
pub(super) mod reach;
pub(super) mod sums;
pub(super) mod tree;
pub(super) mod verlet;
