//! Flocks and lines of consensus-driven agents under attack by a predator, where the interaction range
//! decides who escapes (Saleh, "On the Optimal Interaction Range for Multi-Agent Systems Under
//! Adversarial Attack"). Equations, names and units: `docs/model.md`.
//!
//! ```
//! use std::sync::Arc;
//! use flockesc_core::{LineConfig, Progress, simulate_line};
//!
//! let config = LineConfig::from_json(
//!     r#"{"num_agents": 100, "predator_position": 0.6, "predator_range": 0.2,
//!         "repulsion_strength": 2.0, "escape_force": "linear", "tolerance": 1e-12, "max_steps": 1000}"#,
//! )?;
//! let line = simulate_line(Arc::new(config), 0.1, 7, None, &Progress::default())?;
//! assert!(line.converged);
//! assert!(line.escape_distance[line.steps] > 0.2);
//! # Ok::<(), flockesc_core::Error>(())
//! ```
//!
//! - [`FlockConfig`], [`LineConfig`], [`EpisodeConfig`]: documents, checked field by field.
//! - [`World`] and [`Line`]: the two models, a step at a time.
//! - [`simulate_flock`], [`simulate_line`]: whole runs, recorded; [`sweep_flock`], [`sweep_line`]: the grid search.
//! - [`Batch`]: many episodes with rewards and observations, stepped together.

mod agents;
mod base;
mod episode;
mod flock;
mod graph;
mod line;
mod neighbor;
mod observation;
mod parallel;
mod predator;
mod reward;
mod snapshot;
mod sweep;

pub use agents::PerAgent;
pub use base::check::{MAX_AGENTS, MAX_STEPS};
pub use base::entry::Entry;
pub use base::error::{Error, Result};
pub use base::rng::episode_seed;
pub use episode::{AtEnd, Batch, Episode, EpisodeConfig, Metrics, Reset, Running};
pub use flock::{
    AlignedHeadings, Choice, Clusters, Disc, Distribution, FlockConfig, Gaussian, GivenHeadings,
    GivenPositions, Inertial, InitialHeadings, InitialPositions, InitialState, Interval, Motion,
    PredatorDistance, RandomHeadings, Randomization, Reynolds, Ring, Schedule, Segment, Square,
    Trajectory, Vicsek, World, simulate_flock,
};
pub use graph::{NeighborGraph, laplacian, perron_matrix};
pub use line::{
    EscapeForce, Line, LineConfig, LineEpisode, LineEpisodeConfig, LineReward, LineTrajectory,
    line_entries, simulate_line,
};
pub use neighbor::{NeighborRule, Ranges};
pub use observation::{SameRange, SensingRange, View, entries, predator_entries};
pub use parallel::{Progress, forked};
pub use predator::{
    ConstantVelocity, Encircle, Herd, Intercept, Learned, Predator, PredatorConfig, PurePursuit,
    Target, Wandering,
};
pub use reward::{Objective, Reward};
pub use sweep::{FlockOutcome, LineOutcome, sweep_flock, sweep_line};
