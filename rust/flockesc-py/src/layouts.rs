//! What does not depend on any batch: seeds of episodes, and what observations are made of.

use flockesc_core::{Entry, View, entries, predator_entries};
use pyo3::prelude::*;

/// Seed of the `episode`-th episode after one that was given `seed`.
#[pyfunction]
pub(crate) fn episode_seed(seed: u64, episode: u64) -> u64 {
    flockesc_core::episode_seed(seed, episode)
}

/// Name, lower and upper bound of every entry of an observation row.
#[pyfunction]
pub(crate) fn observation_entries(per_agent: bool, dimension: usize) -> Vec<(String, f32, f32)> {
    let view = if per_agent { View::Agent } else { View::Flock };
    bounds(entries(view, dimension))
}

/// The same of a learned predator's row.
#[pyfunction]
pub(crate) fn predator_observation_entries(dimension: usize) -> Vec<(String, f32, f32)> {
    bounds(predator_entries(dimension))
}

fn bounds(entries: Vec<Entry>) -> Vec<(String, f32, f32)> {
    let bounds = |entry: Entry| (entry.name, entry.low, entry.high);
    entries.into_iter().map(bounds).collect()
}
