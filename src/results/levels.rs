//! How the worlds of all cells at each level of a factor fared: counts of verdicts, zeros too.
//!
//! What a recovery rate is worth is how much of it was had by chains that converged, so every rate
//! by level has these beside it. In a one-at-a-time design the other factors are at the baseline.

use super::{CellResult, Verdict};
use crate::sweep::{Cell, Design, Sweep};

/// The worlds of the cells at one level, by verdict.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelVerdicts {
    /// In the order of [`Verdict::ALL`].
    pub by_verdict: [usize; Verdict::ALL.len()],
}

impl LevelVerdicts {
    /// Worlds with this verdict.
    pub fn n(&self, verdict: Verdict) -> usize {
        self.by_verdict[verdict as usize]
    }

    /// Worlds with at least one chain that ran to its end.
    pub fn n_judged(&self) -> usize {
        let all: usize = self.by_verdict.iter().sum();
        all - self.n(Verdict::Failed) - self.n(Verdict::Missing)
    }

    /// Share of the judged worlds whose chains converged to the truth; `None` without any.
    pub fn recovered_and_converged(&self) -> Option<f64> {
        let n = self.n_judged();
        (n > 0).then(|| self.n(Verdict::Recovered) as f64 / n as f64)
    }
}

/// By the levels of a factor.
pub fn verdicts_by_level(sweep: &Sweep, cells: &[CellResult], factor: usize) -> Vec<LevelVerdicts> {
    let key = sweep.factors[factor].key.name;
    let round_baseline = matches!(sweep.design, Design::OneAtATime(_));
    let at_baseline = |cell: &Cell| {
        sweep.factors.iter().all(|other| {
            let name = other.key.name;
            name == key || cell.settings.get(name) == sweep.base.get(name)
        })
    };
    let of_level = |level| {
        let mut found = LevelVerdicts {
            by_verdict: [0; Verdict::ALL.len()],
        };
        for (cell, result) in sweep.cells.iter().zip(cells) {
            if cell.settings.get(key) == level && (!round_baseline || at_baseline(cell)) {
                for (count, n) in found.by_verdict.iter_mut().zip(result.by_verdict) {
                    *count += n;
                }
            }
        }
        found
    };
    sweep.factors[factor].levels.iter().map(of_level).collect()
}
