//! Wall-clock seconds of chains: kept from run to run of a folder, since a resume runs only what is missing.

use std::collections::HashMap;
use std::path::Path;

use crate::files::read_text_at_most;
use crate::run::{Plan, RunFolder, RunResult};
use crate::table;

use super::JobError;

const NAME: &str = "timings";
/// More bytes than the times of any sweep take.
const MAX_BYTES: u64 = 1_000_000_000;

/// Seconds by the key of the chain, as earlier runs left them; empty if there are none or the file is not
/// ours, as times are worth no failure.
pub fn read_timings(folder: &Path) -> HashMap<String, f64> {
    let Ok(text) = read_text_at_most(&folder.join(format!("{NAME}.csv")), MAX_BYTES) else {
        return HashMap::new();
    };
    let row = |line: &str| {
        let (key, seconds) = line.split_once(',')?;
        Some((key.to_owned(), seconds.parse().ok()?))
    };
    text.lines().skip(1).filter_map(row).collect()
}

/// Writes the times of all chains of the plan that are known: those run now and those run earlier.
/// # Errors
/// A folder that cannot be written.
pub fn write_timings(
    folder: &RunFolder,
    plan: &Plan,
    result: &RunResult,
) -> Result<HashMap<String, f64>, JobError> {
    let mut known = read_timings(folder.path());
    let now = plan.tasks.iter().zip(&result.seconds);
    known.extend(now.filter_map(|(task, seconds)| Some((task.key.clone(), (*seconds)?))));
    if result.seconds.iter().any(Option::is_some) {
        let mut keys: Vec<String> = plan.tasks.iter().map(|task| task.key.clone()).collect();
        let mut seen = std::collections::HashSet::new();
        keys.retain(|key| seen.insert(key.clone()));
        let seconds: Vec<Option<f64>> = keys.iter().map(|key| known.get(key).copied()).collect();
        table::timings_table(&keys, &seconds).write(folder.path(), NAME)?;
    }
    Ok(known)
}
