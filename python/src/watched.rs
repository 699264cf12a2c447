//! A job on a thread of its own, while Python's signals are looked at.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Time between two looks.
const INTERVAL: Duration = Duration::from_millis(50);

/// What `job` gives. It is handed a flag that is set when Python was interrupted (Ctrl-C) or when
/// `look`, which is called every now and then with the GIL held, fails. The error is then raised
/// once the job has ended.
pub fn watched<T: Send>(
    py: Python<'_>,
    job: impl FnOnce(&AtomicBool) -> T + Send,
    mut look: impl FnMut(Python<'_>) -> PyResult<()> + Send,
) -> PyResult<T> {
    let stop = AtomicBool::new(false);
    py.detach(|| {
        std::thread::scope(|scope| {
            let running = scope.spawn(|| job(&stop));
            let mut failed = None;
            while !running.is_finished() {
                std::thread::sleep(INTERVAL);
                if failed.is_none() {
                    let looked = Python::attach(|py| py.check_signals().and_then(|()| look(py)));
                    failed = looked.err();
                    stop.store(failed.is_some(), Ordering::Relaxed);
                }
            }
            let ended = running.join();
            if let Some(error) = failed {
                return Err(error);
            }
            ended.map_err(|panic| {
                let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
                let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
                let what = text.unwrap_or_default();
                PyRuntimeError::new_err(format!("a bug of ours, please report it: {what}"))
            })
        })
    })
}
