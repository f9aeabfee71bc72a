//! Numpy arrays in and out, with shapes checked before any work starts.

use numpy::{
    Element, IntoPyArray, PyArray, PyArray1, PyArrayMethods, PyReadonlyArrayDyn,
    PyUntypedArrayMethods, ndarray::Dimension,
};
use pyo3::prelude::*;

use crate::errors::CoreError;

/// A flat copy of an optional array; the core checks its length.
pub(crate) fn flat(array: Option<PyReadonlyArrayDyn<'_, f64>>) -> PyResult<Option<Vec<f64>>> {
    array.map(|array| vector(&array)).transpose()
}

/// A flat copy of an array; a copy, because Python may write to it while we are detached.
pub(crate) fn vector(array: &PyReadonlyArrayDyn<'_, f64>) -> PyResult<Vec<f64>> {
    Ok(array.as_slice()?.to_vec())
}

/// Writes `values` over the entries of an array, in order.
pub(crate) fn overwrite<T: Element + Copy, D: Dimension>(
    array: &Bound<'_, PyArray<T, D>>,
    values: &[T],
) -> PyResult<()> {
    let mut array = array.try_readwrite()?;
    let entries = array.as_slice_mut()?;
    if entries.len() != values.len() {
        let expected = format!("{} entries", values.len());
        let error = flockesc_core::Error::argument("out", expected, entries.len());
        return Err(CoreError::from(error).into());
    }
    entries.copy_from_slice(values);
    Ok(())
}

/// A flat array of shape `shape`, without a copy.
pub(crate) fn shaped<'py, T: numpy::Element, const K: usize>(
    py: Python<'py>,
    values: Vec<T>,
    shape: [usize; K],
) -> PyResult<Bound<'py, PyAny>>
where
    [usize; K]: numpy::ndarray::IntoDimension,
{
    Ok(values.into_pyarray(py).reshape(shape)?.into_any())
}

/// Rows and columns of a two-dimensional array.
pub(crate) fn rows_and_columns(array: &PyReadonlyArrayDyn<'_, f64>) -> PyResult<(usize, usize)> {
    match *array.shape() {
        [rows, columns] => Ok((rows, columns)),
        _ => Err(CoreError::from(flockesc_core::Error::argument(
            "interaction_range",
            "2 dimensions",
            array.ndim(),
        ))
        .into()),
    }
}

/// One-dimensional array of one field of every item.
pub(crate) fn column<'py, S, T: numpy::Element>(
    py: Python<'py>,
    items: &[S],
    field: impl Fn(&S) -> T,
) -> Bound<'py, PyArray1<T>> {
    items.iter().map(field).collect::<Vec<T>>().into_pyarray(py)
}

/// Array of shape `shape` of one field of every cell, row after row.
pub(crate) fn grid<'py, S, T: numpy::Element>(
    py: Python<'py>,
    cells: &[S],
    shape: [usize; 2],
    field: impl Fn(&S) -> T,
) -> PyResult<Bound<'py, PyAny>> {
    shaped(py, cells.iter().map(field).collect(), shape)
}
