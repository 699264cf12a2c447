//! Which knob matters: the recovery rate by the levels of each factor, averaged over all the others,
//! or, in a one-at-a-time design, with all the others at the baseline.
//!
//! The interval of a level is that of a [`recovery_rate`]: all cells see the same worlds, so the
//! outcome of a world is the share of all chains that ran on it at that level. On a single data set
//! the units are the chains, and the interval says how surely the *sampler* gives that average.
//! [`super::sensitivity`] has the other responses, and tests the differences between levels.

use super::ChainResult;
use crate::diagnostics::rate::{Rate, recovery_rate};
use crate::settings::Value;
use crate::sweep::{Cell, Design, Sweep};

/// The effect of one factor.
#[derive(Clone, Debug)]
pub struct FactorEffect {
    /// The factor, by its index in the sweep.
    pub factor: usize,
    /// By level; `None` without an outcome.
    pub by_level: Vec<Option<Rate>>,
    /// Largest minus smallest marginal rate.
    pub range: f64,
}

/// The joint effect of two factors.
#[derive(Clone, Debug)]
pub struct PairEffect {
    /// The factor of the rows.
    pub rows: usize,
    /// The factor of the columns.
    pub columns: usize,
    /// By level of the first, then of the second.
    pub by_levels: Vec<Vec<Option<Rate>>>,
}

/// All factors, by falling range; those without any outcome are left out. Empty for a list, whose cells
/// are not laid out so that levels could be compared, and for a sampled design, which has no levels.
pub fn factor_effects(sweep: &Sweep, chains: &[ChainResult]) -> Vec<FactorEffect> {
    if matches!(sweep.design, Design::List(_) | Design::Sampled(_)) {
        return Vec::new();
    }
    let mut effects: Vec<FactorEffect> = (0..sweep.factors.len())
        .filter_map(|factor| {
            let levels = sweep.factors[factor].levels.iter();
            let by_level: Vec<Option<Rate>> = levels
                .map(|level| marginal(sweep, chains, &[(factor, level)]))
                .collect();
            let rates = || by_level.iter().flatten().map(|rate| rate.rate);
            let highest = rates().fold(f64::NEG_INFINITY, f64::max);
            let lowest = rates().fold(f64::INFINITY, f64::min);
            (highest >= lowest).then_some(FactorEffect {
                factor,
                by_level,
                range: highest - lowest,
            })
        })
        .collect();
    effects.sort_by(|a, b| b.range.total_cmp(&a.range).then(a.factor.cmp(&b.factor)));
    effects
}

/// Two factors together.
pub fn pair_effect(
    sweep: &Sweep,
    chains: &[ChainResult],
    rows: usize,
    columns: usize,
) -> PairEffect {
    let levels = |factor: usize| sweep.factors[factor].levels.iter();
    let row = |a| {
        levels(columns)
            .map(|b| marginal(sweep, chains, &[(rows, a), (columns, b)]))
            .collect()
    };
    PairEffect {
        rows,
        columns,
        by_levels: levels(rows).map(row).collect(),
    }
}

/// The rate at given levels of some factors, averaged over all others (or with them at the baseline).
pub fn marginal(sweep: &Sweep, chains: &[ChainResult], at: &[(usize, &Value)]) -> Option<Rate> {
    let mut worlds = vec![Vec::new(); sweep.n_replicates() as usize];
    let name = |factor: usize| sweep.factors[factor].key.name;
    // Round a baseline, a level is compared with all other factors at the baseline.
    let round_baseline = matches!(sweep.design, Design::OneAtATime(_));
    let belongs = |cell: &Cell| {
        let at_levels = at
            .iter()
            .all(|(factor, level)| cell.settings.get(name(*factor)) == *level);
        let others = (0..sweep.factors.len()).filter(|f| at.iter().all(|(factor, _)| factor != f));
        let at_baseline =
            |factor: usize| cell.settings.get(name(factor)) == sweep.base.get(name(factor));
        at_levels && (!round_baseline || others.into_iter().all(at_baseline))
    };
    let chosen: Vec<bool> = sweep.cells.iter().map(belongs).collect();
    for chain in chains
        .iter()
        .filter(|chain| chosen[chain.cell] && !chain.is_repeat)
    {
        // Worlds that a stopping rule gave some cells only would tilt the means of those.
        if let Some(recovered) = chain.outcome().and_then(|outcome| outcome.recovered)
            && let Some(world) = worlds.get_mut(chain.replicate as usize)
        {
            world.push(recovered);
        }
    }
    recovery_rate(&worlds, sweep.has_many_worlds())
}
