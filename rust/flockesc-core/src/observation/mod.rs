//! Observations of flocks, agents and predators. Every entry is bounded and documented in
//! docs/model.md.
//!
//! All entries are invariant under translations and rotations of the world.

mod agent;
mod flock;
mod frames;
mod predator;
mod row;
mod scene;
mod view;

use crate::base::entry::{Entries, Entry};
use crate::base::error::Result;
use crate::parallel::Progress;
pub use scene::ExtraEntries;
pub(crate) use scene::{Extras, Scene};
pub use view::View;

/// Returns the entries of an observation row, in order, for dimension 2 or 3.
pub(crate) fn entries(view: View, extras: Extras<'_>, dimension: usize) -> Vec<Entry> {
    let mut entries = Entries::default();
    match (view, dimension) {
        (View::Flock, 2) => flock::name::<2>(extras, &mut entries),
        (View::Flock, _) => flock::name::<3>(extras, &mut entries),
        (View::Agent, 2) => agent::name::<2>(extras, &mut entries),
        (View::Agent, _) => agent::name::<3>(extras, &mut entries),
    }
    entries.entries
}

/// Returns the entries of the flock's row without optional entries, in order, for dimension 2 or 3.
pub fn flock_entries(dimension: usize) -> Vec<Entry> {
    entries(View::Flock, Extras::default(), dimension)
}

/// Returns the entries of a learned predator's row, in order, for dimension 2 or 3.
pub fn predator_entries(dimension: usize) -> Vec<Entry> {
    let mut entries = Entries::default();
    match dimension {
        2 => predator::name::<2>(&mut entries),
        _ => predator::name::<3>(&mut entries),
    }
    entries.entries
}

impl<const D: usize> Scene<'_, D> {
    /// Writes the observation: one row for the flock, or one per agent.
    ///
    /// # Errors
    /// [`crate::Error::Interrupted`] if `progress` was cancelled.
    pub(crate) fn observe(&self, view: View, out: &mut [f32], progress: &Progress) -> Result<()> {
        match view {
            View::Flock => {
                flock::write(self, out);
                Ok(())
            }
            View::Agent => agent::write(self, out, progress),
        }
    }

    /// Writes one row per learned predator.
    pub(crate) fn observe_predators(&self, out: &mut [f32]) {
        predator::write(self, out);
    }
}
