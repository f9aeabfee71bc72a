//! Python functions of the two models: validation, simulation, sweeps, seeds, and entries of observations.

use std::collections::BTreeMap;
use std::sync::Arc;

use flockesc_core::bindings::memory;
use flockesc_core::{
    Entry, EpisodeConfig, FlockConfig, LineConfig, Objective, line_entries, predator_entries,
};
use numpy::{PyReadonlyArray1, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

use crate::arrays::{Dict, array, flat, grid, shaped};
use crate::errors::CoreError;
use crate::long_call::long_call;

/// Checks a document and returns it with all fields, in canonical form.
#[pyfunction]
pub(crate) fn check_flock_scenario(scenario: &str) -> Result<String, CoreError> {
    Ok(FlockConfig::from_json(scenario)?.to_json())
}

/// Checks a document and returns it with all fields, in canonical form.
#[pyfunction]
pub(crate) fn check_line_scenario(scenario: &str) -> Result<String, CoreError> {
    Ok(LineConfig::from_json(scenario)?.to_json())
}

/// Returns the scenario of the episode with this seed, with drawn numbers and without randomization.
#[pyfunction]
pub(crate) fn drawn_flock_scenario(scenario: &str, seed: u64) -> PyResult<String> {
    let drawn = flock(scenario)?.drawn(seed).map_err(CoreError::from)?;
    Ok(drawn.to_json())
}

/// Parses and checks the document of a flock.
pub(crate) fn flock(document: &str) -> PyResult<Arc<FlockConfig>> {
    let config = FlockConfig::from_json(document).map_err(CoreError::from)?;
    Ok(Arc::new(config))
}

/// Returns every family of parts with the names of its kinds in documents.
#[pyfunction]
pub(crate) fn kinds() -> BTreeMap<&'static str, Vec<&'static str>> {
    let families = flockesc_core::kinds().iter();
    families
        .map(|(family, kinds)| (*family, kinds.to_vec()))
        .collect()
}

/// Raises `MemoryError` if the system does not grant this many bytes.
#[pyfunction]
pub(crate) fn check_memory(field: &str, num_bytes: u128) -> Result<(), CoreError> {
    let len = usize::try_from(num_bytes).unwrap_or(usize::MAX);
    Ok(memory::probe::<u8>(field, len)?)
}

#[pyfunction]
#[pyo3(signature = (scenario, interaction_range, seed, initial_state=None))]
pub(crate) fn simulate_line<'py>(
    py: Python<'py>,
    scenario: &str,
    interaction_range: f64,
    seed: u64,
    initial_state: Option<PyReadonlyArrayDyn<'py, f64>>,
) -> Dict<'py> {
    let config = Arc::new(LineConfig::from_json(scenario).map_err(CoreError::from)?);
    let states = flat(initial_state)?;
    let agents = config.num_agents;
    let run = long_call(py, None, move |progress| {
        flockesc_core::simulate_line(config, interaction_range, seed, states.as_deref(), progress)
    })?;
    let dict = [
        ("states", shaped(py, run.states, [run.steps + 1, agents])?),
        ("num_components", array(py, run.num_components)),
        ("escape_distance", array(py, run.escape_distance)),
    ]
    .into_py_dict(py)?;
    dict.set_item("converged", run.converged)?;
    dict.set_item("steps", run.steps)?;
    Ok(dict)
}

/// Returns one array per outcome of all runs of a "flock" or a "line", shape (ranges, seeds). `report` is called with
/// the number of finished runs.
#[pyfunction]
pub(crate) fn sweep<'py>(
    py: Python<'py>,
    model: &str,
    scenario: &str,
    ranges: PyReadonlyArray1<'py, f64>,
    seeds: PyReadonlyArray1<'py, u64>,
    num_threads: Option<usize>,
    report: Option<&Bound<'py, PyAny>>,
) -> Dict<'py> {
    let (ranges, seeds) = (ranges.as_slice()?.to_vec(), seeds.as_slice()?.to_vec());
    let (shape, dict) = ([ranges.len(), seeds.len()], PyDict::new(py));
    let components = if model == "flock" {
        let config = flock(scenario)?;
        let cells = long_call(py, report, move |progress| {
            flockesc_core::sweep_flock(&config, &ranges, &seeds, num_threads, progress)
        })?;
        for (index, objective) in Objective::ALL.iter().enumerate() {
            let values = grid(py, &cells, shape, |cell| cell.objectives[index])?;
            dict.set_item(objective.name(), values)?;
        }
        grid(py, &cells, shape, |cell| cell.num_components as i64)?
    } else {
        let config = Arc::new(LineConfig::from_json(scenario).map_err(CoreError::from)?);
        let cells = long_call(py, report, move |progress| {
            flockesc_core::sweep_line(&config, &ranges, &seeds, num_threads, progress)
        })?;
        let distances = grid(py, &cells, shape, |cell| cell.escape_distance)?;
        dict.set_item("escape_distance", distances)?;
        dict.set_item("converged", grid(py, &cells, shape, |cell| cell.converged)?)?;
        grid(py, &cells, shape, |cell| cell.num_components as i64)?
    };
    dict.set_item("num_components", components)?;
    Ok(dict)
}

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
