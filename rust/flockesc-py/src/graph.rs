//! Python functions for the neighbor graph of a flock and the matrices of a line.

use flockesc_core::bindings::memory;
use flockesc_core::{FlockConfig, NeighborGraph, Result, laplacian, perron_matrix};
use numpy::{PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{Object, array, shaped};
use crate::errors::CoreError;
use crate::long_call::run;

/// Scenario (`None`: metric neighbors), positions, velocities and ranges of a flock.
#[derive(FromPyObject)]
pub(crate) struct Graph<'py>(
    Option<String>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray1<'py, f64>,
);

impl Graph<'_> {
    fn parsed(self) -> PyResult<NeighborGraph> {
        let Self(scenario, positions, velocities, ranges) = self;
        let scenario = scenario.as_deref().map(FlockConfig::from_json).transpose();
        Ok(NeighborGraph {
            scenario: scenario.map_err(CoreError::from)?,
            dimension: positions.shape()[1],
            positions: positions.as_slice()?.to_vec(),
            velocities: velocities.as_slice()?.to_vec(),
            ranges: ranges.as_slice()?.to_vec(),
        })
    }
}

#[pyfunction]
pub(crate) fn component_labels<'py>(py: Python<'py>, graph: Graph<'py>) -> Object<'py> {
    let graph = graph.parsed()?;
    let labels = run_detached(py, graph.num_agents(), move || graph.component_labels())?;
    Ok(array(py, labels.into_iter().map(i64::from).collect()))
}

#[pyfunction]
pub(crate) fn neighbor_pairs<'py>(py: Python<'py>, graph: Graph<'py>) -> Object<'py> {
    let graph = graph.parsed()?;
    let flat: Vec<i64> = run_detached(py, graph.num_agents(), move || {
        let pairs = graph.pairs()?;
        let mut flat = memory::vector("interaction_range", 2 * pairs.len())?;
        for (i, j) in pairs {
            flat.extend([i64::from(i), i64::from(j)]);
        }
        Ok(flat)
    })?;
    let pairs = flat.len() / 2;
    shaped(py, flat, [pairs, 2])
}

/// Returns the Perron matrix or the Laplacian of a line's neighbor graph, shape (n, n).
#[pyfunction]
pub(crate) fn line_matrix<'py>(
    py: Python<'py>,
    states: PyReadonlyArray1<'py, f64>,
    interaction_range: f64,
    is_perron: bool,
) -> Object<'py> {
    let states = states.as_slice()?.to_vec();
    let n = states.len();
    let entries = run_detached(py, n, move || {
        let matrix = if is_perron { perron_matrix } else { laplacian };
        matrix(&states, interaction_range)
    })?;
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
