//! `flockesc_env._core`: the Python bindings of `flockesc-core`.

mod actions;
mod arrays;
mod batch;
mod errors;
mod graph;
mod info;
mod layouts;
mod line;
mod long_call;
mod models;
mod rollout;

use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;

/// Marks the process as forked. Python calls it in every child process after a fork.
#[pyfunction]
fn forked() {
    flockesc_core::bindings::forked();
}

/// Loads the C API of NumPy and the borrow checker of rust-numpy.
///
/// At their first use they would be imported, and a signal during that import would be a panic.
fn load_numpy(py: Python<'_>) -> PyResult<()> {
    numpy::get_array_module(py)?;
    let array = vec![0.0].into_pyarray(py);
    array.try_readonly()?;
    Ok(())
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    load_numpy(module.py())?;
    module.add_class::<actions::RangeMap>()?;
    module.add_class::<batch::FlockBatch>()?;
    module.add_class::<line::LineEpisode>()?;
    module.add_function(wrap_pyfunction!(models::check_flock_scenario, module)?)?;
    module.add_function(wrap_pyfunction!(models::check_line_scenario, module)?)?;
    module.add_function(wrap_pyfunction!(models::drawn_flock_scenario, module)?)?;
    module.add_function(wrap_pyfunction!(models::default_flock_scenario, module)?)?;
    module.add_function(wrap_pyfunction!(models::default_line_scenario, module)?)?;
    module.add_function(wrap_pyfunction!(models::kinds, module)?)?;
    module.add_function(wrap_pyfunction!(models::objectives, module)?)?;
    module.add_function(wrap_pyfunction!(models::check_memory, module)?)?;
    module.add_function(wrap_pyfunction!(models::check_record, module)?)?;
    module.add_function(wrap_pyfunction!(models::simulate_flock, module)?)?;
    module.add_function(wrap_pyfunction!(models::simulate_line, module)?)?;
    module.add_function(wrap_pyfunction!(models::sweep_flock, module)?)?;
    module.add_function(wrap_pyfunction!(models::sweep_line, module)?)?;
    module.add_function(wrap_pyfunction!(graph::component_labels, module)?)?;
    module.add_function(wrap_pyfunction!(graph::neighbor_pairs, module)?)?;
    module.add_function(wrap_pyfunction!(graph::laplacian, module)?)?;
    module.add_function(wrap_pyfunction!(graph::perron_matrix, module)?)?;
    module.add_function(wrap_pyfunction!(info::infos, module)?)?;
    module.add_function(wrap_pyfunction!(info::named_infos, module)?)?;
    module.add_function(wrap_pyfunction!(layouts::episode_seed, module)?)?;
    module.add_function(wrap_pyfunction!(layouts::observation_entries, module)?)?;
    module.add_function(wrap_pyfunction!(
        layouts::predator_observation_entries,
        module
    )?)?;
    module.add_function(wrap_pyfunction!(line::check_lines, module)?)?;
    module.add_function(wrap_pyfunction!(line::line_observation_entries, module)?)?;
    module.add_function(wrap_pyfunction!(rollout::network_ranges, module)?)?;
    module.add_function(wrap_pyfunction!(rollout::rollout_line, module)?)?;
    let forked = wrap_pyfunction!(forked, module)?;
    let when = [("after_in_child", forked)].into_py_dict(module.py())?;
    let os = module.py().import("os")?;
    if os.hasattr("register_at_fork")? {
        os.call_method("register_at_fork", (), Some(&when))?;
    }
    module.add("MAX_PARTS", flockesc_core::MAX_PARTS)?;
    if os.hasattr("sysconf")? {
        let value =
            |name: &str| -> PyResult<u64> { os.call_method1("sysconf", (name,))?.extract() };
        if let (Ok(pages), Ok(size)) = (value("SC_PHYS_PAGES"), value("SC_PAGE_SIZE")) {
            flockesc_core::bindings::memory::set_machine(pages.saturating_mul(size));
        }
    }
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}
