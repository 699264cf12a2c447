//! Which knob matters, how surely, and with which other: effects of every factor on recovery, convergence,
//! acceptance, ESS and M.
//!
//! Everything is a combination of means over cells taken world by world, so its interval is over worlds
//! (`estimate.rs`). Differences between levels are **paired**: they are taken on each world before they are
//! averaged, so that hard and easy worlds cancel. p-values are Holm's over all of one response in one table.

pub mod attribution;
mod estimate;
mod indices;
mod levels;
mod region;
mod responses;
#[cfg(test)]
mod tests;

pub use attribution::Attribution;
pub use indices::{FactorIndices, Indices, Screened};
pub use levels::FactorLevels;
pub use region::{Region, Side};
pub use responses::{Response, ResponseValues};

use super::told_apart::LEVEL;
use super::{ChainResult, WorldResult};
use crate::diagnostics::interval::Interval;
use crate::diagnostics::multiplicity::holm;
pub use crate::diagnostics::student::UnitMean;
use crate::sweep::{Design, Sweep};
use estimate::{Groups, within};

/// What the settings do.
#[derive(Clone, Debug, Default)]
pub struct Sensitivity {
    /// Whether units are worlds; otherwise chain numbers on one data set.
    pub over_worlds: bool,
    /// Whether the design is sampled, so that levels are bins and intervals count the draw of points too.
    pub is_sampled: bool,
    /// Whether all other factors are at a baseline, and not averaged over.
    pub round_baseline: bool,
    /// The factors that effects and contrasts name by their index.
    pub factors: Vec<FactorLevels>,
    /// Each response at each level of each factor.
    pub levels: Vec<LevelEffect>,
    /// Differences between two levels of a factor.
    pub contrasts: Vec<Contrast>,
    /// Two factors together.
    pub pairs: Vec<PairCell>,
    /// Elementary effects or Sobol's indices, of the designs made for them.
    pub indices: Option<Indices>,
    /// Where a sampled design recovers most; `None` of other designs, or where no effect is upheld.
    pub region: Option<Region>,
}

/// A response at one level of a factor.
#[derive(Clone, Debug)]
pub struct LevelEffect {
    /// Which response.
    pub response: Response,
    /// The factor, by its index.
    pub factor: usize,
    /// The level, by its index.
    pub level: usize,
    /// Its mean; `None` without any value.
    pub estimate: Option<UnitMean>,
    /// What it is worth.
    pub gate: Gate,
}

/// A difference between two levels.
#[derive(Clone, Debug)]
pub struct Contrast {
    /// Which response.
    pub response: Response,
    /// The factor, by its index.
    pub factor: usize,
    /// The level that is taken off.
    pub from: usize,
    /// The level that it is taken off from.
    pub to: usize,
    /// The response at `to` less that at `from`, on the same worlds.
    pub estimate: Option<UnitMean>,
    /// Holm's p-value over all contrasts of the response.
    pub p_holm: Option<f64>,
}

/// A response at two levels of two factors.
#[derive(Clone, Debug)]
pub struct PairCell {
    /// Which response.
    pub response: Response,
    /// The two factors.
    pub factors: (usize, usize),
    /// Their levels.
    pub levels: (usize, usize),
    /// Its mean.
    pub estimate: Option<UnitMean>,
    /// What the two do together beyond the sum of what each does: the mean less those of row and column
    /// plus that of all. `None` in a sampled design, whose bins are filled unevenly.
    pub interaction: Option<UnitMean>,
    /// Holm's p-value over all interactions of the response.
    pub p_holm: Option<f64>,
    /// What it is worth.
    pub gate: Gate,
}

/// What a number over several cells and worlds is worth: convergence and missingness, zeros too.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Gate {
    /// Cells.
    pub n_cells: usize,
    /// Cell and world together, with a chain that ran to its end.
    pub n_judged: usize,
    /// Those on which the chains are shown to have converged.
    pub n_converged: usize,
    /// Chains planned.
    pub n_planned: usize,
    /// Chains that failed.
    pub n_failed: usize,
    /// Chains not run yet.
    pub n_missing: usize,
}

impl Gate {
    /// Share that converged.
    pub fn converged_share(&self) -> Option<f64> {
        (self.n_judged > 0).then(|| self.n_converged as f64 / self.n_judged as f64)
    }

    fn add(&mut self, other: &Self) {
        self.n_cells += other.n_cells;
        self.n_judged += other.n_judged;
        self.n_converged += other.n_converged;
        self.n_planned += other.n_planned;
        self.n_failed += other.n_failed;
        self.n_missing += other.n_missing;
    }
}

impl Sensitivity {
    /// Of a sweep's chains and worlds, in their order.
    pub fn new(sweep: &Sweep, chains: &[ChainResult], worlds: &[WorldResult]) -> Self {
        let values = responses::responses(sweep, chains, worlds);
        Self::of(sweep, &values, &gates(sweep, worlds))
    }

    fn of(sweep: &Sweep, values: &[ResponseValues], gates: &[Gate]) -> Self {
        let factors = levels::factor_levels(sweep);
        if factors.is_empty() {
            return Self::default();
        }
        let is_sampled = matches!(sweep.design, Design::Sampled(_));
        let mut found = Self {
            over_worlds: sweep.has_many_worlds(),
            is_sampled,
            round_baseline: matches!(sweep.design, Design::OneAtATime(_)),
            indices: indices::indices(sweep, values),
            factors,
            ..Self::default()
        };
        for own in values {
            found.add_levels(own, gates);
            if !found.round_baseline {
                found.add_pairs(own, gates);
            }
            if found.is_sampled && own.response == Response::Recovery {
                found.region = region::region(&found, own);
            }
        }
        found
    }

    /// The responses that have a value anywhere.
    pub fn responses(&self) -> Vec<Response> {
        let known = |response: &Response| self.levels.iter().any(|row| row.response == *response);
        Response::ALL.into_iter().filter(known).collect()
    }

    /// A response along a factor.
    pub fn curve(&self, response: Response, factor: usize) -> Vec<&LevelEffect> {
        let own = |row: &&LevelEffect| row.response == response && row.factor == factor;
        self.levels.iter().filter(own).collect()
    }

    /// A response by two factors, in either order.
    pub fn pair(&self, response: Response, factors: (usize, usize)) -> Vec<&PairCell> {
        let own = |row: &&PairCell| row.response == response && row.factors == factors;
        self.pairs.iter().filter(own).collect()
    }

    /// The factors by the largest difference between two levels, largest first, with that contrast.
    pub fn strongest(&self, response: Response) -> Vec<&Contrast> {
        let size = |row: &Contrast| row.estimate.map_or(-1.0, |estimate| estimate.mean.abs());
        let of_factor = |factor: usize| {
            let own = self.contrasts.iter();
            let own = own.filter(|row| row.response == response && row.factor == factor);
            // Of equals the first.
            own.rev().max_by(|a, b| size(a).total_cmp(&size(b)))
        };
        let mut largest: Vec<&Contrast> = (0..self.factors.len()).filter_map(of_factor).collect();
        largest.retain(|row| row.estimate.is_some());
        largest.sort_by(|a, b| size(b).total_cmp(&size(a)));
        largest
    }

    /// Those of [`strongest`](Self::strongest) that chance does not explain at 5 %.
    pub fn upheld(&self, response: Response) -> Vec<&Contrast> {
        let mut strongest = self.strongest(response);
        strongest.retain(|row| row.p_holm.is_some_and(|p_holm| p_holm <= LEVEL));
        strongest
    }

    /// Interactions by falling size, of those that chance does not explain at 5 %.
    pub fn clear_interactions(&self, response: Response) -> Vec<&PairCell> {
        let is_clear = |row: &&PairCell| {
            row.response == response && row.p_holm.is_some_and(|p_holm| p_holm <= LEVEL)
        };
        let size = |row: &PairCell| row.interaction.map_or(0.0, |found| found.mean.abs());
        let mut clear: Vec<&PairCell> = self.pairs.iter().filter(is_clear).collect();
        clear.sort_by(|a, b| size(b).total_cmp(&size(a)));
        clear
    }

    fn add_levels(&mut self, values: &ResponseValues, gates: &[Gate]) {
        let response = values.response;
        let first = self.contrasts.len();
        for (factor, own) in self.factors.iter().enumerate() {
            let n = own.labels.len();
            let groups = Groups::new(values, n, |cell| own.of_cell[cell]);
            let of_level = gather(gates, n, |cell| own.of_cell[cell]);
            for (level, gate) in of_level.into_iter().enumerate() {
                let estimate = groups.combine(&[(level, 1.0)], self.is_sampled);
                self.levels.push(LevelEffect {
                    response,
                    factor,
                    level,
                    estimate: estimate.map(|estimate| cut(estimate, response, false)),
                    gate,
                });
            }
            for from in 0..n {
                for to in from + 1..n {
                    let estimate = groups.combine(&[(to, 1.0), (from, -1.0)], self.is_sampled);
                    self.contrasts.push(Contrast {
                        response,
                        factor,
                        from,
                        to,
                        estimate: estimate.map(|estimate| cut(estimate, response, true)),
                        p_holm: None,
                    });
                }
            }
        }
        let own = &mut self.contrasts[first..];
        let p_values = own.iter().map(|row| row.estimate?.p_value).collect();
        for (row, p_holm) in own.iter_mut().zip(adjusted(p_values)) {
            row.p_holm = p_holm;
        }
    }

    fn add_pairs(&mut self, values: &ResponseValues, gates: &[Gate]) {
        let response = values.response;
        let first = self.pairs.len();
        for a in 0..self.factors.len() {
            for b in a + 1..self.factors.len() {
                let (rows, columns) = (&self.factors[a], &self.factors[b]);
                let (n_rows, n_columns) = (rows.labels.len(), columns.labels.len());
                let group =
                    |cell: usize| Some(rows.of_cell[cell]? * n_columns + columns.of_cell[cell]?);
                let n = n_rows * n_columns;
                let groups = Groups::new(values, n, group);
                let of_group = gather(gates, n, group);
                for i in 0..n_rows {
                    for j in 0..n_columns {
                        let place = i * n_columns + j;
                        let estimate = groups.combine(&[(place, 1.0)], self.is_sampled);
                        let interaction = if self.is_sampled {
                            None
                        } else {
                            groups.combine(&interaction(i, j, n_rows, n_columns), false)
                        };
                        self.pairs.push(PairCell {
                            response,
                            factors: (a, b),
                            levels: (i, j),
                            estimate: estimate.map(|estimate| cut(estimate, response, false)),
                            interaction,
                            p_holm: None,
                            gate: of_group[place],
                        });
                    }
                }
            }
        }
        let own = &mut self.pairs[first..];
        let p_values = own.iter().map(|row| row.interaction?.p_value).collect();
        for (row, p_holm) in own.iter_mut().zip(adjusted(p_values)) {
            row.p_holm = p_holm;
        }
    }
}

/// Weights of the interaction of row i and column j: the mean less those of its row and column, plus that of all.
fn interaction(i: usize, j: usize, n_rows: usize, n_columns: usize) -> Vec<(usize, f64)> {
    let (r, c) = (n_rows as f64, n_columns as f64);
    let weight = |row: usize, column: usize| {
        let own = |same: bool, n: f64| f64::from(u8::from(same)) - 1.0 / n;
        own(row == i, r) * own(column == j, c)
    };
    let all = (0..n_rows).flat_map(|row| (0..n_columns).map(move |column| (row, column)));
    all.map(|(row, column)| (row * n_columns + column, weight(row, column)))
        .collect()
}

/// An estimate cut to what a share, or a difference of two, can be.
fn cut(estimate: UnitMean, response: Response, is_difference: bool) -> UnitMean {
    if !response.is_share() {
        return estimate;
    }
    let low = if is_difference { -1.0 } else { 0.0 };
    within(estimate, Interval { low, high: 1.0 })
}

/// Holm's p-values of those that have one.
fn adjusted(p_values: Vec<Option<f64>>) -> Vec<Option<f64>> {
    let known: Vec<f64> = p_values.iter().flatten().copied().collect();
    let mut adjusted = holm(&known).into_iter();
    let of = |p_value: Option<f64>| p_value.and_then(|_| adjusted.next());
    p_values.into_iter().map(of).collect()
}

/// The gate of each cell, over the worlds that all cells have.
fn gates(sweep: &Sweep, worlds: &[WorldResult]) -> Vec<Gate> {
    let mut gates = vec![
        Gate {
            n_cells: 1,
            ..Gate::default()
        };
        sweep.cells.len()
    ];
    let common = |world: &&WorldResult| world.replicate < sweep.n_replicates();
    for world in worlds.iter().filter(common) {
        gates[world.cell].add(&Gate {
            n_cells: 0,
            n_judged: usize::from(world.diagnosis.is_some()),
            n_converged: usize::from(world.has_converged()),
            n_planned: world.n_planned,
            n_failed: world.n_failed,
            n_missing: world.n_missing,
        });
    }
    gates
}

fn gather(gates: &[Gate], n: usize, group: impl Fn(usize) -> Option<usize>) -> Vec<Gate> {
    let mut gathered = vec![Gate::default(); n];
    for (cell, gate) in gates.iter().enumerate() {
        if let Some(group) = group(cell) {
            gathered[group].add(gate);
        }
    }
    gathered
}
