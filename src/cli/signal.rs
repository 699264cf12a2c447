//! Ctrl-C and SIGTERM: a flag that the run looks at, so that it ends with everything kept.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use signal_hook::consts::{SIGINT, SIGTERM};

use super::Failure;

/// Whether the user wants the run to stop, and by which signal.
pub struct StopSignal {
    /// Raised by either signal.
    pub flag: Arc<AtomicBool>,
    number: Arc<AtomicUsize>,
}

impl StopSignal {
    /// Listens from now on. A second signal of the same kind ends the process at once.
    pub fn listen() -> Result<Self, Failure> {
        let flag = Arc::new(AtomicBool::new(false));
        let number = Arc::new(AtomicUsize::new(0));
        for signal in [SIGINT, SIGTERM] {
            let failed = |error: std::io::Error| {
                Failure::usage(format!("signals cannot be listened to ({error})"))
            };
            let second = 128 + signal;
            signal_hook::flag::register_conditional_shutdown(signal, second, Arc::clone(&flag))
                .and_then(|_| {
                    signal_hook::flag::register_usize(signal, Arc::clone(&number), signal as usize)
                })
                .and_then(|_| signal_hook::flag::register(signal, Arc::clone(&flag)))
                .map_err(failed)?;
        }
        Ok(Self { flag, number })
    }

    /// The signal that came, if one did.
    pub fn received(&self) -> Option<i32> {
        let number = self.number.load(Ordering::Relaxed);
        self.flag.load(Ordering::Relaxed).then_some(number as i32)
    }
}
