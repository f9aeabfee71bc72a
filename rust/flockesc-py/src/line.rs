//! `LineEpisode`: one line in an episode.

use std::sync::Arc;

use flockesc_core::{LineConfig, LineEpisodeConfig, line_entries};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyType};

use crate::arrays::flat;
use crate::errors::CoreError;

#[pyclass(module = "flockesc_env._core")]
#[derive(Clone)]
pub(crate) struct LineEpisode {
    inner: flockesc_core::LineEpisode,
    /// Scenario and options that it was made from.
    made_from: (String, String),
}

#[pymethods]
impl LineEpisode {
    #[new]
    #[pyo3(signature = (scenario, options, seed, initial_state=None))]
    fn new(
        scenario: &str,
        options: &str,
        seed: u64,
        initial_state: Option<PyReadonlyArrayDyn<'_, f64>>,
    ) -> PyResult<Self> {
        let made_from = (scenario.to_owned(), options.to_owned());
        let scenario = LineConfig::from_json(scenario).map_err(CoreError::from)?;
        let options = LineEpisodeConfig::from_json(options).map_err(CoreError::from)?;
        let states = flat(initial_state)?;
        let inner =
            flockesc_core::LineEpisode::new(Arc::new(scenario), options, seed, states.as_deref())
                .map_err(CoreError::from)?;
        Ok(Self { inner, made_from })
    }

    fn step(&mut self, interaction_range: f64) -> Result<f64, CoreError> {
        Ok(self.inner.advance(interaction_range)?)
    }

    fn observe<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        self.inner.observation().into_pyarray(py)
    }

    /// The episode, and the seed and the next number of the schedule that it belongs to, as bytes.
    fn get_state<'py>(
        &self,
        py: Python<'py>,
        seed: u64,
        episode: u64,
    ) -> Result<Bound<'py, PyBytes>, CoreError> {
        Ok(PyBytes::new(py, &self.inner.save((seed, episode))?))
    }

    /// Becomes what `get_state` has saved, and returns the schedule. Nothing changes if that is refused.
    fn set_state(&mut self, state: &[u8]) -> Result<(u64, u64), CoreError> {
        let (episode, schedule) = self.inner.restored(state)?;
        self.inner = episode;
        Ok(schedule)
    }

    #[expect(clippy::type_complexity, reason = "what pickle takes")]
    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(
        Bound<'py, PyType>,
        (String, String, u64),
        Bound<'py, PyBytes>,
    )> {
        let episode = slf.borrow();
        let (scenario, options) = episode.made_from.clone();
        let state = episode.get_state(slf.py(), 0, 0)?;
        Ok((slf.get_type(), (scenario, options, 0), state))
    }

    fn __setstate__(&mut self, state: &[u8]) -> Result<(), CoreError> {
        self.set_state(state).map(drop)
    }

    /// An equal episode that goes its own way.
    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.clone()
    }

    #[getter]
    fn states<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.inner.line().states().into_pyarray(py)
    }

    #[getter]
    fn steps(&self) -> usize {
        self.inner.steps()
    }

    #[getter]
    fn escape_distance(&self) -> f64 {
        self.inner.line().escape_distance()
    }

    #[getter]
    fn num_components(&self) -> usize {
        self.inner.line().num_components(self.inner.last_range())
    }

    #[getter]
    fn interaction_range(&self) -> f64 {
        self.inner.last_range()
    }

    #[getter]
    fn is_steady(&self) -> bool {
        self.inner.is_steady()
    }

    #[getter]
    fn has_ended(&self) -> bool {
        self.inner.has_ended()
    }
}

/// Name, lower and upper bound of every entry of a line observation.
#[pyfunction]
pub(crate) fn line_observation_entries(num_agents: usize) -> Vec<(String, f32, f32)> {
    line_entries(num_agents)
        .into_iter()
        .map(|entry| (entry.name, entry.low, entry.high))
        .collect()
}
