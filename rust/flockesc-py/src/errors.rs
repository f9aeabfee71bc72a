//! Core errors as the exceptions of `flockesc_env.errors`.

use flockesc_core::Error;
use pyo3::PyClass;
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::False;

/// Lets `?` turn a core error into a Python exception.
pub(crate) struct CoreError(Error);

impl From<Error> for CoreError {
    fn from(error: Error) -> Self {
        Self(error)
    }
}

impl From<CoreError> for PyErr {
    fn from(CoreError(error): CoreError) -> Self {
        let (class, field, expected, given) = match error {
            Error::Config {
                field,
                expected,
                given,
            } => ("ScenarioError", field, expected, given),
            Error::Argument {
                field,
                expected,
                given,
            } => ("ArgumentError", field, expected, given),
            Error::Episode {
                field,
                expected,
                given,
            } => ("EpisodeError", field, expected, given),
            Error::Interrupted => return PyKeyboardInterrupt::new_err(()),
        };
        Python::attach(|py| {
            let raised = py
                .import("flockesc_env.common.errors")
                .and_then(|module| module.getattr(class))
                .and_then(|class| class.call1((field, expected, given)));
            match raised {
                Ok(exception) => PyErr::from_value(exception),
                Err(error) => error,
            }
        })
    }
}

/// What a worker that died leaves; a bug in the core, told as an ordinary exception.
pub(crate) fn worker_died() -> PyErr {
    PyRuntimeError::new_err("a worker thread of flockesc_env died; please report this")
}

/// What a child process gets that was forked by a callback or a signal handler, and returns from it.
pub(crate) fn forked_within() -> PyErr {
    PyRuntimeError::new_err("only the parent process can finish a call during which it was forked")
}

/// The object behind a method that changes it, and nobody else's until that returns.
///
/// # Errors
/// [`Error::Episode`] if another call is using it.
pub(crate) fn sole<'py, T: PyClass<Frozen = False>>(
    object: &Bound<'py, T>,
) -> Result<PyRefMut<'py, T>, CoreError> {
    object.try_borrow_mut().map_err(|_| busy())
}

/// The object behind a method that only looks at it.
///
/// # Errors
/// [`Error::Episode`] if another call is changing it.
pub(crate) fn shared<'py, T: PyClass>(object: &Bound<'py, T>) -> Result<PyRef<'py, T>, CoreError> {
    object.try_borrow().map_err(|_| busy())
}

/// What a thread gets that uses an environment during another thread's call.
fn busy() -> CoreError {
    CoreError(Error::Episode {
        field: "environment".into(),
        expected: "one call at a time".into(),
        given: "a call during another one, of another thread or inside of a signal handler".into(),
    })
}
