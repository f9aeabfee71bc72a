//! What several strategies have in common.

pub(super) mod assignment;
pub(super) mod flight;
pub(super) mod prey;
pub(super) mod sighting;
pub(super) mod steering;
