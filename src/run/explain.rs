//! Why each chain of a sweep would run: what is new, what was changed since the folder's last run.

use std::collections::BTreeMap;

use super::{Journal, Owner, Plan, RunOptions, Standing, Task, standing};
use crate::settings::Settings;
use crate::sweep::{Stopping, Sweep, decides_the_world};

/// Above so many pairs of cells, changes are not looked for.
const MAX_PAIRS: usize = 20_000_000;

/// The run that a folder holds, to compare with.
pub struct Earlier<'a> {
    /// Its sweep.
    pub sweep: &'a Sweep,
    /// Its chains.
    pub plan: &'a Plan,
    /// Semantics of worlds and chains that it was run with.
    pub semantics: &'a [String; 2],
}

/// Reasons, with the number of chains each is true of: those that are kept first.
pub type Reasons = BTreeMap<String, usize>;

/// Why chains would run or not.
pub struct Explained {
    /// Of each cell.
    pub of_cells: Vec<Reasons>,
    /// Of all posteriors that cells ask the reference sampler for.
    pub of_posteriors: Reasons,
}

/// The reasons of all chains of a plan.
pub fn explain(
    sweep: &Sweep,
    plan: &Plan,
    journal: &Journal,
    options: &RunOptions,
    earlier: Option<&Earlier<'_>>,
    semantics: &[String; 2],
) -> Explained {
    let mut explained = Explained {
        of_cells: vec![Reasons::new(); sweep.cells.len()],
        of_posteriors: Reasons::new(),
    };
    let mut nearest: Vec<Option<Option<usize>>> = vec![None; sweep.cells.len()];
    let in_reach = |earlier: &&Earlier<'_>| {
        earlier.sweep.cells.len().saturating_mul(sweep.cells.len()) <= MAX_PAIRS
    };
    for task in &plan.tasks {
        let reason = match standing(task, journal, options) {
            Standing::Kept => "kept".to_owned(),
            Standing::KeptFailed(reason) => format!("kept, failed: {reason}"),
            Standing::FailedBefore(reason) => format!("run: failed before: {reason}"),
            Standing::Missing => match (task.owner, earlier.filter(in_reach)) {
                (Owner::Cell(cell), Some(earlier)) => {
                    let settings = &sweep.cells[cell].settings;
                    let near = nearest[cell]
                        .get_or_insert_with(|| nearest_cell(cell, settings, earlier.sweep));
                    let why =
                        near.map(|cell| changed(task, plan, settings, cell, earlier, semantics));
                    format!("run: {}", why.unwrap_or_else(|| "new".to_owned()))
                }
                _ => "run: new".to_owned(),
            },
        };
        let reasons = match task.owner {
            Owner::Cell(cell) => &mut explained.of_cells[cell],
            Owner::Posterior(_) => &mut explained.of_posteriors,
        };
        *reasons.entry(reason).or_insert(0) += 1;
    }
    explained
}

/// Settings that name a chain, and differ.
fn differences(a: &Settings, b: &Settings) -> Vec<String> {
    let pairs = a.iter().zip(b.iter());
    let differing = pairs.filter(|((key, a), (_, b))| {
        a != b
            && !matches!(key.name, "detections" | "replicates" | "chains")
            && !Stopping::is_of_rule(key)
    });
    differing
        .map(|((key, a), (_, b))| format!("{} {b} -> {a}", key.name))
        .collect()
}

/// The cell of fewest differences; of several the one that stood at the most similar place.
fn nearest_cell(place: usize, settings: &Settings, earlier: &Sweep) -> Option<usize> {
    let cells = 0..earlier.cells.len();
    cells.min_by_key(|&cell| {
        let n = differences(settings, &earlier.cells[cell].settings).len();
        (n, cell.abs_diff(place))
    })
}

/// Why the chain is not one of the earlier run's, whose cell `near` is the most like its own.
fn changed(
    task: &Task,
    plan: &Plan,
    settings: &Settings,
    near: usize,
    earlier: &Earlier<'_>,
    semantics: &[String; 2],
) -> String {
    let before = &earlier.sweep.cells[near].settings;
    let differences = differences(settings, before);
    if !differences.is_empty() {
        return format!("changed {}", differences.join(", "));
    }
    let same = |other: &&Task| {
        let near = Owner::Cell(near);
        (other.owner, other.replicate, other.chain) == (near, task.replicate, task.chain)
    };
    let Some(other) = earlier.plan.tasks.iter().find(same) else {
        return "new: more worlds or chains than before".to_owned();
    };
    let content = |plan: &Plan, task: &Task| plan.data(task).map(|data| data.content_hash()).ok();
    if other.key == task.key {
        return "not run yet".to_owned();
    }
    if content(plan, task) != content(earlier.plan, other) {
        let from = if settings.canonical_text(decides_the_world)
            == before.canonical_text(decides_the_world)
        {
            "the detections or the world file"
        } else {
            "the world"
        };
        return format!("changed data: {from}");
    }
    if semantics != earlier.semantics {
        let (now, then) = (semantics.join(", "), earlier.semantics.join(", "));
        return format!("changed semantics {then} -> {now}");
    }
    "changed start".to_owned()
}
