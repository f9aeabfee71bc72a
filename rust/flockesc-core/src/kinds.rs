//! Names of the predator strategies, neighbor rules and other parts that a document may contain.

use crate::flock::{Distribution, InitialHeadings, InitialPositions, Motion};
use crate::line::{EscapeForce, LineReward};
use crate::neighbor::NeighborRule;
use crate::observation::{ExtraEntries, View};
use crate::predator::{PredatorConfig, Target};
use crate::reward::{Objective, Reward};

/// Returns every family of parts with the names of its kinds in documents.
///
/// ```
/// let predators = flockesc_core::kinds().iter().find(|(family, _)| *family == "predators");
/// assert!(predators.is_some_and(|(_, kinds)| kinds.contains(&"constant_velocity")));
/// ```
#[must_use]
pub fn kinds() -> &'static [(&'static str, &'static [&'static str])] {
    &[
        ("predators", PredatorConfig::KINDS),
        ("targets", Target::KINDS),
        ("neighbor_rules", NeighborRule::KINDS),
        ("motions", Motion::KINDS),
        ("initial_positions", InitialPositions::KINDS),
        ("initial_headings", InitialHeadings::KINDS),
        ("distributions", Distribution::KINDS),
        ("views", View::KINDS),
        ("extra_entries", ExtraEntries::KINDS),
        ("objectives", Objective::KINDS),
        ("rewards", Reward::KINDS),
        ("escape_forces", EscapeForce::KINDS),
        ("line_rewards", LineReward::KINDS),
    ]
}
