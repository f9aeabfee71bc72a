//! `FlockBatch`: the batch of either dimension behind one Python class.

use flockesc_core::{Batch, EpisodeConfig, FlockConfig, InitialState, View, entries};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{column, flat, shaped, vector};
use crate::errors::CoreError;

#[derive(Clone)]
enum Inner {
    Plane(Batch<2>),
    Space(Batch<3>),
}

/// Runs the same expression on the batch of either dimension.
macro_rules! on_batch {
    ($inner:expr, $batch:ident => $body:expr) => {
        match $inner {
            Inner::Plane($batch) => $body,
            Inner::Space($batch) => $body,
        }
    };
}

#[pyclass(module = "flockesc_env._core")]
#[derive(Clone)]
pub(crate) struct FlockBatch {
    inner: Inner,
    rows: usize,
    row_length: usize,
    num_flocks: usize,
}

#[pymethods]
impl FlockBatch {
    #[new]
    #[pyo3(signature = (scenario, options, num_flocks, num_threads))]
    fn new(
        scenario: &str,
        options: &str,
        num_flocks: usize,
        num_threads: Option<usize>,
    ) -> Result<Self, CoreError> {
        let scenario = FlockConfig::from_json(scenario)?;
        let options = EpisodeConfig::from_json(options)?;
        let inner = match scenario.dimension {
            2 => Inner::Plane(Batch::new(scenario, options, num_flocks, num_threads)?),
            _ => Inner::Space(Batch::new(scenario, options, num_flocks, num_threads)?),
        };
        let (rows, row_length) = on_batch!(&inner, batch => (batch.rows(), batch.row_length()));
        Ok(Self {
            inner,
            rows,
            row_length,
            num_flocks,
        })
    }

    #[pyo3(signature = (slot, seed, positions=None, velocities=None, predator_positions=None, predator_velocities=None))]
    fn reset(
        &mut self,
        slot: usize,
        seed: u64,
        positions: Option<PyReadonlyArrayDyn<'_, f64>>,
        velocities: Option<PyReadonlyArrayDyn<'_, f64>>,
        predator_positions: Option<PyReadonlyArrayDyn<'_, f64>>,
        predator_velocities: Option<PyReadonlyArrayDyn<'_, f64>>,
    ) -> PyResult<()> {
        let start = InitialState {
            seed,
            positions: flat(positions)?,
            velocities: flat(velocities)?,
            predator_positions: flat(predator_positions)?,
            predator_velocities: flat(predator_velocities)?,
        };
        on_batch!(&mut self.inner, batch => batch.reset(slot, &start)).map_err(CoreError::from)?;
        Ok(())
    }

    fn step<'py>(
        &mut self,
        py: Python<'py>,
        ranges: PyReadonlyArrayDyn<'py, f64>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyArray1<f64>>)> {
        let ranges = vector(&ranges)?;
        let rows = self.num_flocks * self.rows;
        let mut rewards = vec![0.0; rows];
        let mut observations = vec![0.0_f32; rows * self.row_length];
        let inner = &mut self.inner;
        py.detach(
            || on_batch!(inner, batch => batch.step(&ranges, &mut rewards, &mut observations)),
        )
        .map_err(CoreError::from)?;
        Ok((
            shaped(py, observations, [rows, self.row_length])?,
            rewards.into_pyarray(py),
        ))
    }

    fn observe<'py>(&self, py: Python<'py>, slot: usize) -> PyResult<Bound<'py, PyAny>> {
        let mut observation = vec![0.0_f32; self.rows * self.row_length];
        on_batch!(&self.inner, batch => batch.observe(slot, &mut observation))
            .map_err(CoreError::from)?;
        shaped(py, observation, [self.rows, self.row_length])
    }

    fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let inner = &self.inner;
        let metrics = py
            .detach(|| on_batch!(inner, batch => batch.metrics()))
            .map_err(CoreError::from)?;
        let dict = PyDict::new(py);
        dict.set_item("mean_distance", column(py, &metrics, |m| m.mean_distance))?;
        dict.set_item("min_distance", column(py, &metrics, |m| m.min_distance))?;
        dict.set_item(
            "min_mean_distance",
            column(py, &metrics, |m| m.min_mean_distance),
        )?;
        dict.set_item(
            "min_min_distance",
            column(py, &metrics, |m| m.min_min_distance),
        )?;
        dict.set_item(
            "num_components",
            column(py, &metrics, |m| m.num_components as i64),
        )?;
        dict.set_item("polarization", column(py, &metrics, |m| m.polarization))?;
        Ok(dict)
    }

    /// State of one slot: step, positions, velocities, predator positions and velocities.
    fn state<'py>(&self, py: Python<'py>, slot: usize) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        on_batch!(&self.inner, batch => {
            let episode = batch.episode(slot).map_err(CoreError::from)?;
            let world = episode.world();
            let agents = [world.config().num_agents, world.config().dimension];
            let mut distances = Vec::new();
            world.write_distances(&mut distances);
            let predators = [world.predators().len(), world.config().dimension];
            let flat = |rows: &[_]| rows.iter().flatten().copied().collect::<Vec<f64>>();
            let positions: Vec<_> = world.predators().iter().map(|p| p.position).collect();
            let velocities: Vec<_> = world.predators().iter().map(|p| p.velocity).collect();
            dict.set_item("step", episode.step_count())?;
            dict.set_item("interaction_range", episode.ranges().to_vec().into_pyarray(py))?;
            dict.set_item("distances", distances.into_pyarray(py))?;
            dict.set_item("positions", shaped(py, flat(&world.positions()), agents)?)?;
            dict.set_item("velocities", shaped(py, flat(&world.velocities()), agents)?)?;
            dict.set_item("predator_positions", shaped(py, flat(&positions), predators)?)?;
            dict.set_item("predator_velocities", shaped(py, flat(&velocities), predators)?)?;
        });
        Ok(dict)
    }

    /// An equal batch that goes its own way.
    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.clone()
    }

    /// Whether each slot has reached its horizon.
    fn ended<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<bool>>, CoreError> {
        let ended: Vec<bool> = on_batch!(&self.inner, batch => {
            (0..self.num_flocks)
                .map(|slot| batch.episode(slot).map(|episode| episode.has_ended()))
                .collect::<flockesc_core::Result<_>>()?
        });
        Ok(ended.into_pyarray(py))
    }
}

/// Name, lower and upper bound of every entry of an observation row.
#[pyfunction]
pub(crate) fn observation_entries(per_agent: bool, dimension: usize) -> Vec<(String, f32, f32)> {
    let view = if per_agent { View::Agent } else { View::Flock };
    entries(view, dimension)
        .into_iter()
        .map(|entry| (entry.name, entry.low, entry.high))
        .collect()
}
