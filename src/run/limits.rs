//! What a chain may take, and the ways in which it can fail.
//!
//! Limits decide no more than whether a chain ends, so they are no settings and name nothing: a chain
//! that ended under one limit is the chain that ends under any other. One that did not is a row that
//! says which limit it met, and is run again when it is given more.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::model::Model;
use crate::sampler::SamplerSettings;

/// What one chain may take.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Wall-clock seconds of sampling.
    pub max_seconds: Option<f64>,
    /// Bytes that its thread may hold beyond what it held before.
    pub max_bytes: Option<u64>,
    /// Bytes that this thread holds now. A program that does not count gives 0, and only the draws, whose
    /// size is known beforehand, are held to `max_bytes`.
    pub bytes_held: fn() -> u64,
}

impl Default for Limits {
    /// None.
    fn default() -> Self {
        Self {
            max_seconds: None,
            max_bytes: None,
            bytes_held: || 0,
        }
    }
}

/// Why a chain has no result.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FailureKind {
    /// Its data, model or start cannot be had.
    Data,
    /// A bug of ours.
    Panic,
    /// ln target is not finite.
    Numerical,
    /// It took longer than this.
    TimeLimit {
        /// The limit, s.
        seconds: f64,
    },
    /// It took more memory than this.
    MemoryLimit {
        /// The limit.
        bytes: u64,
    },
}

impl FailureKind {
    /// Whether a chain that failed so may end under these limits. What fails for another reason fails
    /// again: a chain is a function of its key.
    pub fn may_end_under(&self, limits: &Limits) -> bool {
        match *self {
            Self::TimeLimit { seconds } => limits.max_seconds.is_none_or(|most| most > seconds),
            Self::MemoryLimit { bytes } => limits.max_bytes.is_none_or(|most| most > bytes),
            Self::Data | Self::Panic | Self::Numerical => false,
        }
    }

    /// In words, with the limit and never with what was measured: a table is the same bytes whenever
    /// and wherever the limit is met.
    pub fn reason(&self, what: &str) -> String {
        match *self {
            Self::Data => what.to_owned(),
            Self::Panic => format!("panic: {what}"),
            Self::Numerical => format!("numerical failure: {what}"),
            Self::TimeLimit { seconds } => {
                format!(
                    "time limit: not done after {seconds} s; raise --max-seconds or lower samples"
                )
            }
            Self::MemoryLimit { bytes } => format!(
                "memory limit: needs more than {} MB; raise --max-memory or lower importance_samples or \
                 max_topologies",
                bytes as f64 / 1e6
            ),
        }
    }
}

/// Holds a chain to its limits while it runs: over one stretch, or over several on any threads.
pub(super) struct Watch {
    limits: Limits,
    started: Instant,
    /// Seconds of sampling before this stretch.
    pub seconds_before: f64,
    /// Bytes that this thread held when the stretch began.
    bytes_before: u64,
    /// Bytes that the chain came to hold in the stretches before.
    bytes_earlier: u64,
    /// The limit that was met.
    pub met: Option<FailureKind>,
}

impl Watch {
    /// Of a chain before its first stretch.
    pub fn new(limits: Limits) -> Self {
        Self {
            limits,
            started: Instant::now(),
            seconds_before: 0.0,
            bytes_before: (limits.bytes_held)(),
            bytes_earlier: 0,
            met: None,
        }
    }

    /// A stretch begins on this thread.
    pub fn begin(&mut self) {
        self.started = Instant::now();
        self.bytes_before = (self.limits.bytes_held)();
    }

    /// The stretch is over.
    pub fn end(&mut self) {
        self.seconds_before = self.seconds();
        self.started = Instant::now();
        self.bytes_earlier += self.bytes_more();
        self.bytes_before = (self.limits.bytes_held)();
    }

    fn bytes_more(&self) -> u64 {
        (self.limits.bytes_held)().saturating_sub(self.bytes_before)
    }

    /// Seconds of sampling so far.
    pub fn seconds(&self) -> f64 {
        self.seconds_before + self.started.elapsed().as_secs_f64()
    }
}

impl Watch {
    /// Whether its time is over.
    pub fn is_out_of_time(&self) -> bool {
        let most = self.limits.max_seconds;
        most.is_some_and(|most| self.seconds() >= most)
    }

    /// Whether a limit is met.
    pub fn wants_stop(&mut self) -> bool {
        if let Some(seconds) = self.limits.max_seconds
            && self.is_out_of_time()
        {
            self.met = Some(FailureKind::TimeLimit { seconds });
        }
        if let Some(bytes) = self.limits.max_bytes
            && self.bytes_earlier + self.bytes_more() > bytes
        {
            self.met = Some(FailureKind::MemoryLimit { bytes });
        }
        self.met.is_some()
    }
}

/// Bytes of the draws, which a chain has from its first step to its last: normals and locations, N×R×2
/// numbers each, and in the covariance model the weights. Asking for more than there is ends the
/// process and not the chain, so this is looked at before.
pub(super) fn bytes_of_draws(model: &Model, sampler: &SamplerSettings) -> u64 {
    if !sampler.estimator.draws_locations() {
        return 0;
    }
    let n_values = model.n_detections() as u64 * sampler.importance_samples as u64;
    let numbers = match model {
        Model::Metric(_) => 4,
        Model::Covariance(_) => 5,
    };
    n_values.saturating_mul(8 * numbers)
}
