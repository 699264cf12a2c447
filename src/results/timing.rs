//! What a cell costs in wall-clock time and what it gives for it: effective draws per second.
//!
//! The ESS is that of ln target, the bulk, of all chains on a world together; seconds are those of the same
//! chains. Worlds whose ESS is undefined, or whose times are not known, are left out and counted.

use std::collections::{BTreeMap, HashMap};

use super::{CellVerdict, SweepResults};
use crate::diagnostics::student::{UnitMean, unit_mean};
use crate::settings::Value;
use crate::sweep::{Design, Sweep};

/// One cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellCost {
    /// The cell, by its index.
    pub cell: usize,
    /// Mean seconds of a chain; `None` if no time is known.
    pub seconds_per_chain: Option<f64>,
    /// Effective draws per second; `None` if no world has both.
    pub ess_per_second: Option<f64>,
    /// Worlds that have both, out of all.
    pub n_measured: usize,
    /// Its verdict.
    pub verdict: CellVerdict,
}

/// Of all cells, from the seconds of chains by their keys.
pub fn cell_costs(results: &SweepResults, seconds: &HashMap<String, f64>) -> Vec<CellCost> {
    let mut by_cell: Vec<HashMap<u64, Vec<f64>>> = vec![HashMap::new(); results.cells.len()];
    for chain in results.chains.iter().filter(|chain| !chain.is_repeat) {
        if let Some(&seconds) = seconds.get(&chain.key) {
            let worlds = &mut by_cell[chain.cell];
            worlds.entry(chain.replicate).or_default().push(seconds);
        }
    }
    let cost = |cell: usize| {
        let (mut ess, mut spent, mut n_measured) = (0.0, 0.0, 0);
        for world in results.worlds_of(cell) {
            let own = by_cell[cell].get(&world.replicate);
            let diagnosis = world.diagnosis.as_ref();
            let size = diagnosis.and_then(|found| found.ln_target.ess_bulk.ok());
            // All its chains must have been timed, or the time is too short.
            let is_whole = |own: &&Vec<f64>| diagnosis.is_some_and(|d| d.n_chains == own.len());
            if let (Some(size), Some(own)) = (size, own.filter(is_whole)) {
                ess += size;
                spent += own.iter().sum::<f64>();
                n_measured += 1;
            }
        }
        let mut times: Vec<f64> = by_cell[cell].values().flatten().copied().collect();
        // Sums in one order, whatever the order of the map.
        times.sort_by(f64::total_cmp);
        CellCost {
            cell,
            seconds_per_chain: (!times.is_empty())
                .then(|| times.iter().sum::<f64>() / times.len() as f64),
            ess_per_second: (spent > 0.0).then(|| ess / spent),
            n_measured,
            verdict: results.cells[cell].verdict,
        }
    };
    (0..results.cells.len()).map(cost).collect()
}

/// Effective draws per second at one level of a factor, over worlds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelRate {
    /// Of M.
    pub n_sets: UnitMean,
    /// Of ln target.
    pub ln_target: UnitMean,
    /// Of the slower of the two, chain by chain.
    pub slower: UnitMean,
    /// ln of the slower at the best level over that at this one, world by world; `None` for the best itself, and where a world
    /// has no effective draw at this level.
    pub ln_behind_best: Option<UnitMean>,
    /// Chains without an effective draw: they count as 0 per second.
    pub n_without: usize,
    /// Chains timed.
    pub n_chains: usize,
}

/// By the levels of a factor, `None` for one without times; with the place of the level that is best by the slower of M and ln
/// target. ESS is each chain's own: whether chains agree, the verdict says. The value of a world is the mean over its
/// chains in all cells at the level, or, round a baseline, in the cell there.
pub fn rates_by_level(
    sweep: &Sweep,
    results: &SweepResults,
    seconds: &HashMap<String, f64>,
    factor: usize,
) -> (Vec<Option<LevelRate>>, Option<usize>) {
    let key = sweep.factors[factor].key.name;
    let round_baseline = matches!(sweep.design, Design::OneAtATime(_));
    let belongs = |cell: usize, level: &Value| {
        let settings = &sweep.cells[cell].settings;
        settings.get(key) == level
            && (!round_baseline
                || sweep.factors.iter().all(|other| {
                    let name = other.key.name;
                    name == key || settings.get(name) == sweep.base.get(name)
                }))
    };
    let by_world = |level: &Value| {
        let mut worlds: BTreeMap<u64, Vec<[f64; 3]>> = BTreeMap::new();
        for chain in results.chains.iter().filter(|chain| !chain.is_repeat) {
            let Some((outcome, seconds)) = chain.outcome().zip(seconds.get(&chain.key)) else {
                continue;
            };
            if belongs(chain.cell, level) && *seconds > 0.0 {
                let rate = |ess: Option<f64>| ess.unwrap_or(0.0) / seconds;
                let (a, b) = (rate(outcome.ess_n_sets), rate(outcome.ess_ln_target));
                worlds
                    .entry(chain.replicate)
                    .or_default()
                    .push([a, b, a.min(b)]);
            }
        }
        worlds
    };
    let levels: Vec<BTreeMap<u64, Vec<[f64; 3]>>> =
        sweep.factors[factor].levels.iter().map(by_world).collect();
    let mean = |chains: &[[f64; 3]], what: usize| {
        chains.iter().map(|rates| rates[what]).sum::<f64>() / chains.len() as f64
    };
    let over_worlds = |worlds: &BTreeMap<u64, Vec<[f64; 3]>>, what: usize| {
        let values: Vec<f64> = worlds.values().map(|chains| mean(chains, what)).collect();
        unit_mean(&values)
    };
    let slower = |worlds| over_worlds(worlds, 2).map_or(-1.0, |found| found.mean);
    let best = (0..levels.len())
        .filter(|&level| !levels[level].is_empty())
        .max_by(|&a, &b| {
            slower(&levels[a])
                .total_cmp(&slower(&levels[b]))
                .then(b.cmp(&a))
        });
    let behind = |level: usize| {
        let best = best.filter(|best| *best != level)?;
        let shared = levels[level].iter().filter_map(|(world, chains)| {
            let (own, first) = (mean(chains, 2), mean(levels[best].get(world)?, 2));
            Some((first / own).ln())
        });
        let ratios: Vec<f64> = shared.collect();
        unit_mean(&ratios).filter(|found| found.mean.is_finite())
    };
    let rate = |level: usize| {
        let worlds = &levels[level];
        let chains = || worlds.values().flatten();
        Some(LevelRate {
            n_sets: over_worlds(worlds, 0)?,
            ln_target: over_worlds(worlds, 1)?,
            slower: over_worlds(worlds, 2)?,
            ln_behind_best: behind(level),
            n_without: chains().filter(|rates| rates[2] == 0.0).count(),
            n_chains: chains().count(),
        })
    };
    ((0..levels.len()).map(rate).collect(), best)
}
