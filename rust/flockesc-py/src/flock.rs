//! `Flock`: Python class of one flock that is stepped and changed on demand. Shapes are checked in Python.

use std::sync::Arc;

use flockesc_core::bindings::Run;
use flockesc_core::{FlockConfig, InitialState};
use nalgebra::SVector;
use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::arrays::{Object, array, flat, shaped, vector};
use crate::errors::{CoreError, try_borrow, try_borrow_mut};
use crate::long_call::change;

#[pyclass(module = "flockesc_env._core")]
#[derive(Clone)]
pub(crate) struct Flock(Inner);

/// A flock in two or three dimensions.
#[derive(Clone)]
enum Inner {
    Plane(Run<2>),
    Space(Run<3>),
}

/// Evaluates the same expression on a flock in two or three dimensions.
macro_rules! on_run {
    ($inner:expr, $run:ident => $body:expr) => {
        match $inner {
            Inner::Plane($run) => $body,
            Inner::Space($run) => $body,
        }
    };
}

#[pymethods]
impl Flock {
    #[new]
    fn new(
        scenario: &str,
        seed: u64,
        positions: Option<PyReadonlyArrayDyn<'_, f64>>,
        num_threads: Option<usize>,
    ) -> Result<Self, CoreError> {
        let config = Arc::new(FlockConfig::from_json(scenario)?);
        let start = InitialState {
            positions: flat(positions)?,
            ..InitialState::seeded(seed)
        };
        Ok(Self(match config.dimension {
            2 => Inner::Plane(Run::new(config, &start, num_threads)?),
            _ => Inner::Space(Run::new(config, &start, num_threads)?),
        }))
    }

    /// Advances the flock. An interrupted call changes nothing.
    fn step(
        slf: &Bound<'_, Self>,
        ranges: PyReadonlyArrayDyn<'_, f64>,
        num_steps: usize,
        predator_actions: Option<PyReadonlyArrayDyn<'_, f64>>,
        extra_force: Option<PyReadonlyArrayDyn<'_, f64>>,
    ) -> PyResult<()> {
        let given = [Some(ranges), predator_actions, extra_force].map(flat);
        let [ranges, actions, force] = given.map(|array| array.map(Option::unwrap_or_default));
        let (ranges, actions, force) = (ranges?, actions?, force?);
        on_run!(&mut try_borrow_mut(slf)?.0, run => {
            let visits = run.work(&ranges).saturating_mul(num_steps);
            change(slf.py(), run, visits, move |run, progress| {
                run.step(&ranges, num_steps, &actions, &force, progress)
            })
        })
    }

    /// Sets "positions" or "velocities".
    fn set(
        slf: &Bound<'_, Self>,
        name: &str,
        vectors: PyReadonlyArrayDyn<'_, f64>,
    ) -> Result<(), CoreError> {
        on_run!(&mut try_borrow_mut(slf)?.0, run => Ok(run.set(name, &vector(&vectors)?)?))
    }

    /// Returns a new array with an entry or a row per agent or predator, in the order of ids.
    fn array<'py>(slf: &Bound<'py, Self>, name: &str) -> Object<'py> {
        let py = slf.py();
        on_run!(&try_borrow(slf)?.0, run => {
            let (world, predators) = (run.world(), run.world().predators());
            Ok(match name {
                "positions" => rows(py, &world.positions())?,
                "velocities" => rows(py, &world.velocities())?,
                "predator_positions" => rows(py, predators.iter().map(|p| &p.position))?,
                "predator_velocities" => rows(py, predators.iter().map(|p| &p.velocity))?,
                "caught_by" => array(py, run.captures.1.clone()),
                "heard" => array(py, world.heard()),
                _ => {
                    let mut distances = Vec::new();
                    world.write_distances(&mut distances);
                    array(py, distances)
                }
            })
        })
    }

    /// The seed, and the number of steps since t = 0.
    #[getter]
    fn origin(slf: &Bound<'_, Self>) -> Result<(u64, usize), CoreError> {
        on_run!(&try_borrow(slf)?.0, run => Ok(run.origin))
    }

    fn get_state<'py>(slf: &Bound<'py, Self>) -> Result<Bound<'py, PyBytes>, CoreError> {
        on_run!(&try_borrow(slf)?.0, run => Ok(PyBytes::new(slf.py(), &run.save()?)))
    }

    fn set_state(slf: &Bound<'_, Self>, state: &[u8]) -> Result<(), CoreError> {
        on_run!(&mut try_borrow_mut(slf)?.0, run => Ok(run.restore(state)?))
    }

    fn copy(slf: &Bound<'_, Self>) -> Result<Self, CoreError> {
        Ok(try_borrow(slf)?.clone())
    }
}

/// Returns an array with a row per vector.
fn rows<'py, 'a, const D: usize>(
    py: Python<'py>,
    vectors: impl IntoIterator<Item = &'a SVector<f64, D>>,
) -> Object<'py> {
    let entries: Vec<f64> = vectors.into_iter().flatten().copied().collect();
    let count = entries.len() / D;
    shaped(py, entries, [count, D])
}
