//! The tables of a sweep: one row per chain, per cell, per topology.

use super::{Table, Values};
use crate::chain::{Run, Trace};
use crate::results::{CellResult, ChainResult, Fault, Sorted, SweepResults, Verdict};
use crate::run::{
    ChainChecks, ChainOutcome, ChainStatus, ExactComparison, ExactDistance, MserBurnIns, Noted,
    TopTopology,
};
use crate::sampler::MoveKind;
use crate::settings::Value;
use crate::sweep::Sweep;

/// A table under construction from rows of one type.
pub(super) struct Builder<'a, R> {
    rows: Vec<R>,
    pub(super) table: Table,
    sweep: &'a Sweep,
}

impl<'a, R> Builder<'a, R> {
    pub(super) fn new(rows: Vec<R>, sweep: &'a Sweep) -> Self {
        Self {
            rows,
            table: Table::default(),
            sweep,
        }
    }

    pub(super) fn texts(&mut self, name: &str, value: impl Fn(&R) -> Option<String>) {
        self.table
            .push(name, Values::Texts(self.rows.iter().map(value).collect()));
    }

    pub(super) fn numbers(&mut self, name: &str, value: impl Fn(&R) -> Option<f64>) {
        self.table
            .push(name, Values::Numbers(self.rows.iter().map(value).collect()));
    }

    pub(super) fn counts(&mut self, name: &str, value: impl Fn(&R) -> Option<u64>) {
        self.table
            .push(name, Values::Counts(self.rows.iter().map(value).collect()));
    }

    pub(super) fn flags(&mut self, name: &str, value: impl Fn(&R) -> Option<bool>) {
        self.table
            .push(name, Values::Flags(self.rows.iter().map(value).collect()));
    }

    /// Columns that say which cell a row is of: its number and names, and the settings chosen.
    pub(super) fn cell_columns(&mut self, cell: impl Fn(&R) -> usize, all_settings: bool) {
        let sweep = self.sweep;
        let cell_of = |row: &R| &sweep.cells[cell(row)];
        self.texts("cell", |row| Some(cell_of(row).id.clone()));
        let is_named = |name: &str| (!name.is_empty()).then(|| name.to_owned());
        if sweep.cells.iter().any(|cell| !cell.label.is_empty()) {
            self.texts("label", |row| is_named(&cell_of(row).label));
            self.texts("variant", |row| is_named(&cell_of(row).variant));
        }
        for (key, default) in sweep.base.iter() {
            // Where a CSV lies is no part of what was found.
            let is_factor = sweep
                .factors
                .iter()
                .any(|factor| factor.key.name == key.name);
            if key.name == "detections" || !(is_factor || all_settings) {
                continue;
            }
            let value = |row: &R| cell_of(row).settings.get(key.name);
            // Beside a world's number.
            let name = match key.name {
                "world" if !all_settings => "simulated_world",
                name => name,
            };
            match default {
                Value::Count(_) => self.counts(name, |row| match value(row) {
                    Value::Count(count) => Some(*count),
                    _ => None,
                }),
                Value::Number(_) => self.numbers(name, |row| match value(row) {
                    Value::Number(number) => Some(*number),
                    _ => None,
                }),
                Value::Text(_) => self.texts(name, |row| Some(value(row).to_string())),
            }
        }
    }
}

/// One row per chain.
pub fn chains_table(sweep: &Sweep, results: &SweepResults) -> Table {
    let rows: Vec<&ChainResult> = results.chains.iter().collect();
    let mut b = Builder::new(rows, sweep);
    fn of<T>(value: impl Fn(&ChainOutcome) -> Option<T>) -> impl Fn(&&ChainResult) -> Option<T> {
        move |row| row.outcome().and_then(&value)
    }
    b.cell_columns(|row| row.cell, false);
    b.counts("world", |row| Some(row.replicate + 1));
    b.counts("chain", |row| Some(row.chain + 1));
    b.counts("data", |row| Some(row.data as u64 + 1));
    b.texts("key", |row| Some(row.key.clone()));
    b.texts("status", |row| {
        Some(
            if row.outcome().is_some() {
                "done"
            } else {
                "failed"
            }
            .to_owned(),
        )
    });
    b.texts("reason", |row| match &row.status {
        ChainStatus::Failed { reason, .. } => Some(reason.clone()),
        ChainStatus::Done(_) => None,
    });
    b.counts("n_detections", of(|o| Some(o.n_detections)));
    b.counts("n_landmarks", of(|o| o.n_landmarks));
    b.counts("n_proposals", of(|o| Some(o.n_steps)));
    b.numbers("acceptance_rate", of(|o| Some(o.acceptance_rate)));
    b.numbers("evaluated_share", of(|o| Some(o.evaluated_share)));
    b.numbers("underflow_share", of(|o| o.underflow_share));
    b.counts(
        "round_trips",
        of(|o| Some(o.tempering.as_ref()?.round_trips)),
    );
    b.numbers(
        "communication_barrier",
        of(|o| Some(o.tempering.as_ref()?.barrier)),
    );
    for kind in MoveKind::ALL {
        let row =
            move |o: &ChainOutcome| o.moves.iter().find(|row| row.kind == kind.name()).cloned();
        b.counts(
            &format!("{}_proposed", kind.name()),
            of(move |o| Some(row(o)?.proposed)),
        );
        b.counts(
            &format!("{}_accepted", kind.name()),
            of(move |o| Some(row(o)?.accepted)),
        );
        b.counts(
            &format!("{}_impossible", kind.name()),
            of(move |o| Some(row(o)?.impossible)),
        );
    }
    // Not "burn_in": that is the setting, which may be a factor and so a column of this table too.
    b.counts("burn_in_found", of(|o| o.burn_in));
    b.texts("burn_in_reason", of(|o| Some(o.burn_in_reason.clone())));
    b.numbers("mean_n_sets", of(|o| Some(o.mean_n_sets)));
    b.numbers("sd_n_sets", of(|o| Some(o.sd_n_sets)));
    b.counts("last_n_sets", of(|o| Some(o.last_n_sets)));
    b.numbers("mean_ln_target", of(|o| Some(o.mean_ln_target)));
    b.numbers("ess_n_sets", of(|o| o.ess_n_sets));
    b.numbers("ess_ln_target", of(|o| o.ess_ln_target));
    b.counts("n_topologies", of(|o| Some(o.n_topologies)));
    b.counts("count_error_bound", of(|o| Some(o.count_error_bound)));
    b.texts("map_labels", of(|o| Some(o.top.first()?.labels.clone())));
    b.counts("map_n_sets", of(|o| Some(o.top.first()?.n_sets)));
    b.counts("map_count", of(|o| Some(o.top.first()?.count)));
    b.numbers("map_frequency", of(|o| Some(o.top.first()?.frequency)));
    b.flags("recovered", of(|o| o.recovered));
    b.texts("fault", |row| match row.sorted? {
        Sorted::Recovered => None,
        Sorted::Failed(fault) => Some(fault.name().to_owned()),
    });
    b.numbers("truth_mass", of(|o| o.truth_mass));
    b.counts("first_at_truth", of(|o| o.first_at_truth));
    b.numbers("adjusted_rand_index", of(|o| o.adjusted_rand_index));
    b.numbers("unknown_share", of(|o| o.unknown_share));
    b.counts("n_unknown_merged", of(|o| o.n_unknown_merged));
    b.counts("longest_hold", of(|o| Some(o.checks.longest_hold)));
    type MserColumn = (&'static str, fn(&MserBurnIns) -> &Noted);
    let settled: [MserColumn; 3] = [
        ("mser_n_sets", |m| &m.n_sets),
        ("mser_ln_target", |m| &m.ln_target),
        ("mser_map_distance", |m| &m.map_distance),
    ];
    for (name, of_quantity) in settled {
        b.counts(
            name,
            of(move |o| of_quantity(&o.mser).value.map(|n| n as u64)),
        );
        b.texts(
            &format!("{name}_state"),
            of(move |o| Some(of_quantity(&o.mser).state.clone())),
        );
    }
    type Column = (&'static str, fn(&ChainChecks) -> &Noted);
    let noted: [Column; 5] = [
        ("longest_hold_excess", |c| &c.longest_hold_excess),
        ("geweke_n_sets", |c| &c.geweke_n_sets),
        ("geweke_ln_target", |c| &c.geweke_ln_target),
        ("geweke_map_distance", |c| &c.geweke_map_distance),
        ("estimate_sd", |c| &c.estimate_sd),
    ];
    for (name, check) in noted {
        b.numbers(name, of(move |o| check(&o.checks).value));
        b.texts(
            &format!("{name}_state"),
            of(move |o| Some(check(&o.checks).state.clone())),
        );
    }
    b.numbers("estimate_sd_error", of(|o| o.checks.estimate_sd_error));
    fn distance<T>(
        value: impl Fn(&ExactDistance) -> Option<T>,
    ) -> impl Fn(&ChainOutcome) -> Option<T> {
        move |outcome| match &outcome.exact {
            ExactComparison::Compared(distance) => value(distance),
            ExactComparison::Not { .. } => None,
        }
    }
    b.numbers("exact_distance", of(distance(|d| Some(d.total_variation))));
    b.numbers("exact_distance_expected", of(distance(|d| d.expected)));
    b.numbers("exact_distance_high", of(distance(|d| d.high)));
    b.flags("exact_differs", of(distance(ExactDistance::differs)));
    b.numbers("exact_ess", of(distance(|d| d.effective_samples)));
    b.numbers("exact_table_error", of(distance(|d| Some(d.table_error))));
    b.texts(
        "exact_reason",
        of(|o| match &o.exact {
            ExactComparison::Not { reason } => Some(reason.clone()),
            ExactComparison::Compared(d) if d.high.is_none() => Some(
                "no effective sample size to judge by: the chain stood still, mixes slowly or is short".to_owned(),
            ),
            ExactComparison::Compared(_) => None,
        }),
    );
    b.table
}

/// One row per cell.
pub fn cells_table(sweep: &Sweep, results: &SweepResults) -> Table {
    let rows: Vec<&CellResult> = results.cells.iter().collect();
    let mut b = Builder::new(rows, sweep);
    b.cell_columns(|row| row.cell, true);
    b.counts("n_chains", |row| Some(row.n_chains as u64));
    b.counts("n_failed", |row| Some(row.n_failed as u64));
    b.counts("n_missing", |row| Some(row.n_missing as u64));
    b.texts("verdict", |row| Some(row.verdict.words().to_owned()));
    b.texts("worlds_by_verdict", |row| Some(row.worlds.split()));
    b.counts("n_worlds", |row| Some(row.worlds.n_all() as u64));
    b.counts("n_worlds_converged", |row| {
        Some(row.worlds.n_converged() as u64)
    });
    for verdict in Verdict::ALL {
        let name = format!("n_worlds_{}", verdict.name());
        b.counts(&name, |row| Some(row.worlds.n(verdict) as u64));
    }
    b.numbers("converged_share", |row| row.converged_share());
    b.counts("n_never_settled", |row| Some(row.n_never_settled as u64));
    b.numbers("map_agreement", |row| row.map_agreement);
    b.counts("n_truncated", |row| Some(row.n_truncated as u64));
    b.numbers("recovery_rate", |row| Some(row.recovery?.rate));
    b.numbers("recovery_low", |row| Some(row.recovery?.interval.low));
    b.numbers("recovery_high", |row| Some(row.recovery?.interval.high));
    b.texts("recovery_interval", |row| {
        Some(row.recovery?.kind.words().to_owned())
    });
    b.counts("recovery_n", |row| Some(row.recovery?.n as u64));
    b.numbers("recovery_error", |row| Some(row.recovery?.error()));
    for fault in Fault::ALL {
        let name = format!("n_faults_{}", fault.name());
        b.counts(&name, |row| Some(row.faults?.n(fault) as u64));
    }
    b.counts("n_replicates", |row| Some(row.n_replicates));
    b.texts("stopping", |row| Some(row.stop?.word().to_owned()));
    b.numbers("acceptance_rate", |row| row.acceptance_rate);
    b.numbers("merge_acceptance", |row| row.merge_acceptance);
    b.numbers("split_acceptance", |row| row.split_acceptance);
    b.numbers("burn_in_mean", |row| row.burn_in);
    b.numbers("n_sets", |row| row.n_sets);
    b.numbers("sd_n_sets", |row| row.sd_n_sets);
    b.numbers("n_detections", |row| row.n_detections);
    b.numbers("n_landmarks", |row| row.n_landmarks);
    b.numbers("map_frequency", |row| row.map_frequency);
    b.numbers("truth_mass", |row| row.truth_mass);
    b.numbers("adjusted_rand_index", |row| row.adjusted_rand_index);
    b.numbers("unknown_share", |row| row.unknown_share);
    b.numbers("n_unknown_merged", |row| row.n_unknown_merged);
    b.numbers("underflow_share", |row| row.underflow_share);
    b.numbers("estimate_sd", |row| Some(row.noise?.sd));
    b.numbers("estimate_sd_error", |row| Some(row.noise?.standard_error));
    b.texts("samples_verdict", |row| {
        Some(row.noise?.verdict().name().to_owned())
    });
    b.numbers("longest_hold_share", |row| row.longest_hold);
    b.counts("n_exact_compared", |row| Some(row.exact.n_compared as u64));
    b.counts("n_exact_undecided", |row| {
        Some(row.exact.n_undecided as u64)
    });
    b.counts("n_exact_differ", |row| Some(row.exact.n_differ as u64));
    b.numbers("exact_distance_largest", |row| row.exact.largest);
    b.numbers("exact_distance_high", |row| row.exact.high);
    b.texts("exact_reason", |row| row.exact.reason.clone());
    b.table
}

/// One row per topology among the most visited of each chain.
pub fn topologies_table(sweep: &Sweep, results: &SweepResults) -> Table {
    let rows: Vec<(&ChainResult, usize, &TopTopology)> = results
        .chains
        .iter()
        .filter_map(|chain| Some((chain, chain.outcome()?)))
        .flat_map(|(chain, outcome)| {
            outcome
                .top
                .iter()
                .enumerate()
                .map(move |(k, top)| (chain, k, top))
        })
        .collect();
    let mut b = Builder::new(rows, sweep);
    b.cell_columns(|row| row.0.cell, false);
    b.counts("world", |row| Some(row.0.replicate + 1));
    b.counts("chain", |row| Some(row.0.chain + 1));
    b.counts("rank", |row| Some(row.1 as u64 + 1));
    b.texts("labels", |row| Some(row.2.labels.clone()));
    b.counts("n_sets", |row| Some(row.2.n_sets));
    b.counts("count", |row| Some(row.2.count));
    b.numbers("frequency", |row| Some(row.2.frequency));
    b.flags("is_truth", |row| row.2.is_truth);
    b.table
}

/// Wall-clock seconds of the chains that were run now: never the same twice, so it stands apart.
pub fn timings_table(keys: &[String], seconds: &[Option<f64>]) -> Table {
    let run_now = || {
        keys.iter()
            .zip(seconds)
            .filter_map(|(key, seconds)| Some((key, (*seconds)?)))
    };
    let mut table = Table::default();
    table.push(
        "key",
        Values::Texts(run_now().map(|(key, _)| Some(key.clone())).collect()),
    );
    table.push(
        "seconds",
        Values::Numbers(run_now().map(|(_, seconds)| Some(seconds)).collect()),
    );
    table
}

/// The traces of `ptm sample`: one row for each stretch of proposals without a move.
pub fn trace_table(traces: &[&Trace]) -> Table {
    let rows: Vec<(u64, &Trace, &Run, u64)> = traces
        .iter()
        .copied()
        .zip(1..)
        .flat_map(|(trace, chain)| {
            trace
                .dwell_times(0)
                .map(move |(run, dwell)| (chain, trace, run, dwell))
        })
        .collect();
    let mut table = Table::default();
    table.push(
        "chain",
        Values::Counts(rows.iter().map(|row| Some(row.0)).collect()),
    );
    table.push(
        "first_proposal",
        Values::Counts(rows.iter().map(|row| Some(row.2.first_step)).collect()),
    );
    table.push(
        "n_proposals",
        Values::Counts(rows.iter().map(|row| Some(row.3)).collect()),
    );
    table.push(
        "n_sets",
        Values::Counts(
            rows.iter()
                .map(|row| Some(u64::from(row.2.n_sets)))
                .collect(),
        ),
    );
    table.push(
        "ln_target",
        Values::Numbers(rows.iter().map(|row| Some(row.2.ln_target)).collect()),
    );
    let labels = |row: &(u64, &Trace, &Run, u64)| {
        row.1
            .topologies
            .get(row.2.topology)
            .map(ToString::to_string)
    };
    table.push("labels", Values::Texts(rows.iter().map(labels).collect()));
    table
}
