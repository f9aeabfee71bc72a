//! `LineEpisode`: Python class of an episode of a line.

use std::sync::Arc;

use flockesc_core::{LineConfig, LineEpisodeConfig};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use pyo3::{IntoPyObjectExt, intern};

use crate::arrays::{Dict, Object, Tuple, array, flat};
use crate::errors::{CoreError, try_borrow, try_borrow_mut};
use crate::long_call::{change, maybe_detach, run};

#[pyclass(module = "flockesc_env._core")]
#[derive(Clone)]
pub(crate) struct LineEpisode {
    inner: flockesc_core::LineEpisode,
    /// Scenario and options, as given to the constructor.
    made_from: (String, String),
}

#[pymethods]
impl LineEpisode {
    #[new]
    #[pyo3(signature = (scenario, options, seed, initial_state=None))]
    fn new(
        py: Python<'_>,
        scenario: &str,
        options: &str,
        seed: u64,
        initial_state: Option<PyReadonlyArrayDyn<'_, f64>>,
    ) -> PyResult<Self> {
        let made_from = (scenario.to_owned(), options.to_owned());
        let scenario = LineConfig::from_json(scenario).map_err(CoreError::from)?;
        let options = LineEpisodeConfig::from_json(options).map_err(CoreError::from)?;
        let states = flat(initial_state)?;
        let inner = run(py, scenario.num_agents, move |_| {
            flockesc_core::LineEpisode::new(Arc::new(scenario), options, seed, states.as_deref())
        })?;
        Ok(Self { inner, made_from })
    }

    /// Applies one action, and returns observation, reward, terminated (in the steady state), truncated and
    /// `info`. An interrupted call is rolled back.
    fn step<'py>(slf: &Bound<'py, Self>, interaction_range: f64) -> Tuple<'py> {
        let py = slf.py();
        let this = &mut *try_borrow_mut(slf)?;
        let visits = this.inner.work();
        let (reward, observation) =
            change(py, &mut this.inner, visits, move |episode, progress| {
                let reward = episode.advance(interaction_range, progress)?;
                Ok((reward, episode.observation()))
            })?;
        let is_steady = this.inner.is_steady();
        let is_truncated = this.inner.has_ended() && !is_steady;
        let (observation, info) = (observation.into_pyarray(py), info(py, &this.inner)?);
        (observation, reward, is_steady, is_truncated, info).into_pyobject(py)
    }

    /// Returns the `info` of the environment.
    fn info<'py>(slf: &Bound<'py, Self>) -> Dict<'py> {
        info(slf.py(), &try_borrow(slf)?.inner)
    }

    fn observe<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let (py, inner) = (slf.py(), &try_borrow(slf)?.inner);
        let num_agents = inner.line().config().num_agents;
        let observation = maybe_detach(py, num_agents, || inner.observation());
        Ok(observation.into_pyarray(py))
    }

    /// Returns a snapshot of the episode and its schedule: the first seed and the number of the next episode.
    fn get_state<'py>(
        slf: &Bound<'py, Self>,
        seed: u64,
        episode: u64,
    ) -> Result<Bound<'py, PyBytes>, CoreError> {
        let state = try_borrow(slf)?.inner.save((seed, episode))?;
        Ok(PyBytes::new(slf.py(), &state))
    }

    /// Restores a snapshot by `get_state` and returns its schedule. A rejected snapshot changes nothing.
    fn set_state(slf: &Bound<'_, Self>, state: &[u8]) -> Result<(u64, u64), CoreError> {
        let this = &mut *try_borrow_mut(slf)?;
        let (episode, schedule) = this.inner.restored(state)?;
        this.inner = episode;
        Ok(schedule)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Tuple<'py> {
        let py = slf.py();
        let (scenario, options) = try_borrow(slf)?.made_from.clone();
        let state = Self::get_state(slf, 0, 0)?;
        (slf.get_type(), (scenario, options, 0), state).into_pyobject(py)
    }

    fn __setstate__(slf: &Bound<'_, Self>, state: &[u8]) -> Result<(), CoreError> {
        Self::set_state(slf, state).map(drop)
    }

    /// Returns an independent copy.
    fn __deepcopy__(slf: &Bound<'_, Self>, _memo: &Bound<'_, PyAny>) -> Result<Self, CoreError> {
        Ok(try_borrow(slf)?.clone())
    }

    /// Returns the states of the agents as a new array, or a number of the episode.
    fn get<'py>(slf: &Bound<'py, Self>, name: &str) -> Object<'py> {
        let (py, episode) = (slf.py(), &try_borrow(slf)?.inner);
        match name {
            "states" => Ok(array(py, episode.line().states())),
            "steps" => episode.steps().into_bound_py_any(py),
            "converged" => episode.is_steady().into_bound_py_any(py),
            "interaction_range" => episode.last_range().into_bound_py_any(py),
            "has_ended" => episode.has_ended().into_bound_py_any(py),
            _ => Ok(info(py, episode)?.as_any().get_item(name)?),
        }
    }
}

/// Returns escape distance, components and range after the last action.
fn info<'py>(py: Python<'py>, episode: &flockesc_core::LineEpisode) -> Dict<'py> {
    let (line, range) = (episode.line(), episode.last_range());
    let dict = PyDict::new(py);
    dict.set_item(intern!(py, "escape_distance"), line.escape_distance())?;
    dict.set_item(intern!(py, "num_components"), line.num_components(range))?;
    dict.set_item(intern!(py, "interaction_range"), range)?;
    Ok(dict)
}
