//! A straightforward implementation of the flock model: `f64`, scalar, one thread. `speed/` compares
//! flockesc-core with it. It shares no code with flockesc-core.

mod cells;
mod flock;

use numpy::{PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::cells::CellList;
use crate::flock::{Flock, Model, Point};

/// Final positions, shape (n, 2), and J_mean in m.
type Outcome<'py> = PyResult<(Bound<'py, PyArray2<f64>>, f64)>;

#[pyfunction]
fn flock_cells<'py>(
    py: Python<'py>,
    model: Model,
    positions: PyReadonlyArray2<'_, f64>,
    velocities: PyReadonlyArray2<'_, f64>,
    range: f64,
    steps: usize,
) -> Outcome<'py> {
    let mut flock = Flock::new(model, points(&positions), points(&velocities));
    let mut cells = CellList::default();
    let minimum = flock.run(steps, |positions, velocities, sums| {
        cells.sum_neighbors(positions, velocities, range, sums);
    });
    outcome(py, &flock, minimum)
}

fn points(array: &PyReadonlyArray2<'_, f64>) -> Vec<Point> {
    let array = array.as_array();
    let rows = array.rows().into_iter();
    rows.map(|row| [row[0], row[1]]).collect()
}

fn outcome<'py>(py: Python<'py>, flock: &Flock, minimum: f64) -> Outcome<'py> {
    let rows: Vec<Vec<f64>> = flock.positions.iter().map(|p| p.to_vec()).collect();
    Ok((PyArray2::from_vec2(py, &rows)?, minimum))
}

#[pymodule]
fn flockesc_peers(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(flock_cells, module)?)
}
