//! The line model (paper, Sections II to IV): agents on the real line, pushed away from a fixed predator.

mod consensus;
mod dynamics;
mod episode;
mod escape;
mod groups;
mod simulate;
#[cfg(test)]
mod tests;

pub use dynamics::Line;
pub use episode::{LineEpisode, LineEpisodeConfig, LineReward, line_entries};
pub use escape::EscapeForce;
pub use simulate::{LineTrajectory, simulate_line};
