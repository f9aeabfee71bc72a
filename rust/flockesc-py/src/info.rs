//! Metrics and states of flocks as Python dictionaries.

use std::collections::BTreeMap;

use flockesc_core::{Episode, Load, Metrics, Objective, World};
use nalgebra::SVector;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyString};
use pyo3::{IntoPyObjectExt, intern};

use crate::arrays::{Dict, Object, array, column, shaped};

/// The metrics of one flock, with the number of connected components if it was requested.
pub(crate) struct Measured {
    metrics: Metrics,
    components: Option<usize>,
}

impl Measured {
    pub(crate) fn of<const D: usize>(episode: &Episode<D>, count_components: bool) -> Self {
        Self {
            metrics: episode.metrics(),
            components: count_components.then(|| episode.num_components()),
        }
    }
}

/// Returns the interned names of the metrics, with their places in [`values`].
fn fields(py: Python<'_>) -> &'static [(Py<PyString>, usize)] {
    static FIELDS: PyOnceLock<Vec<(Py<PyString>, usize)>> = PyOnceLock::new();
    FIELDS.get_or_init(py, || {
        let now = Objective::ALL.iter().map(|objective| objective.series());
        let minima = Objective::ALL.iter().map(|objective| objective.name());
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
pub(crate) fn numbers<'py>(py: Python<'py>, measured: &Measured) -> Dict<'py> {
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
pub(crate) fn state<'py, const D: usize>(py: Python<'py>, episode: &Episode<D>) -> Dict<'py> {
    let dict = PyDict::new(py);
    dict.set_item("step", episode.step_count())?;
    dict.set_item("interaction_range", array(py, episode.ranges().to_vec()))?;
    for name in [
        "distances",
        "positions",
        "velocities",
        "predator_positions",
        "predator_velocities",
    ] {
        dict.set_item(name, measure(py, episode.world(), name)?)?;
    }
    Ok(dict)
}

/// Returns a number of a flock, or a new array with an entry or a row per agent or predator in the order of ids.
pub(crate) fn measure<'py, const D: usize>(
    py: Python<'py>,
    world: &World<D>,
    name: &str,
) -> Object<'py> {
    let predators = world.predators().iter();
    match name {
        "mean_distance" => world.predator_distance().mean.into_bound_py_any(py),
        "min_distance" => world.predator_distance().minimum.into_bound_py_any(py),
        "polarization" => world.polarization().into_bound_py_any(py),
        "fraction_surviving" => world.fraction_surviving().into_bound_py_any(py),
        "positions" => rows(py, world.positions()),
        "velocities" => rows(py, world.velocities()),
        "predator_positions" => rows(py, predators.map(|p| p.position).collect()),
        "predator_velocities" => rows(py, predators.map(|p| p.velocity).collect()),
        "heard" => Ok(array(py, world.heard())),
        _ => {
            let mut distances = Vec::new();
            world.write_distances(&mut distances);
            Ok(array(py, distances))
        }
    }
}

fn rows<const D: usize>(py: Python<'_>, vectors: Vec<SVector<f64, D>>) -> Object<'_> {
    let shape = [vectors.len(), D];
    shaped(py, vectors.iter().flatten().copied().collect(), shape)
}

/// Adds the mean range and the mean number of agents heard of every run.
pub(crate) fn with_load<'py, S>(
    dict: Bound<'py, PyDict>,
    runs: &[S],
    load: impl Fn(&S) -> Load,
) -> Dict<'py> {
    let py = dict.py();
    dict.set_item("mean_range", column(py, runs, |run| load(run).mean_range))?;
    dict.set_item("mean_heard", column(py, runs, |run| load(run).mean_heard()))?;
    Ok(dict)
}

/// Returns the metrics of several flocks, one array per metric.
pub(crate) fn metric_columns<'py>(py: Python<'py>, metrics: &[Metrics]) -> Dict<'py> {
    let dict = PyDict::new(py);
    for (name, place) in fields(py) {
        dict.set_item(name, column(py, metrics, |flock| values(flock)[*place]))?;
    }
    Ok(dict)
}

/// Returns the metrics of several flocks as [`metric_columns`] does, with the number of components if it was
/// requested.
pub(crate) fn columns<'py>(py: Python<'py>, measured: &[Measured]) -> Dict<'py> {
    let metrics: Vec<Metrics> = measured.iter().map(|flock| flock.metrics).collect();
    let dict = metric_columns(py, &metrics)?;
    let components = measured.iter().map(|flock| flock.components);
    if let Some(components) = components.collect::<Option<Vec<_>>>() {
        let counts = column(py, &components, |count| *count as i64);
        dict.set_item(intern!(py, "num_components"), counts)?;
    }
    Ok(dict)
}
