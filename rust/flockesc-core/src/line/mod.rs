//! The line model (paper, Sections II to IV): agents on the real line with consensus and a fixed predator.

mod consensus;
mod episode;
mod escape;
mod groups;
mod rollout;
mod scenario;
mod simulate;
mod step;
#[cfg(test)]
mod tests;

pub use episode::{LineEpisode, LineEpisodeConfig, LineReward, line_entries};
pub use escape::EscapeForce;
pub use rollout::{LineEpisodeOutcome, rollout_line};
pub use scenario::LineConfig;
pub(crate) use simulate::run_line;
pub use simulate::{LineTrajectory, simulate_line};
pub use step::Line;
