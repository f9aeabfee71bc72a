//! Motion of the agents (steps 2 to 4 of docs/model.md): forces, noise, and the laws of motion.

mod first_order;
mod forces;
mod inertial;
mod law;
mod preferred_distance;
mod response;
mod reynolds;
mod step;
mod zones;

pub use law::*;
pub(super) use response::{Response, ResponseState};
pub(super) use step::{Predators, advance};
