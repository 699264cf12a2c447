//! Whole jobs, from detections or a file to something judged: the front door of the library.
//!
//! Each of the program's commands is one of these with flags before it and words behind it, and the
//! Python package calls the same.

mod diagnose;
mod error;
mod evaluate;
#[cfg(feature = "reports")]
pub mod provenance;
mod sample;
mod saved;
#[cfg(feature = "reports")]
mod sweep;
#[cfg(feature = "reports")]
mod timing;

#[cfg(feature = "reports")]
pub use diagnose::read_labels;
pub use diagnose::{diagnose, whole};
pub use error::JobError;
pub use evaluate::evaluate;
pub use sample::{Sampled, sample};
#[cfg(feature = "reports")]
pub use sweep::{Begun, SweepEnd, SweepJob, write_tables};
#[cfg(feature = "reports")]
pub use timing::{read_timings, write_timings};

use std::sync::atomic::{AtomicBool, Ordering};

use crate::run::Looks;

/// What a job that is watched tells, and whether it is to go on.
#[derive(Clone, Copy)]
pub struct Watch<'a> {
    /// Hears what is being computed.
    pub stage: &'a dyn Fn(&str),
    /// Hears what chains that run until they have converged came to, each time that they are
    /// looked at.
    pub looks: Looks<'a>,
    /// Ends the job once it is set.
    pub stop: &'a AtomicBool,
}

impl Watch<'_> {
    /// Of a job that nobody watches and nobody stops.
    pub const NOBODY: Watch<'static> = {
        static NEVER: AtomicBool = AtomicBool::new(false);
        Watch {
            stage: &|_| (),
            looks: &|_, _| (),
            stop: &NEVER,
        }
    };
}

/// What ends a job that keeps what it has finished.
#[derive(Clone, Copy)]
pub struct Interrupt<'a> {
    /// Ends it once it is set.
    pub flag: &'a AtomicBool,
    /// By what it was set, for the record of the run.
    pub by: &'a dyn Fn() -> String,
}

impl Interrupt<'_> {
    /// Whether it is set.
    pub fn came(&self) -> bool {
        self.flag.load(Ordering::Relaxed)
    }

    /// How the job ended, if it is set.
    pub fn words(&self) -> String {
        format!("stopped by {}", (self.by)())
    }
}
