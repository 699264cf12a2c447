//! The tables of what settings do: `effects`, `contrasts`, `interactions` and `indices`.

use super::{Table, Values};
use crate::results::sensitivity::{
    Contrast, FactorIndices, Gate, Indices, LevelEffect, PairCell, Sensitivity, UnitMean,
};

/// All that have a row, by name.
pub fn sensitivity_tables(found: &Sensitivity) -> Vec<(&'static str, Table)> {
    let mut tables = vec![
        ("effects", effects(found)),
        ("contrasts", contrasts(found)),
        ("interactions", interactions(found)),
    ];
    tables.extend(found.indices.as_ref().map(|own| ("indices", indices(own))));
    tables.retain(|(_, table)| table.n_rows() > 0);
    tables
}

/// Columns under construction from rows of one type.
struct Columns<'a, R> {
    rows: &'a [R],
    table: Table,
}

impl<R> Columns<'_, R> {
    fn texts(&mut self, name: &str, value: impl Fn(&R) -> Option<String>) {
        let values = self.rows.iter().map(value).collect();
        self.table.push(name, Values::Texts(values));
    }

    fn numbers(&mut self, name: &str, value: impl Fn(&R) -> Option<f64>) {
        let values = self.rows.iter().map(value).collect();
        self.table.push(name, Values::Numbers(values));
    }

    fn counts(&mut self, name: &str, value: impl Fn(&R) -> Option<u64>) {
        let values = self.rows.iter().map(value).collect();
        self.table.push(name, Values::Counts(values));
    }

    fn gate(&mut self, gate: fn(&R) -> &Gate) {
        self.counts("n_cells", |row| Some(gate(row).n_cells as u64));
        self.counts("n_worlds_judged", |row| Some(gate(row).n_judged as u64));
        self.counts("n_worlds_converged", |row| {
            Some(gate(row).n_converged as u64)
        });
        self.numbers("converged_share", |row| gate(row).converged_share());
        self.counts("n_chains_planned", |row| Some(gate(row).n_planned as u64));
        self.counts("n_chains_failed", |row| Some(gate(row).n_failed as u64));
        self.counts("n_chains_missing", |row| Some(gate(row).n_missing as u64));
    }

    /// An estimate under names that begin with `name`, with what its interval rests on.
    fn estimate(&mut self, name: &str, found: &Sensitivity, of: fn(&R) -> Option<UnitMean>) {
        self.numbers(name, |row| Some(of(row)?.mean));
        self.numbers(&format!("{name}_low"), |row| Some(of(row)?.interval?.low));
        self.numbers(&format!("{name}_high"), |row| Some(of(row)?.interval?.high));
        self.texts(&format!("{name}_interval"), |row| {
            Some(interval_words(of(row), found).to_owned())
        });
    }
}

/// How an interval was had, or why there is none.
fn interval_words(estimate: Option<UnitMean>, found: &Sensitivity) -> &'static str {
    match estimate {
        None => "no-value",
        Some(UnitMean {
            interval: Some(_),
            standard_error: Some(0.0),
            ..
        }) => "all agree, any law",
        Some(UnitMean {
            interval: Some(_), ..
        }) => match (found.over_worlds, found.is_sampled) {
            (true, false) => "Student over worlds",
            (true, true) => "Student over worlds and points",
            (false, false) => "Student over chain numbers",
            (false, true) => "Student over chain numbers and points",
        },
        Some(UnitMean { n: 1, .. }) => "one-unit",
        Some(_) => "all-agree",
    }
}

fn effects(found: &Sensitivity) -> Table {
    let mut b = Columns {
        rows: &found.levels[..],
        table: Table::default(),
    };
    b.texts("response", |row| Some(row.response.name().to_owned()));
    b.texts("factor", |row| {
        Some(found.factors[row.factor].key.name.to_owned())
    });
    b.texts("level", |row| {
        Some(found.factors[row.factor].labels[row.level].clone())
    });
    b.estimate("mean", found, |row: &LevelEffect| row.estimate);
    b.counts("n_units", |row| Some(row.estimate?.n as u64));
    b.gate(|row| &row.gate);
    b.table
}

fn contrasts(found: &Sensitivity) -> Table {
    let mut b = Columns {
        rows: &found.contrasts[..],
        table: Table::default(),
    };
    let level = |row: &Contrast, level: usize| found.factors[row.factor].labels[level].clone();
    b.texts("response", |row| Some(row.response.name().to_owned()));
    b.texts("factor", |row| {
        Some(found.factors[row.factor].key.name.to_owned())
    });
    b.texts("from", |row| Some(level(row, row.from)));
    b.texts("to", |row| Some(level(row, row.to)));
    b.estimate("difference", found, |row: &Contrast| row.estimate);
    b.numbers("p_value", |row| row.estimate?.p_value);
    b.numbers("p_holm", |row| row.p_holm);
    b.counts("n_units", |row| Some(row.estimate?.n as u64));
    b.table
}

fn interactions(found: &Sensitivity) -> Table {
    let mut b = Columns {
        rows: &found.pairs[..],
        table: Table::default(),
    };
    let name = |factor: usize| Some(found.factors[factor].key.name.to_owned());
    let label = |factor: usize, level: usize| Some(found.factors[factor].labels[level].clone());
    b.texts("response", |row| Some(row.response.name().to_owned()));
    b.texts("factor_a", |row| name(row.factors.0));
    b.texts("level_a", |row| label(row.factors.0, row.levels.0));
    b.texts("factor_b", |row| name(row.factors.1));
    b.texts("level_b", |row| label(row.factors.1, row.levels.1));
    b.estimate("mean", found, |row: &PairCell| row.estimate);
    b.estimate("interaction", found, |row: &PairCell| row.interaction);
    b.numbers("p_value", |row| row.interaction?.p_value);
    b.numbers("p_holm", |row| row.p_holm);
    b.counts("n_units", |row| Some(row.estimate?.n as u64));
    b.gate(|row| &row.gate);
    b.table
}

/// One number of one factor, or of the design as a whole.
struct IndexRow {
    response: &'static str,
    factor: String,
    index: &'static str,
    value: Option<f64>,
    low: Option<f64>,
    high: Option<f64>,
    state: &'static str,
    n_points: usize,
    n_left_out: usize,
    n_units: usize,
}

fn indices(found: &Indices) -> Table {
    let rows = match &found.by_response {
        FactorIndices::Morris(_) => morris_rows(found),
        FactorIndices::Sobol(_) => sobol_rows(found),
    };
    let mut b = Columns {
        rows: &rows[..],
        table: Table::default(),
    };
    b.texts("response", |row| Some(row.response.to_owned()));
    b.texts("factor", |row| Some(row.factor.clone()));
    b.texts("index", |row| Some(row.index.to_owned()));
    b.numbers("value", |row| row.value);
    b.numbers("low", |row| row.low);
    b.numbers("high", |row| row.high);
    b.texts("state", |row| Some(row.state.to_owned()));
    b.counts("n_points", |row| Some(row.n_points as u64));
    b.counts("n_left_out", |row| Some(row.n_left_out as u64));
    b.counts("n_units", |row| Some(row.n_units as u64));
    b.table
}

/// What a number is, if it is there; noise cannot be told apart in one world.
fn state(has_value: bool, n_units: usize) -> &'static str {
    match (has_value, n_units) {
        (true, 1) => "noise-counted-in",
        (true, _) => "defined",
        (false, 1) => "one-world",
        (false, _) => "too-few",
    }
}

fn morris_rows(found: &Indices) -> Vec<IndexRow> {
    let FactorIndices::Morris(by_response) = &found.by_response else {
        return Vec::new();
    };
    let mut rows = Vec::new();
    for (response, by_factor) in by_response {
        for (key, own) in found.factors.iter().zip(by_factor) {
            let screened = own.screening;
            let (n, n_units) = screened.map_or((0, 0), |s| (s.n_trajectories, s.n_units));
            let numbers = [
                (
                    "mu_star",
                    screened.map(|s| s.mu_star),
                    screened.and_then(|s| s.mu_star_interval),
                ),
                (
                    "mu",
                    screened.map(|s| s.mu),
                    screened.and_then(|s| s.mu_interval),
                ),
                (
                    "sigma",
                    screened.map(|s| s.sigma),
                    screened.and_then(|s| s.sigma_interval),
                ),
                (
                    "mu_star_of_noise",
                    screened.and_then(|s| s.mu_star_of_noise),
                    None,
                ),
            ];
            for (index, value, interval) in numbers {
                rows.push(IndexRow {
                    response: response.name(),
                    factor: key.name.to_owned(),
                    index,
                    value,
                    low: interval.map(|interval| interval.low),
                    high: interval.map(|interval| interval.high),
                    state: state(value.is_some(), n_units),
                    n_points: n,
                    n_left_out: own.n_left_out,
                    n_units,
                });
            }
        }
    }
    rows
}

fn sobol_rows(found: &Indices) -> Vec<IndexRow> {
    let FactorIndices::Sobol(by_response) = &found.by_response else {
        return Vec::new();
    };
    let mut rows = Vec::new();
    for (response, n_left_out, own) in by_response {
        let mut push =
            |factor: &str, index, value: Option<f64>, interval: Option<(f64, f64)>, word| {
                let (n_points, n_units) = own
                    .as_ref()
                    .map_or((0, 0), |own| (own.n_points, own.n_units));
                rows.push(IndexRow {
                    response: response.name(),
                    factor: factor.to_owned(),
                    index,
                    value,
                    low: interval.map(|interval| interval.0),
                    high: interval.map(|interval| interval.1),
                    state: word,
                    n_points,
                    n_left_out: *n_left_out,
                    n_units,
                });
            };
        let own = match own {
            Ok(own) => own,
            Err(reason) => {
                for key in &found.factors {
                    push(key.name, "first", None, None, reason.name());
                    push(key.name, "total", None, None, reason.name());
                }
                continue;
            }
        };
        for (place, key) in found.factors.iter().enumerate() {
            for (index, of) in [("first", own.first[place]), ("total", own.total[place])] {
                let interval = of.interval.map(|interval| (interval.low, interval.high));
                push(
                    key.name,
                    index,
                    Some(of.value),
                    interval,
                    state(true, own.n_units),
                );
            }
        }
        let variance = own.variance;
        let interval = variance
            .interval
            .map(|interval| (interval.low, interval.high));
        push(
            "",
            "variance",
            Some(variance.value),
            interval,
            state(true, own.n_units),
        );
        for (index, value) in [
            ("variance_of_worlds", own.variance_of_worlds),
            ("variance_of_noise", own.variance_of_noise),
        ] {
            let word = state(value.is_some(), own.n_units);
            push(
                "",
                index,
                value,
                None,
                if value.is_some() { "defined" } else { word },
            );
        }
    }
    rows
}
