//! What a controller sees, one view per file; every entry is bounded and documented in docs/model.md.
//!
//! Nothing depends on where the world's origin is or how its axes are turned.

pub(crate) mod agent;
pub(crate) mod flock;
pub(crate) mod predator;
mod sensing;
mod view;

use crate::base::entry::Entry;
use crate::episode::Episode;
use crate::reward::Objective;
pub use predator::entries as predator_entries;
pub use sensing::{SameRange, SensingRange};
pub use view::View;

/// The entries of an observation row, in order, for dimension 2 or 3.
#[must_use]
pub fn entries(view: View, dimension: usize) -> Vec<Entry> {
    match view {
        View::Flock => flock::ENTRIES
            .iter()
            .map(|&(name, low)| entry(name, low))
            .collect(),
        View::Agent => agent::entries(dimension),
    }
}

fn entry(name: impl Into<String>, low: f32) -> Entry {
    Entry {
        name: name.into(),
        low,
        high: 1.0,
    }
}

/// The entry `running_minimum`: of a distance, or of the share of agents that were not caught.
fn running_minimum<const D: usize>(episode: &Episode<D>) -> f64 {
    let minimum = episode.objective().minimum;
    match episode.config().objective {
        Objective::Mean | Objective::Minimum => {
            squash(minimum, episode.world().config().initial_side)
        }
        Objective::Survival => minimum,
    }
}

/// Maps a length or speed of at least 0 onto [0, 1): half at `scale`.
fn squash(value: f64, scale: f64) -> f64 {
    if value.is_finite() {
        value / (value + scale)
    } else {
        1.0
    }
}

/// Writes rows one entry after the other.
struct Writer<'a> {
    out: std::slice::IterMut<'a, f32>,
}

impl<'a> Writer<'a> {
    fn new(out: &'a mut [f32]) -> Self {
        Self {
            out: out.iter_mut(),
        }
    }

    /// Rounding may carry a bounded entry a hair outside of [-1, 1]; it is put back.
    fn push(&mut self, value: f64) {
        if let Some(slot) = self.out.next() {
            *slot = value.clamp(-1.0, 1.0) as f32;
        }
    }

    fn extend(&mut self, values: &[f64]) {
        for value in values {
            self.push(*value);
        }
    }
}
