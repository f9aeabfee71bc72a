//! Metrics as `info`: plain numbers of one flock, or a column over many.

use flockesc_core::Metrics;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::arrays::column;

/// What was measured, an entry per flock; components where they were counted.
pub(crate) struct Measured {
    pub(crate) metrics: Vec<Metrics>,
    pub(crate) components: Option<Vec<usize>>,
}

type Field<'py> = (&'py Bound<'py, PyString>, fn(&Metrics) -> f64);

/// Name and value of every metric.
fn fields(py: Python<'_>) -> [Field<'_>; 5] {
    [
        (intern!(py, "mean_distance"), |m| m.mean_distance),
        (intern!(py, "min_distance"), |m| m.min_distance),
        (intern!(py, "min_mean_distance"), |m| m.min_mean_distance),
        (intern!(py, "min_min_distance"), |m| m.min_min_distance),
        (intern!(py, "polarization"), |m| m.polarization),
    ]
}

/// Numbers of the first flock.
pub(crate) fn numbers<'py>(py: Python<'py>, measured: &Measured) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (name, value) in fields(py) {
        dict.set_item(name, measured.metrics.first().map(value))?;
    }
    if let Some(components) = &measured.components {
        dict.set_item(intern!(py, "num_components"), components.first())?;
    }
    Ok(dict)
}

/// A column of every number.
pub(crate) fn columns<'py>(py: Python<'py>, measured: &Measured) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (name, value) in fields(py) {
        dict.set_item(name, column(py, &measured.metrics, value))?;
    }
    if let Some(components) = &measured.components {
        let counts = column(py, components, |count| *count as i64);
        dict.set_item(intern!(py, "num_components"), counts)?;
    }
    Ok(dict)
}
