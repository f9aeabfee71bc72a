//! `flockesc_env._core`: the Python bindings of `flockesc-core`.

mod actions;
mod arrays;
mod batch;
mod errors;
mod flock;
mod graph;
mod info;
mod line;
mod long_call;
mod models;
mod rollout;

use pyo3::prelude::*;

#[pymodule]
mod _core {
    use numpy::{IntoPyArray, PyArrayMethods};
    use pyo3::prelude::*;
    use pyo3::types::IntoPyDict;

    #[pymodule_export]
    use crate::actions::{RangeMap, clipped};
    #[pymodule_export]
    use crate::batch::FlockBatch;
    #[pymodule_export]
    use crate::flock::Flock;
    #[pymodule_export]
    use crate::graph::{component_labels, line_matrix, neighbor_pairs};
    #[pymodule_export]
    use crate::line::LineEpisode;
    #[pymodule_export]
    use crate::models::{
        check_flock_scenario, check_line_scenario, check_memory, drawn_flock_scenario,
        episode_seed, kinds, line_observation_entries, observation_entries,
        predator_observation_entries, simulate_line, sweep,
    };
    #[pymodule_export]
    use crate::rollout::{log1p, network_outputs, rollout_line, tanh_layers};

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        load_numpy(module.py())?;
        let forked = wrap_pyfunction!(crate::long_call::forked, module)?;
        let when = [("after_in_child", forked)].into_py_dict(module.py())?;
        let os = module.py().import("os")?;
        if os.hasattr("register_at_fork")? {
            os.call_method("register_at_fork", (), Some(&when))?;
        }
        module.add("__version__", env!("CARGO_PKG_VERSION"))
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
}
