//! Are the starts forgotten? Nested R-hat over cells that differ in their initial topology alone.
//!
//! Chains from one start can agree on a mode that none of them leaves; only chains from other starts can tell.
//! The start is the superchain of Margossian et al. (2024), see [`nested_r_hat`].

use std::collections::HashMap;

use super::{ChainResult, WorldResult};
use crate::diagnostics::chains::{Chains, Stretch};
use crate::diagnostics::r_hat::nested_r_hat;
use crate::diagnostics::undefined::Undefined;
use crate::run::ChainOutcome;
use crate::sweep::Sweep;

/// Nested R-hat of the chains on a world, all starts together.
#[derive(Clone, Copy, Debug)]
pub struct Starts {
    /// Initial topologies that have a chain.
    pub n_starts: usize,
    /// Of M.
    pub n_sets: Result<f64, Undefined>,
    /// Of ln target.
    pub ln_target: Result<f64, Undefined>,
}

impl Default for Starts {
    fn default() -> Self {
        let none = Err(Undefined::TooFew { n: 0, fewest: 2 });
        Self {
            n_starts: 0,
            n_sets: none,
            ln_target: none,
        }
    }
}

/// Fills in `starts` of every world.
pub(super) fn add_starts(sweep: &Sweep, chains: &[ChainResult], worlds: &mut [WorldResult]) {
    let key = |cell: usize, replicate: u64| {
        let settings = &sweep.cells[cell].settings;
        (settings.canonical_text(|key| key.name != "init"), replicate)
    };
    let mut groups: HashMap<(String, u64), Vec<(&str, &ChainOutcome)>> = HashMap::new();
    for chain in chains.iter().filter(|chain| !chain.is_repeat) {
        if let Some(outcome) = chain.outcome() {
            let init = sweep.cells[chain.cell].settings.text("init");
            let group = groups.entry(key(chain.cell, chain.replicate)).or_default();
            group.push((init, outcome));
        }
    }
    let found: HashMap<(String, u64), Starts> = groups
        .into_iter()
        .map(|(key, group)| (key, starts(&group)))
        .collect();
    for world in worlds {
        let own = found.get(&key(world.cell, world.replicate));
        world.starts = own.copied().unwrap_or_default();
    }
}

fn starts(group: &[(&str, &ChainOutcome)]) -> Starts {
    let mut inits: Vec<&str> = group.iter().map(|(init, _)| *init).collect();
    inits.sort_unstable();
    inits.dedup();
    let place = |init: &str| inits.iter().position(|own| *own == init).unwrap_or(0);
    let superchain: Vec<usize> = group.iter().map(|(init, _)| place(init)).collect();
    let series = || group.iter().map(|(_, outcome)| &outcome.series);
    let first_step = series().map(|series| series.first_step).max().unwrap_or(0);
    let of = |values: &[Vec<Stretch>]| {
        let chains = Chains::new(values)?;
        Ok(nested_r_hat(&chains, &superchain)?.value())
    };
    let n_sets: Vec<Vec<Stretch>> = series()
        .map(|series| {
            let kept = series.stretches(&series.n_sets, first_step);
            kept.map(|(m, n)| (f64::from(m), n)).collect()
        })
        .collect();
    let ln_target: Vec<Vec<Stretch>> = series()
        .map(|series| {
            let kept = series.stretches(&series.ln_target, first_step);
            kept.map(|(x, n)| (f64::from(x), n)).collect()
        })
        .collect();
    Starts {
        n_starts: inits.len(),
        n_sets: of(&n_sets),
        ln_target: of(&ln_target),
    }
}
