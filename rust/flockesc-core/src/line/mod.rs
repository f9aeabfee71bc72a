//! The line model (paper, Sections II to IV): agents on the real line with consensus and a fixed predator.

mod episode;
mod runs;
mod scenario;
mod step;
#[cfg(test)]
mod tests;

pub use episode::{LineEpisode, LineEpisodeConfig, LineReward, line_entries};
pub(crate) use runs::run_line;
pub use runs::{LineEpisodeOutcome, LineTrajectory, rollout_line, simulate_line};
pub use scenario::{EscapeForce, LineConfig};
pub use step::Line;
