//! Python functions for the neighbor graph of a flock and the matrices of a line.

use flockesc_core::bindings::memory;
use flockesc_core::{FlockConfig, NeighborGraph, Result};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{Object, shaped};
use crate::errors::CoreError;
use crate::long_call::run;

#[pyfunction]
pub(crate) fn component_labels<'py>(
    py: Python<'py>,
    scenario: Option<&str>,
    positions: PyReadonlyArray2<'py, f64>,
    velocities: PyReadonlyArray2<'py, f64>,
    ranges: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<i64>>> {
    let arguments = arguments(scenario, &positions, &velocities, &ranges)?;
    let n = arguments.num_agents();
    let labels = run_detached(py, n, move || arguments.component_labels())?;
    let labels: Vec<i64> = labels.into_iter().map(i64::from).collect();
    Ok(labels.into_pyarray(py))
}

#[pyfunction]
pub(crate) fn neighbor_pairs<'py>(
    py: Python<'py>,
    scenario: Option<&str>,
    positions: PyReadonlyArray2<'py, f64>,
    velocities: PyReadonlyArray2<'py, f64>,
    ranges: PyReadonlyArray1<'py, f64>,
) -> Object<'py> {
    let arguments = arguments(scenario, &positions, &velocities, &ranges)?;
    let flat: Vec<i64> = run_detached(py, arguments.num_agents(), move || {
        let pairs = arguments.pairs()?;
        let mut flat = memory::vector("interaction_range", 2 * pairs.len())?;
        for (i, j) in pairs {
            flat.extend([i64::from(i), i64::from(j)]);
        }
        Ok(flat)
    })?;
    let pairs = flat.len() / 2;
    shaped(py, flat, [pairs, 2])
}

fn arguments(
    scenario: Option<&str>,
    positions: &PyReadonlyArray2<'_, f64>,
    velocities: &PyReadonlyArray2<'_, f64>,
    ranges: &PyReadonlyArray1<'_, f64>,
) -> PyResult<NeighborGraph> {
    let scenario = scenario.map(FlockConfig::from_json).transpose();
    Ok(NeighborGraph {
        scenario: scenario.map_err(CoreError::from)?,
        dimension: positions.shape()[1],
        positions: positions.as_slice()?.to_vec(),
        velocities: velocities.as_slice()?.to_vec(),
        ranges: ranges.as_slice()?.to_vec(),
    })
}

#[pyfunction]
pub(crate) fn laplacian<'py>(
    py: Python<'py>,
    states: PyReadonlyArray1<'py, f64>,
    interaction_range: f64,
) -> Object<'py> {
    matrix(py, &states, interaction_range, flockesc_core::laplacian)
}

#[pyfunction]
pub(crate) fn perron_matrix<'py>(
    py: Python<'py>,
    states: PyReadonlyArray1<'py, f64>,
    interaction_range: f64,
) -> Object<'py> {
    matrix(py, &states, interaction_range, flockesc_core::perron_matrix)
}

/// Computes a matrix of a line's neighbor graph, shape (n, n).
fn matrix<'py>(
    py: Python<'py>,
    states: &PyReadonlyArray1<'py, f64>,
    range: f64,
    compute: fn(&[f64], f64) -> Result<Vec<f64>>,
) -> Object<'py> {
    let states = states.as_slice()?.to_vec();
    let n = states.len();
    let entries = run_detached(py, n, move || compute(&states, range))?;
    shaped(py, entries, [n, n])
}

/// Runs `work`, which may visit all pairs of n agents. For many agents it can be interrupted.
fn run_detached<T: Send + 'static>(
    py: Python<'_>,
    n: usize,
    work: impl FnOnce() -> Result<T> + Send + 'static,
) -> PyResult<T> {
    run(py, n.saturating_mul(n), |_| work())
}
