//! Names of the predator strategies, neighbor rules and other parts that a document may contain.

use strum::VariantNames;

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
pub fn kinds() -> &'static [(&'static str, &'static [&'static str])] {
    &[
        ("predators", PredatorConfig::VARIANTS),
        ("targets", Target::VARIANTS),
        ("neighbor_rules", NeighborRule::VARIANTS),
        ("motions", Motion::VARIANTS),
        ("initial_positions", InitialPositions::VARIANTS),
        ("initial_headings", InitialHeadings::VARIANTS),
        ("distributions", Distribution::VARIANTS),
        ("views", View::VARIANTS),
        ("extra_entries", ExtraEntries::VARIANTS),
        ("objectives", Objective::VARIANTS),
        ("rewards", Reward::VARIANTS),
        ("escape_forces", EscapeForce::VARIANTS),
        ("line_rewards", LineReward::VARIANTS),
    ]
}
