//! `Flock`: Python class of one flock that is stepped and changed on demand. Shapes are checked in Python.

use std::sync::Arc;

use flockesc_core::{Action, InitialState, Run};
use numpy::PyReadonlyArrayDyn;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays::{Object, array, flat, vector};
use crate::batch::{Inner, by_dimension};
use crate::errors::{CoreError, try_borrow, try_borrow_mut};
use crate::info;
use crate::long_call::{LONG, change, maybe_detach, read};
use crate::models::flock;

/// Smallest number of visited agents for a step that can be interrupted, because it runs on a clone. It takes
/// about 0.1 s.
const VERY_LONG: usize = 1 << 20;

/// The flock is copied when it is written while another thread reads it.
#[pyclass(module = "flockesc_env._core")]
#[derive(Clone)]
pub(crate) struct Flock(Inner<Arc<Run<2>>, Arc<Run<3>>>);

#[pymethods]
impl Flock {
    #[new]
    fn new(
        scenario: &str,
        seed: u64,
        positions: Option<PyReadonlyArrayDyn<'_, f64>>,
        velocities: Option<PyReadonlyArrayDyn<'_, f64>>,
        num_threads: Option<usize>,
    ) -> Result<Self, CoreError> {
        let config = flock(scenario)?;
        let start = InitialState {
            positions: flat(positions)?,
            velocities: flat(velocities)?,
            ..InitialState::seeded(seed)
        };
        Ok(Self(match config.dimension {
            2 => Inner::Plane(Arc::new(Run::new(config, &start, num_threads)?)),
            _ => Inner::Space(Arc::new(Run::new(config, &start, num_threads)?)),
        }))
    }

    /// Advances the flock. An interrupt ends the call between two steps.
    fn step(
        slf: &Bound<'_, Self>,
        ranges: PyReadonlyArrayDyn<'_, f64>,
        num_steps: usize,
        predator_actions: Option<PyReadonlyArrayDyn<'_, f64>>,
        extra_force: Option<PyReadonlyArrayDyn<'_, f64>>,
    ) -> PyResult<()> {
        let action = Arc::new(Action {
            ranges: vector(&ranges)?,
            predator_actions: flat(predator_actions)?.unwrap_or_default(),
            extra_force: flat(extra_force)?.unwrap_or_default(),
        });
        let py = slf.py();
        by_dimension!(&mut try_borrow_mut(slf)?.0, run => {
            let visits = run.work(&action.ranges);
            let at_once = if visits < LONG { LONG / visits } else { 1 };
            for first in (0..num_steps).step_by(at_once) {
                if first > 0 {
                    py.check_signals()?;
                }
                let (action, steps) = (Arc::clone(&action), at_once.min(num_steps - first));
                if visits < VERY_LONG {
                    let run = Arc::make_mut(run);
                    maybe_detach(py, visits * steps, || run.step(&action, steps)).map_err(CoreError::from)?;
                } else {
                    change(py, run, visits, move |run, _| Arc::make_mut(run).step(&action, steps))?;
                }
            }
            Ok(())
        })
    }

    /// Sets "positions" or "velocities".
    fn set(
        slf: &Bound<'_, Self>,
        name: &str,
        vectors: PyReadonlyArrayDyn<'_, f64>,
    ) -> Result<(), CoreError> {
        let vectors = vector(&vectors)?;
        by_dimension!(&mut try_borrow_mut(slf)?.0, run => Ok(Arc::make_mut(run).set(name, &vectors)?))
    }

    /// Returns a number of the flock or a new array with an entry or a row per agent or predator, in the order of ids.
    /// Only the number of components depends on `ranges`.
    #[pyo3(signature = (name, ranges=None))]
    fn get<'py>(
        slf: &Bound<'py, Self>,
        name: &str,
        ranges: Option<PyReadonlyArrayDyn<'py, f64>>,
    ) -> Object<'py> {
        let py = slf.py();
        by_dimension!(&try_borrow(slf)?.0, run => match name {
            "seed" => run.seed.into_bound_py_any(py),
            "num_steps" => run.num_steps.into_bound_py_any(py),
            "caught_at" => Ok(array(py, run.caught_at.clone())),
            "caught_by" => Ok(array(py, run.caught_by.clone())),
            "num_components" => {
                let ranges = flat(ranges)?.unwrap_or_default();
                let count = read(py, run, run.work(&ranges), move |run, _| run.num_components(&ranges))?;
                count.into_bound_py_any(py)
            }
            _ => info::measure(py, run.world(), name),
        })
    }

    fn get_state<'py>(slf: &Bound<'py, Self>) -> Result<Bound<'py, PyBytes>, CoreError> {
        by_dimension!(&try_borrow(slf)?.0, run => Ok(PyBytes::new(slf.py(), &run.save()?)))
    }

    fn set_state(slf: &Bound<'_, Self>, state: &[u8]) -> Result<(), CoreError> {
        by_dimension!(&mut try_borrow_mut(slf)?.0, run => Ok(Arc::make_mut(run).restore(state)?))
    }

    fn copy(slf: &Bound<'_, Self>) -> Result<Self, CoreError> {
        Ok(try_borrow(slf)?.clone())
    }
}
