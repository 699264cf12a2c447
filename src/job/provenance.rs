//! Who runs: version, commit, machine. For `run.json`, and never for a table.

use std::time::{SystemTime, UNIX_EPOCH};

use crate::model::penalty::cpu_path;
use crate::run::{Limits, RunResult, Shard, Start};

use super::Interrupt;

/// The commit that a release build was made from, with a `+` if files were changed since.
pub const COMMIT: Option<&str> = option_env!("PTM_COMMIT");

/// A start that happens now.
pub fn start_now(limits: &Limits, shard: Option<Shard>) -> Start {
    Start {
        started_unix_s: unix_s(),
        shard: shard.map(|shard| shard.to_string()),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        commit: COMMIT.map(str::to_owned),
        host: host(),
        cpu: cpu(),
        cpu_features: cpu_features(),
        cpu_path: cpu_path().to_owned(),
        threads: rayon::current_num_threads(),
        max_seconds: limits.max_seconds,
        max_bytes: limits.max_bytes,
        ..Start::default()
    }
}

/// The same start, at its end.
pub fn ended(start: &mut Start, interrupt: Interrupt<'_>, result: &RunResult) {
    start.ended_unix_s = Some(unix_s());
    let end = if interrupt.came() {
        interrupt.words()
    } else {
        "done".to_owned()
    };
    start.end = Some(end);
    start.chains_run = result.seconds.iter().flatten().count();
}

fn unix_s() -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    now.map_or(0, |since| since.as_secs())
}

fn host() -> String {
    let kernel = std::fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let name = kernel.or_else(|| std::env::var("HOSTNAME").ok());
    name.map_or_else(|| "unknown".to_owned(), |name| name.trim().to_owned())
}

fn cpu() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let name = name.map_or(std::env::consts::ARCH, |(_, name)| name.trim());
    name.to_owned()
}

#[cfg(target_arch = "x86_64")]
fn cpu_features() -> Vec<String> {
    let has = [
        ("sse4.2", is_x86_feature_detected!("sse4.2")),
        ("avx2", is_x86_feature_detected!("avx2")),
        ("fma", is_x86_feature_detected!("fma")),
        ("avx512f", is_x86_feature_detected!("avx512f")),
        ("avx512dq", is_x86_feature_detected!("avx512dq")),
        ("avx512vl", is_x86_feature_detected!("avx512vl")),
    ];
    let has = has.into_iter().filter(|(_, has)| *has);
    has.map(|(name, _)| name.to_owned()).collect()
}

#[cfg(not(target_arch = "x86_64"))]
fn cpu_features() -> Vec<String> {
    Vec::new()
}
