//! Python functions for seeds of episodes, and names and bounds of observation entries.

use flockesc_core::bindings::memory;
use flockesc_core::{Entry, EpisodeConfig, line_entries, predator_entries};
use pyo3::prelude::*;

use crate::errors::CoreError;

/// Returns the seed of the `episode`-th episode after an episode with seed `seed`.
#[pyfunction]
pub(crate) fn episode_seed(seed: u64, episode: u64) -> u64 {
    flockesc_core::episode_seed(seed, episode)
}

/// Returns the name, lower and upper bound of every entry of an observation row.
///
/// # Errors
/// `InputError` naming the option that is wrong.
#[pyfunction]
pub(crate) fn observation_entries(
    options: &str,
    dimension: usize,
) -> PyResult<Vec<(String, f32, f32)>> {
    let options = EpisodeConfig::from_json(options).map_err(CoreError::from)?;
    Ok(bounds(options.entries(dimension)))
}

/// Returns the name, lower and upper bound of every entry of a learned predator's row.
#[pyfunction]
pub(crate) fn predator_observation_entries(dimension: usize) -> Vec<(String, f32, f32)> {
    bounds(predator_entries(dimension))
}

/// Returns the name, lower and upper bound of every entry of a line's observation.
#[pyfunction]
pub(crate) fn line_observation_entries(
    num_agents: usize,
) -> Result<Vec<(String, f32, f32)>, CoreError> {
    memory::probe::<[u8; ENTRY_BYTES]>("num_agents", num_agents)?;
    Ok(bounds(line_entries(num_agents)))
}

/// Memory in bytes of the name and bounds of an entry, here and in Python.
const ENTRY_BYTES: usize = 256;

fn bounds(entries: Vec<Entry>) -> Vec<(String, f32, f32)> {
    let bounds = |entry: Entry| (entry.name, entry.low, entry.high);
    entries.into_iter().map(bounds).collect()
}
