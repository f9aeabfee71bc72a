//! Code that several strategies share.

pub(super) mod assignment;
pub(super) mod predator;
pub(super) mod prey;
pub(super) mod sighting;
pub(super) mod steering;
