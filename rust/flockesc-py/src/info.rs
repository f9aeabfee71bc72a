//! Metrics and states of flocks as Python dictionaries.

use std::collections::BTreeMap;

use flockesc_core::{Episode, Metrics, Objective, objectives};
use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyList, PyString};

use crate::arrays::{column, shaped};

/// The metrics of one flock, with the number of connected components if it was requested.
pub(crate) struct Measured {
    metrics: Metrics,
    components: Option<usize>,
}

impl Measured {
    pub(crate) fn of<const D: usize>(episode: &Episode<D>, count_components: bool) -> Self {
        Self {
            metrics: Metrics::of(episode),
            components: count_components.then(|| episode.num_components()),
        }
    }
}

/// Returns the interned names of the metrics, with their places in [`values`].
fn fields(py: Python<'_>) -> &'static [(Py<PyString>, usize)] {
    static FIELDS: PyOnceLock<Vec<(Py<PyString>, usize)>> = PyOnceLock::new();
    FIELDS.get_or_init(py, || {
        let flock = || objectives().take(Objective::COUNT);
        let now = flock().map(|objective| objective.series);
        let minima = flock().map(|objective| objective.column);
        let names = now.chain(minima).chain(["polarization"]).zip(0..);
        // A value that never rises has one name for both.
        let places: BTreeMap<&str, usize> = names.collect();
        let interned = |(name, place)| (PyString::intern(py, name).unbind(), place);
        places.into_iter().map(interned).collect()
    })
}

/// Returns the values of all objectives, their running minima, and the polarization.
fn values(metrics: &Metrics) -> [f64; 2 * Objective::COUNT + 1] {
    let mut values = [metrics.polarization; 2 * Objective::COUNT + 1];
    for (index, running) in metrics.objectives.iter().enumerate() {
        values[index] = running.now;
        values[Objective::COUNT + index] = running.minimum;
    }
    values
}

/// Returns the metrics of one flock as numbers.
pub(crate) fn numbers<'py>(py: Python<'py>, measured: &Measured) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let values = values(&measured.metrics);
    for (name, place) in fields(py) {
        dict.set_item(name, values[*place])?;
    }
    if let Some(components) = measured.components {
        dict.set_item(intern!(py, "num_components"), components)?;
    }
    Ok(dict)
}

/// Returns the state of a flock: step, ranges, predator distances, positions and velocities of agents and
/// predators.
pub(crate) fn state<'py, const D: usize>(
    py: Python<'py>,
    episode: &Episode<D>,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let world = episode.world();
    let agents = [world.config().num_agents, world.config().dimension];
    let predators = [world.predators().len(), world.config().dimension];
    let mut distances = Vec::new();
    world.write_distances(&mut distances);
    let flat = |rows: &[_]| rows.iter().flatten().copied().collect::<Vec<f64>>();
    let positions: Vec<_> = world.predators().iter().map(|p| p.position).collect();
    let velocities: Vec<_> = world.predators().iter().map(|p| p.velocity).collect();
    dict.set_item("step", episode.step_count())?;
    dict.set_item(
        "interaction_range",
        episode.ranges().to_vec().into_pyarray(py),
    )?;
    dict.set_item("distances", distances.into_pyarray(py))?;
    dict.set_item("positions", shaped(py, flat(&world.positions()), agents)?)?;
    dict.set_item("velocities", shaped(py, flat(&world.velocities()), agents)?)?;
    dict.set_item(
        "predator_positions",
        shaped(py, flat(&positions), predators)?,
    )?;
    dict.set_item(
        "predator_velocities",
        shaped(py, flat(&velocities), predators)?,
    )?;
    Ok(dict)
}

/// Returns the metrics of several flocks, one array per metric.
pub(crate) fn metric_columns<'py>(
    py: Python<'py>,
    metrics: &[Metrics],
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (name, place) in fields(py) {
        dict.set_item(name, column(py, metrics, |flock| values(flock)[*place]))?;
    }
    Ok(dict)
}

/// Returns the metrics of several flocks as [`metric_columns`] does, with the number of components if it was
/// requested.
pub(crate) fn columns<'py>(py: Python<'py>, measured: &[Measured]) -> PyResult<Bound<'py, PyDict>> {
    let metrics: Vec<Metrics> = measured.iter().map(|flock| flock.metrics).collect();
    let dict = metric_columns(py, &metrics)?;
    let components: Option<Vec<i64>> = measured
        .iter()
        .map(|flock| flock.components.map(|count| count as i64))
        .collect();
    if let Some(components) = components {
        dict.set_item(
            intern!(py, "num_components"),
            column(py, &components, |count| *count),
        )?;
    }
    Ok(dict)
}

/// Returns new `info` dicts: one per flock or, with `ranges`, one per range, which then has the key
/// `interaction_range`.
///
/// `columns` are arrays with one entry per flock. `ranges` has the ranges of the first flock, then those of the
/// second, and so on.
#[pyfunction]
#[pyo3(signature = (columns, ranges=None))]
pub(crate) fn infos<'py>(
    columns: &Bound<'py, PyDict>,
    ranges: Option<PyReadonlyArray1<'py, f64>>,
) -> PyResult<Bound<'py, PyList>> {
    let py = columns.py();
    let (names, arrays) = (columns.keys(), columns.values());
    let values = arrays.iter().map(|array| {
        let list = array.call_method0(intern!(py, "tolist"))?;
        Ok(list.cast_into::<PyList>()?)
    });
    let values = values.collect::<PyResult<Vec<_>>>()?;
    let flocks = values.first().map_or(0, PyListMethods::len);
    let ranges = ranges
        .as_ref()
        .map(PyReadonlyArray1::as_slice)
        .transpose()?;
    let rows = ranges.map_or(0, <[f64]>::len) / flocks.max(1);
    let info = PyDict::new(py);
    let infos = PyList::empty(py);
    for flock in 0..flocks {
        for (name, values) in names.iter().zip(&values) {
            info.set_item(name, values.get_item(flock)?)?;
        }
        match ranges {
            Some(ranges) => {
                for range in &ranges[flock * rows..(flock + 1) * rows] {
                    infos.append(with_range(&info, *range)?)?;
                }
            }
            None => infos.append(info.copy()?)?,
        }
    }
    Ok(infos)
}

/// Returns a dict with a new `info` dict for each of `names`: a copy of `info` with its range.
#[pyfunction]
pub(crate) fn named_infos<'py>(
    names: &Bound<'py, PyList>,
    info: &Bound<'py, PyDict>,
    ranges: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyDict>> {
    let (info, named) = (info.copy()?, PyDict::new(info.py()));
    for (name, range) in names.iter().zip(ranges.as_slice()?) {
        named.set_item(name, with_range(&info, *range)?)?;
    }
    Ok(named)
}

/// Sets `interaction_range` and returns a copy of the dict. Adding all keys one by one takes longer.
fn with_range<'py>(info: &Bound<'py, PyDict>, range: f64) -> PyResult<Bound<'py, PyDict>> {
    info.set_item(intern!(info.py(), "interaction_range"), range)?;
    info.copy()
}
