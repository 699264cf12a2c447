//! `topometric._topometric`: the jobs of the library for Python.
//!
//! Arrays come in as NumPy arrays of the right type and shape, which `topometric/__init__.py` makes
//! of what a user gives. Results go out as arrays, and as dictionaries of what the program writes
//! as JSON. Errors are `topometric.Error` with the program's words. The GIL is released while
//! something is computed; Ctrl-C ends it.

mod chains;
mod detections;
mod diagnosed;
mod jobs;
mod sweeps;
mod watched;

use pyo3::prelude::*;

/// As in the program, so that the memory of a chain can be limited.
#[global_allocator]
static ALLOCATOR: topometric::cli::Counting = topometric::cli::Counting;

pyo3::create_exception!(topometric, Error, pyo3::exceptions::PyException);

/// An error in the program's words.
fn error(error: impl std::fmt::Display) -> PyErr {
    Error::new_err(error.to_string())
}

/// The program `ptm` on a command line, its own name first; returns its exit code.
#[pyfunction]
fn program(py: Python<'_>, command_line: Vec<std::ffi::OsString>) -> u8 {
    py.detach(|| topometric::cli::run(command_line.into_iter()))
}

#[pymodule]
fn _topometric(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("Error", module.py().get_type::<Error>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<detections::Detections>()?;
    module.add_class::<chains::Sampled>()?;
    module.add_class::<diagnosed::Diagnosed>()?;
    module.add_function(wrap_pyfunction!(program, module)?)?;
    module.add_function(wrap_pyfunction!(jobs::keys, module)?)?;
    module.add_function(wrap_pyfunction!(jobs::simulate, module)?)?;
    module.add_function(wrap_pyfunction!(jobs::sample, module)?)?;
    module.add_function(wrap_pyfunction!(jobs::exact, module)?)?;
    module.add_function(wrap_pyfunction!(jobs::tune, module)?)?;
    module.add_function(wrap_pyfunction!(jobs::evaluate, module)?)?;
    module.add_function(wrap_pyfunction!(diagnosed::diagnose, module)?)?;
    module.add_function(wrap_pyfunction!(diagnosed::diagnose_files, module)?)?;
    module.add_function(wrap_pyfunction!(sweeps::sweep, module)?)?;
    Ok(())
}
