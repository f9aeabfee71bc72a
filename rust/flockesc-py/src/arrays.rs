//! Conversion between NumPy arrays and vectors, with checks of shapes.

use numpy::ndarray::Dimension;
use numpy::{Element, IntoPyArray, PyArray, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::errors::CoreError;

/// An array, or another object.
pub(crate) type Object<'py> = PyResult<Bound<'py, PyAny>>;
pub(crate) type Dict<'py> = PyResult<Bound<'py, PyDict>>;
pub(crate) type Tuple<'py> = PyResult<Bound<'py, PyTuple>>;

/// Returns a flat copy of an optional array. The core checks its length.
pub(crate) fn flat(array: Option<PyReadonlyArrayDyn<'_, f64>>) -> PyResult<Option<Vec<f64>>> {
    array.map(|array| vector(&array)).transpose()
}

/// Returns a flat copy of an array. A view is not safe, because other threads may write to the array during a
/// call.
pub(crate) fn vector(array: &PyReadonlyArrayDyn<'_, f64>) -> PyResult<Vec<f64>> {
    Ok(array.as_slice()?.to_vec())
}

/// Overwrites the entries of an array with `values`, in order.
pub(crate) fn overwrite<T: Element + Copy, D: Dimension>(
    array: &Bound<'_, PyArray<T, D>>,
    values: &[T],
) -> PyResult<()> {
    let mut array = array.try_readwrite()?;
    let entries = array.as_slice_mut()?;
    if entries.len() != values.len() {
        let expected = format!("{} entries", values.len());
        let given = format!("{} entries", entries.len());
        let error = flockesc_core::Error::input("out", expected, given);
        return Err(CoreError::from(error).into());
    }
    entries.copy_from_slice(values);
    Ok(())
}

/// Converts a flat vector into an array of this shape, without a copy.
pub(crate) fn shaped<'py, T: numpy::Element, const K: usize>(
    py: Python<'py>,
    values: Vec<T>,
    shape: [usize; K],
) -> Object<'py>
where
    [usize; K]: numpy::ndarray::IntoDimension,
{
    Ok(values.into_pyarray(py).reshape(shape)?.into_any())
}

/// Collects one field of all items into a one-dimensional array.
pub(crate) fn column<'py, S, T: numpy::Element>(
    py: Python<'py>,
    items: &[S],
    field: impl Fn(&S) -> T,
) -> Bound<'py, PyAny> {
    array(py, items.iter().map(field).collect())
}

/// Collects one field of all cells, in row-major order, into a two-dimensional array.
pub(crate) fn grid<'py, S, T: numpy::Element>(
    py: Python<'py>,
    cells: &[S],
    shape: [usize; 2],
    field: impl Fn(&S) -> T,
) -> Object<'py> {
    shaped(py, cells.iter().map(field).collect(), shape)
}

/// Converts a vector into a one-dimensional array, without a copy.
pub(crate) fn array<T: numpy::Element>(py: Python<'_>, values: Vec<T>) -> Bound<'_, PyAny> {
    values.into_pyarray(py).into_any()
}
