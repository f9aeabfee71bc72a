//! Code that several strategies share.

pub(super) mod assignment;
pub(super) mod flight;
pub(super) mod prey;
pub(super) mod sighting;
pub(super) mod start;
pub(super) mod steering;
