//! The rules that make agents neighbors, one per file; agents within range are found by the engine alone.

pub(super) mod topological;
pub(super) mod voronoi;

use serde::Deserialize;

/// The rule that makes agents neighbors; an agent is always its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum NeighborRule {
    /// All agents within the interaction range, boundary included.
    Metric {},
    /// The k nearest of the agents that are seen, and whoever is as near as the last of them; an action sets k.
    Topological {},
    /// The agents within the interaction range whose Voronoi cells share an edge with the own one; in the plane only.
    Voronoi {},
}
