//! Which chains a run makes, and why.

use super::{ChainStatus, FailureKind, Journal, RunOptions, Task};

/// Where a chain of a run stands.
#[derive(Clone, Debug, PartialEq)]
pub enum Standing {
    /// The journal has it, finished.
    Kept,
    /// The journal has it, failed, and it would fail again.
    KeptFailed(String),
    /// The journal has it, failed, and it is run again.
    FailedBefore(String),
    /// The journal does not have it.
    Missing,
}

impl Standing {
    /// Whether the run makes it.
    pub fn is_to_be_run(&self) -> bool {
        matches!(self, Self::Missing | Self::FailedBefore(_))
    }
}

/// Where a chain stands, under what a run is to be.
pub fn standing(task: &Task, journal: &Journal, options: &RunOptions) -> Standing {
    let again = |kind: &FailureKind| options.retry_failed || kind.may_end_under(&options.limits);
    match journal.get(&task.key).map(|record| &record.status) {
        None => Standing::Missing,
        Some(ChainStatus::Done(_)) => Standing::Kept,
        Some(ChainStatus::Failed { kind, reason }) if again(kind) => {
            Standing::FailedBefore(reason.clone())
        }
        Some(ChainStatus::Failed { reason, .. }) => Standing::KeptFailed(reason.clone()),
    }
}
