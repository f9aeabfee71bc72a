//! Motion of the agents (steps 2 to 4 of docs/model.md): forces, noise, and the laws of motion.

mod columns;
mod forces;
mod inertial;
mod law;
mod noise;
mod response;
mod reynolds;
mod step;
mod vicsek;

pub use law::{Motion, Reynolds};
pub(super) use response::{Response, ResponseState};
pub(super) use step::{Predators, advance};
