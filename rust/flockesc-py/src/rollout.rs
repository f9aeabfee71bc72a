//! Rollouts: whole episodes under networks, for Python.

use std::sync::Arc;

use flockesc_core::{
    Architecture, Entry, EpisodeOutcome, LineConfig, LineEpisodeConfig, NetworkRanges, Networks,
    Objective, line_entries, objectives,
};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::actions::RangeMap;
use crate::arrays::column;
use crate::errors::{CoreError, argument_error, option_error};
use crate::long_call::long_call;

/// Creates networks of one architecture, one per row of `parameters`. `entries` are the entries of
/// an observation row. `candidates` are the ranges that the candidates set, for networks that score them.
///
/// # Errors
/// `ArgumentError` naming the argument that is wrong.
pub(crate) fn networks(
    architecture: &str,
    parameters: &PyReadonlyArray2<'_, f32>,
    entries: &[Entry],
    actions: &RangeMap,
    candidates: Vec<f64>,
) -> PyResult<Networks> {
    let architecture = Architecture::from_json(architecture).map_err(argument_error)?;
    let (count, parameters) = (parameters.shape()[0], parameters.as_slice()?);
    let ranges = if architecture.is_scorer() {
        NetworkRanges::Candidates(candidates)
    } else {
        NetworkRanges::Normalized(actions.normalized()?)
    };
    let networks = Networks::new(&architecture, entries, ranges, parameters, count);
    Ok(networks.map_err(CoreError::from)?)
}

/// Returns one array per outcome, with one entry per flock.
pub(crate) fn outcome_columns<'py>(
    py: Python<'py>,
    outcomes: &[EpisodeOutcome],
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (index, objective) in objectives().take(Objective::COUNT).enumerate() {
        let minimum = |flock: &EpisodeOutcome| flock.metrics.objectives[index].minimum;
        dict.set_item(objective.column, column(py, outcomes, minimum))?;
    }
    dict.set_item(
        "num_components",
        column(py, outcomes, |flock| flock.num_components as i64),
    )?;
    dict.set_item(
        "mean_return",
        column(py, outcomes, |flock| flock.mean_return),
    )?;
    dict.set_item(
        "num_actions",
        column(py, outcomes, |flock| flock.num_actions as i64),
    )?;
    Ok(dict)
}

/// Returns the ranges in m that a network sets for successive observations of one episode.
/// `entries` are the name, lower bound and upper bound of every entry of a row.
#[pyfunction]
pub(crate) fn network_ranges<'py>(
    py: Python<'py>,
    architecture: &str,
    parameters: PyReadonlyArray2<'py, f32>,
    entries: Vec<(String, f32, f32)>,
    actions: &Bound<'py, RangeMap>,
    candidates: Vec<f64>,
    observations: Vec<PyReadonlyArray2<'py, f32>>,
) -> PyResult<Vec<Bound<'py, PyArray1<f64>>>> {
    let entries = entries.into_iter();
    let entries: Vec<_> = entries
        .map(|(name, low, high)| Entry { name, low, high })
        .collect();
    let networks = networks(
        architecture,
        &parameters,
        &entries,
        actions.get(),
        candidates,
    )?;
    let observations = observations
        .iter()
        .map(|rows| Ok(rows.as_slice()?.to_vec()));
    let ranges = networks.ranges(&observations.collect::<PyResult<Vec<_>>>()?);
    Ok(ranges
        .into_iter()
        .map(|ranges| ranges.into_pyarray(py))
        .collect())
}

/// Plays the line of every seed to the end of its episode, under one network for all seeds or one
/// per seed.
///
/// Returns one array per outcome. `report` is called with the number of finished lines.
#[pyfunction]
#[pyo3(signature = (scenario, options, actions, architecture, parameters, seeds, num_threads, report))]
#[expect(clippy::too_many_arguments, reason = "arguments of a rollout")]
pub(crate) fn rollout_line<'py>(
    py: Python<'py>,
    scenario: &str,
    options: &str,
    actions: &Bound<'py, RangeMap>,
    architecture: &str,
    parameters: PyReadonlyArray2<'py, f32>,
    seeds: PyReadonlyArray1<'py, u64>,
    num_threads: Option<usize>,
    report: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let scenario = Arc::new(LineConfig::from_json(scenario).map_err(CoreError::from)?);
    let options = LineEpisodeConfig::from_json(options).map_err(option_error)?;
    let num_profile_ranges = options.profile_ranges.as_ref().map_or(0, Vec::len);
    let entries = line_entries(scenario.num_agents, num_profile_ranges);
    let networks = networks(
        architecture,
        &parameters,
        &entries,
        actions.get(),
        Vec::new(),
    )?;
    let seeds = seeds.as_slice()?.to_vec();
    let outcomes = long_call(py, report, move |progress| {
        flockesc_core::rollout_line(
            &scenario,
            &options,
            &networks,
            &seeds,
            num_threads,
            progress,
        )
    })?;
    let dict = PyDict::new(py);
    dict.set_item(
        "escape_distance",
        column(py, &outcomes, |line| line.escape_distance),
    )?;
    dict.set_item(
        "num_components",
        column(py, &outcomes, |line| line.num_components as i64),
    )?;
    dict.set_item("steps", column(py, &outcomes, |line| line.steps as i64))?;
    dict.set_item("converged", column(py, &outcomes, |line| line.converged))?;
    dict.set_item(
        "num_actions",
        column(py, &outcomes, |line| line.num_actions as i64),
    )?;
    Ok(dict)
}
