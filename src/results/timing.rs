//! What a cell costs in wall-clock time and what it gives for it: effective draws per second.
//!
//! The ESS is that of ln target, the bulk, of all chains on a world together; seconds are those of the same
//! chains. Worlds whose ESS is undefined, or whose times are not known, are left out and counted.

use std::collections::HashMap;

use super::{SweepResults, Verdict};

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
    pub verdict: Verdict,
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
