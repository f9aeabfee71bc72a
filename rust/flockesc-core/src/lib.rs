#![doc = include_str!("../README.md")]
#![deny(missing_docs)]

mod agents;
mod base;
#[doc(hidden)]
pub mod bindings;
mod episode;
mod flock;
mod graph;
mod kinds;
mod line;
mod neighbor;
mod network;
mod observation;
mod parallel;
mod predator;
mod reward;
mod snapshot;
mod sweep;

pub use agents::PerAgent;
pub use base::check::{MAX_AGENTS, MAX_CANDIDATES, MAX_PARTS, MAX_STEPS};
pub use base::entry::Entry;
pub use base::error::{Error, Result};
pub use base::load::Load;
pub use base::rng::episode_seed;
pub use episode::{Batch, Episode, EpisodeConfig, EpisodeOutcome, Metrics, Running};
pub use flock::{
    Action, Distribution, FirstOrder, FlockConfig, InitialHeadings, InitialPositions, InitialState,
    Motion, PredatorDistance, PreferredDistance, Reynolds, Run, World, Zones,
};
pub use graph::{NeighborGraph, laplacian, perron_matrix};
pub use kinds::kinds;
pub use line::{
    EscapeForce, Line, LineConfig, LineEpisode, LineEpisodeConfig, LineEpisodeOutcome, LineReward,
    LineTrajectory, line_entries, rollout_line, simulate_line,
};
pub use neighbor::{NeighborRule, Ranges};
pub use network::{
    ActionMode, ActionOptions, Activation, Architecture, Head, NetworkRanges, Networks,
    NormalizedRange, RangeMap, Squash, tanh_layers,
};
pub use observation::{ExtraEntries, View, flock_entries, predator_entries};
pub use parallel::Progress;
pub use predator::*;
pub use reward::{Objective, Reward};
pub use sweep::{FlockOutcome, LineOutcome, sweep_flock, sweep_line};
