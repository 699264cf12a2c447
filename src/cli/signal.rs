//! Ctrl-C and SIGTERM: a flag that the run looks at, so that it ends with everything kept.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::time::Duration;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use super::Failure;
use crate::job::Interrupt;

/// How long a run has to end by itself once it is told to. Chains look at the flag every few
/// milliseconds; what does not, as the drawing of a large report, can be made again.
const GRACE: Duration = Duration::from_millis(1500);

/// Whether the user wants the run to stop, and by which signal.
pub struct StopSignal {
    /// Raised by either signal.
    pub flag: Arc<AtomicBool>,
    number: Arc<AtomicI32>,
}

impl StopSignal {
    /// Listens from now on. After a signal, the process ends by itself, or after a moment of grace, or at
    /// once when a second one comes: all that is finished is on disk, and every file is whole.
    /// What is said when the grace is over is `last_words`, if any.
    pub fn listen(last_words: Option<&'static str>) -> Result<Self, Failure> {
        let failed = |error: std::io::Error| {
            Failure::usage(format!(
                "signals cannot be listened to ({error}); check the system's limits"
            ))
        };
        let flag = Arc::new(AtomicBool::new(false));
        let number = Arc::new(AtomicI32::new(0));
        for signal in [SIGINT, SIGTERM] {
            signal_hook::flag::register_conditional_shutdown(
                signal,
                128 + signal,
                Arc::clone(&flag),
            )
            .map_err(failed)?;
        }
        let mut signals = Signals::new([SIGINT, SIGTERM]).map_err(failed)?;
        let (raised, by) = (Arc::clone(&flag), Arc::clone(&number));
        let watch = move || {
            if let Some(signal) = signals.forever().next() {
                by.store(signal, Ordering::Relaxed);
                raised.store(true, Ordering::Relaxed);
                std::thread::sleep(GRACE);
                if let Some(words) = last_words {
                    errln!("{words}");
                }
                std::process::exit(128 + signal);
            }
        };
        std::thread::Builder::new().spawn(watch).map_err(failed)?;
        Ok(Self { flag, number })
    }

    /// As what ends a job; `by` is [`words`](Self::words).
    pub fn interrupt<'a>(&'a self, by: &'a dyn Fn() -> String) -> Interrupt<'a> {
        let flag = &self.flag;
        Interrupt { flag, by }
    }

    /// The signal that came, in words.
    pub fn words(&self) -> String {
        format!("signal {}", self.number.load(Ordering::Relaxed))
    }

    /// The signal that came, if one did.
    pub fn received(&self) -> Option<i32> {
        let number = self.number.load(Ordering::Relaxed);
        self.flag.load(Ordering::Relaxed).then_some(number)
    }
}
