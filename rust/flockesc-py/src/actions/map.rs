//! `Map`: the conversion of arrays and single actions, and its errors.

use flockesc_core::NormalizedRange;
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::conversion::FromPyObjectOwned;
use pyo3::exceptions::PyValueError;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyBool, PyDict, PyList, PyTuple};

use crate::errors::action_error;

/// The fields of a [`RangeMap`](super::RangeMap).
pub(super) struct Map {
    pub(super) min_range: f64,
    pub(super) max_range: f64,
    /// Whether actions lie in [-1, 1] instead of [`min_range`, `max_range`].
    pub(super) is_normalized: bool,
    /// Ranges in m that a discrete action is an index into.
    pub(super) grid: Option<Vec<f64>>,
}

impl Map {
    /// Returns the ranges of `count` actions, or `None` if `actions` is not an array that can be
    /// read directly.
    pub(super) fn direct(&self, actions: &Bound<'_, PyAny>, count: usize) -> Option<Vec<f64>> {
        if let Some(grid) = &self.grid {
            let array = actions.cast::<PyArray1<i64>>().ok()?.try_readonly().ok()?;
            let indices = array.as_slice().ok()?;
            return (indices.len() == count)
                .then(|| indices.iter().map(|index| entry(grid, *index)).collect());
        }
        self.column::<f32>(actions, count)
            .or_else(|| self.column::<f64>(actions, count))
    }

    fn column<T: Element + Copy + Into<f64>>(
        &self,
        actions: &Bound<'_, PyAny>,
        count: usize,
    ) -> Option<Vec<f64>> {
        let array = actions.cast::<PyArray2<T>>().ok()?;
        if array.shape() != [count, 1] {
            return None;
        }
        let array = array.try_readonly().ok()?;
        let values = array.as_slice().ok()?.iter();
        Some(
            values
                .map(|value| self.of_number((*value).into()))
                .collect(),
        )
    }

    /// Converts actions into a new contiguous array of float64, or int64 with a grid.
    ///
    /// # Errors
    /// `ActionError` on `label` if the dtype or shape is wrong.
    pub(super) fn plain<'py>(
        &self,
        actions: &Bound<'py, PyAny>,
        shape: &[usize],
        label: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = actions.py();
        let numpy = py.import(intern!(py, "numpy"))?;
        let array = match numpy.call_method1(intern!(py, "asarray"), (actions,)) {
            Err(error) if error.is_instance_of::<PyValueError>(py) => {
                let given = "rows of different lengths";
                return Err(action_error(py, label, "an array", given));
            }
            array => array?,
        };
        let dtype = array.getattr(intern!(py, "dtype"))?;
        let kind: char = dtype.getattr(intern!(py, "kind"))?.extract()?;
        let (kinds, expected, wanted) = match self.grid {
            Some(_) => ("iu", "integers", "int64"),
            None => ("fiu", "real numbers", "float64"),
        };
        if !kinds.contains(kind) {
            let given = format!("dtype {}", dtype.str()?);
            return Err(action_error(py, label, expected, given));
        }
        let (shape, given) = (
            PyTuple::new(py, shape)?,
            array.getattr(intern!(py, "shape"))?,
        );
        if !given.eq(&shape)? {
            let (expected, given) = (format!("shape {shape}"), format!("shape {given}"));
            return Err(action_error(py, label, &expected, given));
        }
        // Numbers too large for a float64 become infinite, which is outside of every action space.
        let ignored = [("over", "ignore")].into_py_dict(py)?;
        let context = numpy.call_method("errstate", (), Some(&ignored))?;
        context.call_method0("__enter__")?;
        let plain = array.call_method1("astype", (wanted, "C"));
        context.call_method1("__exit__", (py.None(), py.None(), py.None()))?;
        plain
    }

    /// Converts a single action into a number.
    pub(super) fn plain_one<'py>(
        &self,
        action: &Bound<'py, PyAny>,
        label: &str,
    ) -> PyResult<Bound<'py, PyAny>> {
        let shape: &[usize] = if self.grid.is_some() { &[] } else { &[1] };
        self.plain(action, shape, label)?.call_method0("item")
    }

    /// Reads the actions of `agents` one by one.
    pub(super) fn each<'py, T: FromPyObjectOwned<'py>>(
        &self,
        actions: &Bound<'py, PyAny>,
        agents: &Bound<'py, PyList>,
        known: &Bound<'py, PyAny>,
        read: fn(&Bound<'_, PyAny>) -> Option<T>,
    ) -> PyResult<Vec<T>> {
        let named =
            |agent: &Bound<'_, PyAny>| Ok::<_, PyErr>(format!("action of {}", agent.repr()?));
        if actions.len()? != agents.len() || !actions.is_instance_of::<PyDict>() {
            for agent in actions.try_iter()? {
                let agent = agent?;
                if !known.contains(&agent)? {
                    let expected = "an agent of this flock";
                    let given = "an unknown agent";
                    return Err(action_error(actions.py(), &named(&agent)?, expected, given));
                }
                if !agents.contains(&agent)? {
                    let expected = "no action, because it was caught";
                    let given = "an action";
                    return Err(action_error(actions.py(), &named(&agent)?, expected, given));
                }
            }
        }
        let mut values = Vec::with_capacity(agents.len());
        for agent in agents {
            let action = match actions.cast::<PyDict>() {
                Ok(actions) => actions.get_item(&agent)?,
                Err(_) if actions.contains(&agent)? => Some(actions.get_item(&agent)?),
                Err(_) => None,
            };
            let Some(action) = action else {
                return Err(action_error(
                    actions.py(),
                    &named(&agent)?,
                    "an action",
                    "none",
                ));
            };
            values.push(match read(&action) {
                Some(value) => value,
                None => {
                    let plain = self.plain_one(&action, &named(&agent)?)?;
                    plain.extract().map_err(Into::into)?
                }
            });
        }
        Ok(values)
    }

    /// Returns the error for an action outside of the action space.
    pub(super) fn outside(&self, actions: &Bound<'_, PyAny>, place: usize, label: String) -> PyErr {
        let py = actions.py();
        let value = || {
            let array = py.import("numpy")?.call_method1("asarray", (actions,))?;
            let value = array.call_method1("item", (place,))?;
            if self.grid.is_some() {
                return Ok(value);
            }
            Ok::<_, PyErr>(value.extract::<f64>()?.into_pyobject(py)?.into_any())
        };
        let expected = match &self.grid {
            Some(grid) => format!("an integer from 0 to {}", grid.len() - 1),
            None => {
                let (low, high) = self.bounds();
                format!(
                    "a number from {low:?} to {high:?} (gymnasium.wrappers.ClipAction clips it)"
                )
            }
        };
        match value() {
            Ok(value) => action_error(py, &label, &expected, value),
            Err(error) => error,
        }
    }

    /// Returns the map from actions in [-1, 1] to ranges.
    pub(super) fn normalized(&self) -> NormalizedRange {
        NormalizedRange {
            min_range: self.min_range,
            max_range: self.max_range,
        }
    }

    /// Returns the bounds of the action space.
    fn bounds(&self) -> (f64, f64) {
        if self.is_normalized {
            (-1.0, 1.0)
        } else {
            (self.min_range, self.max_range)
        }
    }

    /// Returns the range of a continuous action, or NaN if it is outside of the action space.
    pub(super) fn of_number(&self, value: f64) -> f64 {
        let (low, high) = self.bounds();
        // The bounds of the space are float32. They must be accepted even if they are outside of
        // the float64 bounds.
        let (least, most) = (f64::from(low as f32), f64::from(high as f32));
        if !(low.min(least)..=high.max(most)).contains(&value) {
            return f64::NAN;
        }
        let value = value.clamp(low, high);
        if self.is_normalized {
            self.normalized().of(value)
        } else {
            value
        }
    }
}

/// Returns the range of a discrete action, or NaN if it is outside of the action space.
pub(super) fn entry(grid: &[f64], index: i64) -> f64 {
    let range = usize::try_from(index).ok().and_then(|at| grid.get(at));
    range.copied().unwrap_or(f64::NAN)
}

/// Returns the number in an array of shape (1,), if it can be read directly.
pub(super) fn number(action: &Bound<'_, PyAny>) -> Option<f64> {
    fn only<T: Element + Into<f64>>(array: &Bound<'_, PyArray1<T>>) -> Option<f64> {
        let is_one = array.len() == 1 && array.is_aligned();
        is_one.then(|| array.get_owned(0).map(T::into))?
    }
    match action.cast::<PyArray1<f32>>() {
        Ok(array) => only(array),
        Err(_) => only(action.cast::<PyArray1<f64>>().ok()?),
    }
}

/// Returns an integer, if the action is one and not a bool.
pub(super) fn index(action: &Bound<'_, PyAny>) -> Option<i64> {
    (!action.is_instance_of::<PyBool>()).then(|| action.extract().ok())?
}
