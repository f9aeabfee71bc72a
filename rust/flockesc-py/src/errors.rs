//! Core errors as the exceptions of `flockesc_env.errors`.

use flockesc_core::Error;
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError};
use pyo3::prelude::*;

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
                .import("flockesc_env.errors")
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
