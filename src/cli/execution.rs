//! What a run may take, and which part of a sweep it is.

use std::time::Duration;

use crate::run::{Limits, RunOptions, Shard};
use clap::Args;

use super::numbers::{count, positive};
use super::{Failure, counting, memory, shards};

/// Flags of whatever runs chains of a sweep.
#[derive(Debug, Args)]
pub struct Execution {
    /// End a chain that samples for longer, as a row that failed [default: no limit].
    #[arg(long, value_name = "S", value_parser = positive, allow_negative_numbers = true)]
    max_seconds: Option<f64>,
    /// End a chain that needs more megabytes, as a row that failed [default: what the machine or
    /// its control group allows].
    #[arg(long, value_name = "MB", value_parser = positive, allow_negative_numbers = true)]
    max_memory: Option<f64>,
    /// Time between two checkpoints of a chain that is running.
    #[arg(long, value_name = "S", value_parser = positive, allow_negative_numbers = true, default_value_t = 5.0)]
    checkpoint_seconds: f64,
    /// Run chains again that failed, whatever the reason.
    #[arg(long)]
    retry_failed: bool,
    /// Run one of N parts of the sweep, as in 3/8; `ptm merge` puts the parts together.
    #[arg(long, value_name = "K/N")]
    shard: Option<Shard>,
    /// The number of parts, where Slurm, Kubernetes or HyperQueue says which one this is.
    #[arg(long, value_name = "N", conflicts_with = "shard", value_parser = count::<u64>(1, u64::MAX))]
    shards: Option<u64>,
}

impl Execution {
    /// Checked, with what the environment says.
    pub fn options(&self) -> Result<RunOptions, Failure> {
        let variable = |name: &str| std::env::var(name).ok();
        Ok(RunOptions {
            shard: shards::shard(self.shard, self.shards, variable)?,
            ..self.of_all()
        })
    }

    /// As [`options`](Self::options), of all parts together.
    pub fn of_all(&self) -> RunOptions {
        let max_bytes = self.max_memory.map(|megabytes| (megabytes * 1e6) as u64);
        RunOptions {
            limits: Limits {
                max_seconds: self.max_seconds,
                max_bytes: max_bytes.or_else(memory::bytes),
                bytes_held: counting::bytes_held,
            },
            retry_failed: self.retry_failed,
            shard: None,
            checkpoints: None,
        }
    }

    /// Time between two checkpoints of a chain.
    pub fn checkpoint_interval(&self) -> Duration {
        Duration::try_from_secs_f64(self.checkpoint_seconds).unwrap_or(Duration::MAX)
    }
}
