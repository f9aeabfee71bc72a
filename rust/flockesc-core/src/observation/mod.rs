//! Observations of flocks, agents and predators. Every entry is bounded and documented in
//! docs/model.md.
//!
//! All entries are invariant under translations and rotations of the world.

mod agent;
mod columns;
mod extras;
mod flock;
mod predator;
mod scene;
mod sensing;
mod table;
mod vectors;
mod view;

use crate::agents::{GROUP, Group};
use crate::base::entry::Entry;
use crate::base::error::Result;
use crate::flock::FlockConfig;
use crate::neighbor::{NeighborSums, Profile};
use crate::parallel::Progress;
pub use extras::ExtraEntries;
pub(crate) use extras::Extras;
pub(crate) use scene::Scene;
pub use sensing::SensingRange;
use table::Entries;
pub use view::View;

/// Returns the entries of an observation row, in order, for dimension 2 or 3.
pub(crate) fn entries(view: View, extras: Extras<'_>, dimension: usize) -> Vec<Entry> {
    let mut entries = Entries::default();
    match (view, dimension) {
        (View::Flock, 2) => flock::table::<2>(&mut entries),
        (View::Flock, _) => flock::table::<3>(&mut entries),
        (View::Agent, 2) => agent::table::<2>(&mut entries),
        (View::Agent, _) => agent::table::<3>(&mut entries),
    }
    match (view, dimension) {
        (View::Flock, _) => extras::flock::table(extras, &mut entries),
        (View::Agent, 2) => extras::agent::table::<2>(extras, &mut entries),
        (View::Agent, _) => extras::agent::table::<3>(extras, &mut entries),
    }
    entries.entries
}

/// Returns the entries of the flock's row without optional entries, in order, for dimension 2 or 3.
#[must_use]
pub fn flock_entries(dimension: usize) -> Vec<Entry> {
    entries(View::Flock, Extras::default(), dimension)
}

/// Returns the entries of a learned predator's row, in order, for dimension 2 or 3.
#[must_use]
pub fn predator_entries(dimension: usize) -> Vec<Entry> {
    let mut entries = Entries::default();
    match dimension {
        2 => predator::table::<2>(&mut entries),
        _ => predator::table::<3>(&mut entries),
    }
    entries.entries
}

/// Returns the memory in bytes that a thread needs to compute an observation with optional entries.
pub(crate) fn working_bytes<const D: usize>(
    view: View,
    extras: Extras<'_>,
    scenario: &FlockConfig,
) -> usize {
    let (n, num_ranges) = (scenario.num_agents, extras.ranges.len());
    if extras.is_empty() {
        return 0;
    }
    let per_group = match view {
        View::Flock => size_of::<Group<D>>() + (1 + num_ranges) * size_of::<NeighborSums<D>>(),
        View::Agent => 0,
    };
    let profile = Profile::<D>::bytes(&scenario.neighbor_options(), n, num_ranges);
    n.div_ceil(GROUP) * per_group + profile
}

impl<const D: usize> Scene<'_, D> {
    /// Writes the observation: one row for the flock, or one per agent.
    ///
    /// # Errors
    /// [`crate::Error::Interrupted`] if `progress` was cancelled.
    pub(crate) fn observe(&self, view: View, out: &mut [f32], progress: &Progress) -> Result<()> {
        match view {
            View::Flock => flock::write(self, out, progress),
            View::Agent => agent::write(self, out, progress),
        }
    }

    /// Writes one row per learned predator.
    pub(crate) fn observe_predators(&self, out: &mut [f32]) {
        predator::write(self, out);
    }
}
