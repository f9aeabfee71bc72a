//! Steps of a batch.

use flockesc_core::Error;
use flockesc_core::bindings::AtEnd;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::FlockBatch;
use super::inner::{Inner, on_batch};
use crate::arrays::{overwrite, shaped, vector};
use crate::errors::{CoreError, try_borrow, try_borrow_mut};
use crate::info::{Measured, columns, numbers};

/// Observations, rewards, end flags of the episodes, ranges in m, metrics.
pub(super) type Step<'py> = (
    Bound<'py, PyAny>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyDict>,
);

/// Observations, rewards, end flag of the episode, ranges in m, metrics.
pub(super) type StepFlock<'py> = (
    Bound<'py, PyAny>,
    Bound<'py, PyArray1<f64>>,
    bool,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyDict>,
);

/// Observation, reward, end flag of the episode, `info`.
pub(super) type StepOne<'py> = (Bound<'py, PyArray1<f32>>, f64, bool, Bound<'py, PyDict>);

/// Output arrays for observations and rewards.
pub(super) type Out<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<f64>>);

/// Observations, rewards, ranges in m, metrics of each flock.
type Stepped<'py> = (
    Bound<'py, PyAny>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Vec<Measured>,
);

/// Steps all flocks; see [`FlockBatch::step`].
pub(super) fn step<'py>(
    slf: &Bound<'py, FlockBatch>,
    py: Python<'py>,
    actions: &Bound<'py, PyAny>,
    label: Option<&Bound<'py, PyAny>>,
    at_end: &str,
    out: Option<Out<'py>>,
    predator_actions: Option<Bound<'py, PyAny>>,
) -> PyResult<Step<'py>> {
    let at_end = parsed(at_end)?;
    let (observations, rewards, ranges, measured) =
        stepped(slf, py, (actions, label), at_end, out, predator_actions)?;
    let ended = try_borrow(slf)?.inner.ended()?.into_pyarray(py);
    Ok((
        observations,
        rewards,
        ended,
        ranges,
        columns(py, &measured)?,
    ))
}

/// Steps a batch of one flock; see [`FlockBatch::step_flock`].
pub(super) fn step_flock<'py>(
    slf: &Bound<'py, FlockBatch>,
    py: Python<'py>,
    actions: &Bound<'py, PyAny>,
    label: Option<&Bound<'py, PyAny>>,
    predator_actions: Option<Bound<'py, PyAny>>,
) -> PyResult<StepFlock<'py>> {
    let action = (actions, label);
    let (observations, rewards, ranges, measured) =
        stepped(slf, py, action, AtEnd::Refuse, None, predator_actions)?;
    let has_ended = try_borrow(slf)?.inner.has_ended(0)?;
    Ok((
        observations,
        rewards,
        has_ended,
        ranges,
        first(py, &measured)?,
    ))
}

fn stepped<'py>(
    slf: &Bound<'py, FlockBatch>,
    py: Python<'py>,
    (actions, label): (&Bound<'py, PyAny>, Option<&Bound<'py, PyAny>>),
    at_end: AtEnd,
    out: Option<Out<'py>>,
    predator_actions: Option<Bound<'py, PyAny>>,
) -> PyResult<Stepped<'py>> {
    let (map, rows) = {
        let this = try_borrow(slf)?;
        (this.actions.clone(), this.num_flocks * this.rows)
    };
    let mut ranges = map.ranges(actions, rows)?; // may call Python, so no borrow is held
    let is_ignored = try_borrow(slf)?.inner.is_ignored(at_end)?;
    for (range, is_ignored) in ranges.iter_mut().zip(is_ignored) {
        if is_ignored {
            *range = 0.0;
        }
    }
    map.check(&ranges, actions, label)?;
    let predator_actions = predator_actions_of(slf, predator_actions, at_end)?;
    let this = &mut *try_borrow_mut(slf)?;
    let (mut observations, mut rewards) = match out {
        Some(_) if !this.scratch.1.is_empty() => std::mem::take(&mut this.scratch),
        _ => (vec![0.0; rows * this.row_length], vec![0.0; rows]),
    };
    let out_of_core = (&mut rewards, &mut observations);
    let counts = this.count_components;
    let measured = this.inner.advance(
        py,
        (&ranges, &predator_actions),
        at_end,
        out_of_core,
        counts,
    )?;
    let (observations, rewards) = match out {
        Some((kept_observations, kept_rewards)) => {
            overwrite(&kept_observations, &observations)?;
            overwrite(&kept_rewards, &rewards)?;
            this.scratch = (observations, rewards);
            (kept_observations.into_any(), kept_rewards)
        }
        None => (
            shaped(py, observations, [rows, this.row_length])?,
            rewards.into_pyarray(py),
        ),
    };
    Ok((observations, rewards, ranges.into_pyarray(py), measured))
}

/// Steps a batch of one flock; see [`FlockBatch::step_one`].
pub(super) fn step_one<'py>(
    slf: &Bound<'py, FlockBatch>,
    py: Python<'py>,
    action: &Bound<'py, PyAny>,
    predator_actions: Option<Bound<'py, PyAny>>,
) -> PyResult<StepOne<'py>> {
    let map = try_borrow(slf)?.actions.clone();
    let range = map.to_range(action)?; // may call Python, so no borrow is held
    let predator_actions = predator_actions_of(slf, predator_actions, AtEnd::Refuse)?;
    let this = &mut *try_borrow_mut(slf)?;
    let mut reward = vec![0.0];
    let mut observation = vec![0.0; this.row_length];
    let out_of_core = (&mut reward, &mut observation);
    let counts = this.count_components;
    let action = (&[range][..], &predator_actions[..]);
    let measured = this
        .inner
        .advance(py, action, AtEnd::Refuse, out_of_core, counts)?;
    let info = first(py, &measured)?;
    info.set_item(intern!(py, "interaction_range"), range)?;
    let ended = this.inner.has_ended(0)?;
    Ok((observation.into_pyarray(py), reward[0], ended, info))
}

/// Returns the actions of the learned predators from an array, or from a function that returns it. The
/// function may change the memory of a policy, so it is called after all other checks of a step.
fn predator_actions_of(
    slf: &Bound<'_, FlockBatch>,
    given: Option<Bound<'_, PyAny>>,
    at_end: AtEnd,
) -> PyResult<Vec<f64>> {
    let Some(given) = given else {
        return Ok(Vec::new());
    };
    if !given.is_callable() {
        return vector(&given.extract()?);
    }
    on_batch!(&try_borrow(slf)?.inner, batch => batch.check_episodes(at_end))
        .map_err(CoreError::from)?;
    vector(&given.call0()?.extract()?)
}

/// Returns the metrics of the first flock as numbers.
fn first<'py>(py: Python<'py>, measured: &[Measured]) -> PyResult<Bound<'py, PyDict>> {
    match measured.first() {
        Some(measured) => numbers(py, measured),
        None => Ok(PyDict::new(py)),
    }
}

fn parsed(at_end: &str) -> Result<AtEnd, CoreError> {
    match at_end {
        "refuse" => Ok(AtEnd::Refuse),
        "restart" => Ok(AtEnd::Restart),
        "stay" => Ok(AtEnd::Stay),
        other => Err(Error::argument("at_end", "refuse, restart or stay", other).into()),
    }
}
