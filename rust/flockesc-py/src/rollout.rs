//! Functions for policies: networks, rollouts of whole episodes under them, and a logarithm.

use std::sync::Arc;

use flockesc_core::bindings::{self, work};
use flockesc_core::{
    Architecture, Entry, EpisodeOutcome, Head, LineConfig, LineEpisodeConfig, LineEpisodeOutcome,
    NetworkRanges, Networks, Objective, line_entries,
};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

use crate::actions::RangeMap;
use crate::arrays::{Dict, Object, column, shaped};
use crate::errors::CoreError;
use crate::info::with_load;
use crate::long_call::{long_call, run};

/// Networks of one architecture, one per row of `parameters`. `choices` are the ranges in m that they choose from.
#[derive(FromPyObject)]
pub(crate) struct NetworkArguments<'py>(String, PyReadonlyArray2<'py, f32>, Vec<f64>);

impl NetworkArguments<'_> {
    /// Returns the networks for rows with these entries.
    ///
    /// # Errors
    /// `InputError` naming the argument that is wrong.
    pub(crate) fn networks(self, names: &[String], actions: &RangeMap) -> PyResult<Networks> {
        let Self(architecture, parameters, choices) = self;
        let architecture = Architecture::from_json(&architecture).map_err(CoreError::from)?;
        let (count, parameters) = (parameters.shape()[0], parameters.as_slice()?);
        let ranges = match architecture.head() {
            Head::Value => {
                NetworkRanges::Normalized(actions.map.normalized().map_err(CoreError::from)?)
            }
            Head::Argmax | Head::Candidates => NetworkRanges::Choices(choices),
        };
        let networks = Networks::new(&architecture, names, ranges, parameters, count);
        Ok(networks.map_err(CoreError::from)?)
    }
}

pub(crate) fn names(entries: Vec<Entry>) -> Vec<String> {
    entries.into_iter().map(|entry| entry.name).collect()
}

/// Returns the output of a network for every row and the next memory: see `flockesc_core::Networks::outputs`.
/// `names` are those of the entries of a row.
#[pyfunction]
pub(crate) fn network_outputs<'py>(
    py: Python<'py>,
    network: NetworkArguments<'py>,
    names: Vec<String>,
    actions: &Bound<'py, RangeMap>,
    observations: PyReadonlyArray2<'py, f32>,
    memory: PyReadonlyArray2<'py, f64>,
) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyAny>)> {
    let networks = network.networks(&names, actions.get())?;
    let shape = [memory.shape()[0], memory.shape()[1]];
    let observations = observations.as_slice()?.to_vec();
    let mut memory = memory.as_slice()?.to_vec();
    let work = networks.work(shape[0]);
    let (outputs, memory) = run(py, work, move |progress| {
        let outputs = networks.outputs(&observations, &mut memory, progress)?;
        Ok((outputs, memory))
    })?;
    Ok((outputs.into_pyarray(py), shaped(py, memory, shape)?))
}

/// Returns the outputs of tanh layers and a linear one for every row of `inputs`.
#[pyfunction]
pub(crate) fn tanh_layers<'py>(
    py: Python<'py>,
    widths: Vec<usize>,
    parameters: PyReadonlyArray1<'py, f64>,
    inputs: PyReadonlyArray2<'py, f64>,
) -> Object<'py> {
    let shape = [
        inputs.shape()[0],
        widths.last().copied().unwrap_or_default(),
    ];
    let (parameters, inputs) = (parameters.as_slice()?.to_vec(), inputs.as_slice()?.to_vec());
    let outputs = run(py, work(shape[0], parameters.len()), move |progress| {
        flockesc_core::tanh_layers(&widths, &parameters, &inputs, progress)
    })?;
    shaped(py, outputs, shape)
}

/// Returns ln(1 + x) of every number x. Unlike `numpy.log1p`, it has the same bits on every machine.
#[pyfunction]
pub(crate) fn log1p<'py>(
    numbers: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let logarithms = numbers.as_slice()?.iter().map(|x| bindings::log1p(*x));
    Ok(logarithms.collect::<Vec<_>>().into_pyarray(numbers.py()))
}

/// Returns one array per outcome, with one entry per flock.
pub(crate) fn outcome_columns<'py>(py: Python<'py>, outcomes: &[EpisodeOutcome]) -> Dict<'py> {
    let dict = PyDict::new(py);
    for (index, objective) in Objective::ALL.iter().enumerate() {
        let minimum = |flock: &EpisodeOutcome| flock.metrics.objectives[index].minimum;
        dict.set_item(objective.name(), column(py, outcomes, minimum))?;
    }
    let count =
        |count: fn(&EpisodeOutcome) -> usize| column(py, outcomes, |flock| count(flock) as i64);
    dict.set_item("num_components", count(|flock| flock.num_components))?;
    dict.set_item(
        "mean_return",
        column(py, outcomes, |flock| flock.mean_return),
    )?;
    dict.set_item("num_actions", count(|flock| flock.num_actions))?;
    with_load(dict, outcomes, |flock| flock.metrics.load)
}

/// Plays the line of every seed to the end of its episode, under one network for all seeds or one
/// per seed.
///
/// Returns one array per outcome. `report` is called with the number of finished lines.
#[pyfunction]
pub(crate) fn rollout_line<'py>(
    py: Python<'py>,
    documents: (String, String),
    actions: &Bound<'py, RangeMap>,
    network: NetworkArguments<'py>,
    seeds: PyReadonlyArray1<'py, u64>,
    num_threads: Option<usize>,
    report: Option<&Bound<'py, PyAny>>,
) -> Dict<'py> {
    let scenario = Arc::new(LineConfig::from_json(&documents.0).map_err(CoreError::from)?);
    let options = LineEpisodeConfig::from_json(&documents.1).map_err(CoreError::from)?;
    let entries = names(line_entries(scenario.num_agents));
    let networks = network.networks(&entries, actions.get())?;
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
    let count =
        |of: fn(&LineEpisodeOutcome) -> usize| column(py, &outcomes, |line| of(line) as i64);
    let distances = column(py, &outcomes, |line| line.escape_distance);
    let converged = column(py, &outcomes, |line| line.converged);
    [
        ("escape_distance", distances),
        ("num_components", count(|line| line.num_components)),
        ("steps", count(|line| line.steps)),
        ("converged", converged),
        ("num_actions", count(|line| line.num_actions)),
    ]
    .into_py_dict(py)
}
