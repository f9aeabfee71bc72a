//! Conversion of core errors into the exceptions of `flockesc_env.common.errors`.

use std::str::FromStr;

use flockesc_core::Error;
use flockesc_core::bindings::VariantNames;
use pyo3::PyClass;
use pyo3::call::PyCallArgs;
use pyo3::exceptions::{PyKeyboardInterrupt, PyMemoryError};
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::False;

/// A core error or a Python exception, so that `?` converts both.
pub(crate) enum CoreError {
    Core(Error),
    Python(PyErr),
}

impl From<Error> for CoreError {
    fn from(error: Error) -> Self {
        Self::Core(error)
    }
}

impl From<PyErr> for CoreError {
    fn from(error: PyErr) -> Self {
        Self::Python(error)
    }
}

impl From<CoreError> for PyErr {
    fn from(error: CoreError) -> Self {
        match error {
            CoreError::Core(Error::Input {
                field,
                expected,
                given,
            }) => raised("InputError", (field, expected, given)),
            CoreError::Core(Error::Episode { message }) => raised("ResetNeededError", (message,)),
            CoreError::Core(error @ Error::Rounding) => {
                raised("FlockescError", (error.to_string(),))
            }
            CoreError::Core(error @ Error::Memory { .. }) => {
                PyMemoryError::new_err(error.to_string())
            }
            CoreError::Core(Error::Interrupted) => PyKeyboardInterrupt::new_err(()),
            CoreError::Python(error) => error,
        }
    }
}

/// Creates an exception of `flockesc_env.common.errors`.
fn raised<A: for<'py> PyCallArgs<'py>>(class: &str, arguments: A) -> PyErr {
    Python::attach(|py| {
        let raised = py
            .import("flockesc_env.common.errors")
            .and_then(|module| module.getattr(class))
            .and_then(|class| class.call1(arguments));
        match raised {
            Ok(exception) => PyErr::from_value(exception),
            Err(error) => error,
        }
    })
}

/// Returns the variant with this name.
pub(crate) fn named<T: FromStr + VariantNames>(field: &str, name: &str) -> Result<T, CoreError> {
    let expected = || format!("one of {}", T::VARIANTS.join(", "));
    T::from_str(name).map_err(|_| Error::input(field, expected(), name).into())
}

/// Borrows the object behind a method that changes it.
///
/// # Errors
/// `FlockescError` if another call is using it.
pub(crate) fn try_borrow_mut<'py, T: PyClass<Frozen = False>>(
    object: &Bound<'py, T>,
) -> Result<PyRefMut<'py, T>, CoreError> {
    object.try_borrow_mut().map_err(|_| busy())
}

/// Borrows the object behind a method that only reads it.
///
/// # Errors
/// `FlockescError` if another call is changing it.
pub(crate) fn try_borrow<'py, T: PyClass>(
    object: &Bound<'py, T>,
) -> Result<PyRef<'py, T>, CoreError> {
    object.try_borrow().map_err(|_| busy())
}

/// Creates the exception for a call during another call of the same object, in another thread or a
/// signal handler.
fn busy() -> CoreError {
    let message = "environment or flock is in use by another call; use one per thread";
    raised("FlockescError", (message,)).into()
}
