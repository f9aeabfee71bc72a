//! The two models as functions: checks, whole runs, sweeps, neighbor graphs.

use std::sync::Arc;

use flockesc_core::{FlockConfig, InitialState, LineConfig, NeighborGraph, Ranges, Schedule};
use nalgebra::SVector;
use numpy::{
    IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArrayDyn,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{flat, grid, rows_and_columns, shaped, vector};
use crate::errors::CoreError;
use crate::long_call::long_call;

#[pyfunction]
pub(crate) fn check_flock_scenario(scenario: &str) -> Result<(), CoreError> {
    FlockConfig::from_json(scenario)?;
    Ok(())
}

/// The document of the episode with this seed; `None` if the scenario draws nothing.
#[pyfunction]
pub(crate) fn drawn_flock_scenario(scenario: &str, seed: u64) -> Result<Option<String>, CoreError> {
    Ok(FlockConfig::from_json(scenario)?.drawn_json(seed))
}

#[pyfunction]
pub(crate) fn check_line_scenario(scenario: &str) -> Result<(), CoreError> {
    LineConfig::from_json(scenario)?;
    Ok(())
}

#[pyfunction]
#[pyo3(signature = (scenario, ranges, seed, positions, velocities, num_threads, controls=None))]
#[expect(clippy::too_many_arguments, reason = "what a run is made from")]
pub(crate) fn simulate_flock<'py>(
    py: Python<'py>,
    scenario: &str,
    ranges: PyReadonlyArrayDyn<'py, f64>,
    seed: u64,
    positions: Option<PyReadonlyArrayDyn<'py, f64>>,
    velocities: Option<PyReadonlyArrayDyn<'py, f64>>,
    num_threads: Option<usize>,
    controls: Option<PyReadonlyArrayDyn<'py, f64>>,
) -> PyResult<Bound<'py, PyDict>> {
    let config = Arc::new(FlockConfig::from_json(scenario).map_err(CoreError::from)?);
    let (rows, columns) = rows_and_columns(&ranges)?;
    let schedule = Schedule {
        values: vector(&ranges)?,
        rows,
        columns,
        controls: flat(controls)?.unwrap_or_default(),
    };
    let start = InitialState {
        seed,
        positions: flat(positions)?,
        velocities: flat(velocities)?,
        ..InitialState::default()
    };
    let run = long_call(py, None, |progress| {
        flockesc_core::simulate_flock(config.clone(), &schedule, &start, num_threads, progress)
    })?;
    let times = config.num_steps + 1;
    let agents = [times, config.num_agents, config.dimension];
    let predators = [times, config.predators.len(), config.dimension];
    let dict = PyDict::new(py);
    dict.set_item("positions", shaped(py, run.positions, agents)?)?;
    dict.set_item("velocities", shaped(py, run.velocities, agents)?)?;
    dict.set_item(
        "predator_positions",
        shaped(py, run.predator_positions, predators)?,
    )?;
    dict.set_item("mean_distance", run.mean_distance.into_pyarray(py))?;
    dict.set_item("min_distance", run.min_distance.into_pyarray(py))?;
    dict.set_item("num_components", run.num_components.into_pyarray(py))?;
    dict.set_item("polarization", run.polarization.into_pyarray(py))?;
    dict.set_item(
        "fraction_surviving",
        run.fraction_surviving.into_pyarray(py),
    )?;
    dict.set_item("caught_at", run.caught_at.into_pyarray(py))?;
    Ok(dict)
}

#[pyfunction]
#[pyo3(signature = (scenario, interaction_range, seed, initial_state=None))]
pub(crate) fn simulate_line<'py>(
    py: Python<'py>,
    scenario: &str,
    interaction_range: f64,
    seed: u64,
    initial_state: Option<PyReadonlyArrayDyn<'py, f64>>,
) -> PyResult<Bound<'py, PyDict>> {
    let config = Arc::new(LineConfig::from_json(scenario).map_err(CoreError::from)?);
    let states = flat(initial_state)?;
    let agents = config.num_agents;
    let run = long_call(py, None, |progress| {
        flockesc_core::simulate_line(config, interaction_range, seed, states.as_deref(), progress)
    })?;
    let dict = PyDict::new(py);
    dict.set_item("states", shaped(py, run.states, [run.steps + 1, agents])?)?;
    dict.set_item("num_components", run.num_components.into_pyarray(py))?;
    dict.set_item("escape_distance", run.escape_distance.into_pyarray(py))?;
    dict.set_item("converged", run.converged)?;
    dict.set_item("steps", run.steps)?;
    Ok(dict)
}

#[pyfunction]
#[pyo3(signature = (scenario, ranges, seeds, num_threads, report))]
pub(crate) fn sweep_flock<'py>(
    py: Python<'py>,
    scenario: &str,
    ranges: PyReadonlyArray1<'py, f64>,
    seeds: PyReadonlyArray1<'py, u64>,
    num_threads: Option<usize>,
    report: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let config = Arc::new(FlockConfig::from_json(scenario).map_err(CoreError::from)?);
    let (ranges, seeds) = (ranges.as_slice()?.to_vec(), seeds.as_slice()?.to_vec());
    let cells = long_call(py, report, |progress| {
        flockesc_core::sweep_flock(&config, &ranges, &seeds, num_threads, progress)
    })?;
    let shape = [ranges.len(), seeds.len()];
    let dict = PyDict::new(py);
    dict.set_item(
        "min_mean_distance",
        grid(py, &cells, shape, |cell| cell.min_mean_distance)?,
    )?;
    dict.set_item(
        "min_min_distance",
        grid(py, &cells, shape, |cell| cell.min_min_distance)?,
    )?;
    dict.set_item(
        "num_components",
        grid(py, &cells, shape, |cell| cell.num_components as i64)?,
    )?;
    dict.set_item(
        "fraction_surviving",
        grid(py, &cells, shape, |cell| cell.fraction_surviving)?,
    )?;
    Ok(dict)
}

#[pyfunction]
#[pyo3(signature = (scenario, ranges, seeds, num_threads, report))]
pub(crate) fn sweep_line<'py>(
    py: Python<'py>,
    scenario: &str,
    ranges: PyReadonlyArray1<'py, f64>,
    seeds: PyReadonlyArray1<'py, u64>,
    num_threads: Option<usize>,
    report: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let config = Arc::new(LineConfig::from_json(scenario).map_err(CoreError::from)?);
    let (ranges, seeds) = (ranges.as_slice()?.to_vec(), seeds.as_slice()?.to_vec());
    let cells = long_call(py, report, |progress| {
        flockesc_core::sweep_line(&config, &ranges, &seeds, num_threads, progress)
    })?;
    let shape = [ranges.len(), seeds.len()];
    let dict = PyDict::new(py);
    dict.set_item(
        "escape_distance",
        grid(py, &cells, shape, |cell| cell.escape_distance)?,
    )?;
    dict.set_item(
        "num_components",
        grid(py, &cells, shape, |cell| cell.num_components as i64)?,
    )?;
    dict.set_item("converged", grid(py, &cells, shape, |cell| cell.converged)?)?;
    Ok(dict)
}

#[pyfunction]
pub(crate) fn component_labels<'py>(
    py: Python<'py>,
    scenario: Option<&str>,
    positions: PyReadonlyArray2<'py, f64>,
    velocities: PyReadonlyArray2<'py, f64>,
    ranges: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<i64>>> {
    let moment = Moment::new(scenario, &positions, &velocities, &ranges)?;
    let labels = py
        .detach(|| match moment.dimension {
            2 => moment.graph::<2>().component_labels(moment.ranges()),
            _ => moment.graph::<3>().component_labels(moment.ranges()),
        })
        .map_err(CoreError::from)?;
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
) -> PyResult<Bound<'py, PyAny>> {
    let moment = Moment::new(scenario, &positions, &velocities, &ranges)?;
    let pairs = py
        .detach(|| match moment.dimension {
            2 => moment.graph::<2>().pairs(moment.ranges()),
            _ => moment.graph::<3>().pairs(moment.ranges()),
        })
        .map_err(CoreError::from)?;
    let flat = pairs.iter().flat_map(|&(i, j)| [i.into(), j.into()]);
    shaped(py, flat.collect::<Vec<i64>>(), [pairs.len(), 2])
}

/// A flock at one moment whose neighbor graph is asked for.
struct Moment {
    config: Option<FlockConfig>,
    dimension: usize,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    ranges: Vec<f64>,
}

impl Moment {
    fn new(
        scenario: Option<&str>,
        positions: &PyReadonlyArray2<'_, f64>,
        velocities: &PyReadonlyArray2<'_, f64>,
        ranges: &PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Self> {
        let config = scenario.map(FlockConfig::from_json).transpose();
        Ok(Self {
            config: config.map_err(CoreError::from)?,
            dimension: positions.shape()[1],
            positions: positions.as_slice()?.to_vec(),
            velocities: velocities.as_slice()?.to_vec(),
            ranges: ranges.as_slice()?.to_vec(),
        })
    }

    fn graph<const D: usize>(&self) -> NeighborGraph<D> {
        let vectors = |flat: &[f64]| -> Vec<_> {
            let rows = flat.chunks_exact(D);
            rows.map(SVector::<f64, D>::from_column_slice).collect()
        };
        let (positions, velocities) = (vectors(&self.positions), vectors(&self.velocities));
        NeighborGraph::new(self.config.as_ref(), &positions, &velocities)
    }

    fn ranges(&self) -> Ranges<'_> {
        match self.ranges[..] {
            [range] => Ranges::Shared(range),
            _ => Ranges::PerAgent(&self.ranges),
        }
    }
}

#[pyfunction]
pub(crate) fn laplacian<'py>(
    py: Python<'py>,
    states: PyReadonlyArray1<'py, f64>,
    interaction_range: f64,
) -> PyResult<Bound<'py, PyAny>> {
    square(
        py,
        flockesc_core::laplacian(states.as_slice()?, interaction_range),
    )
}

#[pyfunction]
pub(crate) fn perron_matrix<'py>(
    py: Python<'py>,
    states: PyReadonlyArray1<'py, f64>,
    interaction_range: f64,
) -> PyResult<Bound<'py, PyAny>> {
    square(
        py,
        flockesc_core::perron_matrix(states.as_slice()?, interaction_range),
    )
}

/// A matrix of nalgebra (column-major) as a numpy array (row-major).
fn square(py: Python<'_>, matrix: nalgebra::DMatrix<f64>) -> PyResult<Bound<'_, PyAny>> {
    let n = matrix.nrows();
    shaped(py, matrix.transpose().data.into(), [n, n])
}
