//! Two sweeps on the same worlds: where do they differ by more than chance explains?
//!
//! Compared are the cells that both have; the others of each are counted. By setting and level the
//! differences have intervals and no test: they show where a difference comes from.
//!
//! Differences are B less A, world by world, so that hard and easy worlds cancel; intervals are
//! Student's over worlds (over the chain numbers of a single data set), and speak of new worlds; of
//! a share on which all worlds agree it is the widest that their number allows. **Tests.** Whether
//! a cell's recovery differs is asked of these worlds only ([`rate_difference`],
//! [`Scope::TheseWorlds`]): two programs that do not do the same on them differ, whatever new
//! worlds would give, and chains within worlds show it with few worlds. Everything else by
//! Student's law over worlds. Half of the level is spent on the means over all cells, by Holm; half
//! on single cells, by Benjamini & Hochberg, who bound the share of false findings among the cells
//! listed. So if nothing differs, something is found with a probability of at most the level.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use serde::Serialize;

use crate::diagnostics::interval::{Interval, of_units_that_agree};
use crate::diagnostics::multiplicity::{benjamini_hochberg, holm};
use crate::diagnostics::rate_difference::{Pairing, RateDifference, Scope, rate_difference};
use crate::diagnostics::student::{UnitMean, unit_mean};

/// What a sweep's tables say.
#[derive(Clone, Debug, Default)]
pub struct SweepTables {
    /// Its cells, in order.
    pub cells: Vec<ObservedCell>,
}

/// A cell.
#[derive(Clone, Debug)]
pub struct ObservedCell {
    /// Its number, as "c017".
    pub id: String,
    /// Its settings as texts.
    pub settings: BTreeMap<String, String>,
    /// Its worlds by their number.
    pub worlds: BTreeMap<u64, ObservedWorld>,
}

/// A cell on one world.
#[derive(Clone, Debug, Default)]
pub struct ObservedWorld {
    /// The detections, as their CSV has them.
    pub data: String,
    /// Chains that ran to their end.
    pub chains: Vec<ChainRow>,
    /// Chains that failed.
    pub n_failed: usize,
    /// Effective independent topologies of its chains.
    pub ess: Option<f64>,
    /// Whether its chains are shown to have converged.
    pub converged: bool,
}

/// A chain.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainRow {
    /// Its number.
    pub chain: u64,
    /// Whether its MAP topology is the truth.
    pub recovered: Option<bool>,
    /// Accepted over proposed.
    pub acceptance: Option<f64>,
    /// Mean of M.
    pub n_sets: Option<f64>,
}

/// What is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Share of chains that recover the truth.
    Recovery,
    /// Acceptance rate.
    Acceptance,
    /// Mean M.
    NSets,
    /// log₁₀ of the effective independent topologies of a world's chains.
    Log10Ess,
}

impl Measure {
    /// All.
    pub const ALL: [Self; 4] = [
        Self::Recovery,
        Self::Acceptance,
        Self::NSets,
        Self::Log10Ess,
    ];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Recovery => "recovery",
            Self::Acceptance => "acceptance",
            Self::NSets => "mean M",
            Self::Log10Ess => "log10 ESS",
        }
    }

    fn of_chain(self, chain: &ChainRow) -> Option<f64> {
        match self {
            Self::Recovery => chain.recovered.map(|r| f64::from(u8::from(r))),
            Self::Acceptance => chain.acceptance,
            Self::NSets => chain.n_sets,
            Self::Log10Ess => None,
        }
    }

    /// The mean on a world.
    fn on(self, world: &ObservedWorld) -> Option<f64> {
        if self == Self::Log10Ess {
            return world.ess.map(|ess| libm::log10(ess.max(1.0)));
        }
        let values: Vec<f64> = world
            .chains
            .iter()
            .filter_map(|c| self.of_chain(c))
            .collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }
}

/// A measure in both sweeps.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Difference {
    /// Which.
    pub measure: Measure,
    /// Mean over A's units.
    pub a: f64,
    /// Mean over B's.
    pub b: f64,
    /// Mean of B less A over the units that both have.
    pub difference: f64,
    /// Its 95 % interval; null for one unit, or if all agree on what has no bounds.
    pub interval: Option<(f64, f64)>,
    /// Units: worlds, or chain numbers on a single data set.
    pub n_units: usize,
    /// How the p-value was computed.
    pub test: &'static str,
    /// p-value of "no difference"; null where it cannot be had.
    pub p_value: Option<f64>,
    /// The same, adjusted for the others of its family.
    pub p_adjusted: Option<f64>,
    /// Whether it is found at the level.
    pub found: bool,
}

/// A cell in both sweeps.
#[derive(Clone, Debug, Serialize)]
pub struct CellComparison {
    /// Its number in A.
    pub a: String,
    /// Its number in B.
    pub b: String,
    /// The settings that tell it from other cells.
    pub settings: BTreeMap<String, String>,
    /// Whether every chain gave the same.
    pub identical: bool,
    /// Worlds that both have.
    pub n_worlds: usize,
    /// Of them, those on which A's and B's chains converged.
    pub n_converged: [usize; 2],
    /// What differs how much.
    pub differences: Vec<Difference>,
}

/// The difference of the recovery rates at one level of a setting.
#[derive(Clone, Debug, Serialize)]
pub struct LevelDifference {
    /// The setting.
    pub setting: String,
    /// The level.
    pub level: String,
    /// Cells at it that both sweeps have.
    pub n_cells: usize,
    /// The difference, a mean over those cells on each unit.
    pub difference: Difference,
}

/// Two sweeps compared.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Probability of finding anything if nothing differs, at most.
    pub level: f64,
    /// What units are: worlds or chain numbers.
    pub units: &'static str,
    /// Settings that all cells of A and all of B have at different values, with the values.
    pub settings_that_differ: BTreeMap<String, [String; 2]>,
    /// Worlds that are compared, in the cell that has the most.
    pub n_worlds: usize,
    /// Chains that ran to their end, and that failed, in A and in B.
    pub n_chains: [usize; 2],
    /// See there.
    pub n_failed: [usize; 2],
    /// Cells whose every chain gave the same.
    pub n_identical: usize,
    /// Cells that only A has, and that only B has.
    pub n_alone: [usize; 2],
    /// Means over all cells, adjusted by Holm.
    pub overall: Vec<Difference>,
    /// The recovery rate by the levels of each setting that varies; not tested.
    pub by_level: Vec<LevelDifference>,
    /// Cell by cell, adjusted by Benjamini & Hochberg.
    pub cells: Vec<CellComparison>,
    /// Whether anything was found.
    pub differs: bool,
}

/// Why two sweeps cannot be compared: one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Incompatible(pub String);

/// Compares B with A at a level.
///
/// # Errors
/// Sweeps without a cell in common, or on different data.
pub fn compare(a: &SweepTables, b: &SweepTables, level: f64) -> Result<Comparison, Incompatible> {
    let varying: BTreeSet<String> = varying(a).into_iter().chain(varying(b)).collect();
    let (pairs, n_alone) = matched(a, b, &varying)?;
    for (a, b) in &pairs {
        same_data(a, b)?;
    }
    let n_worlds = pairs
        .iter()
        .map(|(a, b)| common(a, b).count())
        .max()
        .unwrap_or(0);
    let by_world = n_worlds > 1;
    let mut cells: Vec<CellComparison> = (pairs.iter())
        .map(|(a, b)| compare_cell(a, b, &varying, by_world))
        .collect();
    let mut overall: Vec<Difference> = (Measure::ALL.into_iter())
        .filter_map(|measure| overall(&pairs, measure, by_world))
        .collect();
    adjust(overall.iter_mut().collect(), holm, level / 2.0);
    let of_cells = cells.iter_mut().flat_map(|cell| &mut cell.differences);
    adjust(of_cells.collect(), benjamini_hochberg, level / 2.0);
    let differs = overall.iter().any(|row| row.found)
        || cells
            .iter()
            .flat_map(|cell| &cell.differences)
            .any(|row| row.found);
    let count = |of: fn(&ObservedWorld) -> usize| {
        let sum = |tables: &SweepTables| {
            let worlds = tables.cells.iter().flat_map(|cell| cell.worlds.values());
            worlds.map(of).sum()
        };
        [sum(a), sum(b)]
    };
    Ok(Comparison {
        level,
        units: if by_world { "worlds" } else { "chain numbers" },
        settings_that_differ: settings_that_differ(&pairs, &varying),
        n_worlds,
        n_chains: count(|world| world.chains.len()),
        n_failed: count(|world| world.n_failed),
        n_identical: cells.iter().filter(|cell| cell.identical).count(),
        n_alone,
        by_level: by_level(&pairs, &varying, by_world),
        overall,
        cells,
        differs,
    })
}

type Pair<'a> = (&'a ObservedCell, &'a ObservedCell);

/// Settings that differ between the cells of a sweep.
fn varying(tables: &SweepTables) -> BTreeSet<String> {
    let Some(first) = tables.cells.first() else {
        return BTreeSet::new();
    };
    let differs = |name: &&String| {
        let value = first.settings.get(*name);
        tables
            .cells
            .iter()
            .any(|cell| cell.settings.get(*name) != value)
    };
    first.settings.keys().filter(differs).cloned().collect()
}

fn own_settings(cell: &ObservedCell, varying: &BTreeSet<String>) -> BTreeMap<String, String> {
    let is_own = |(name, _): &(&String, &String)| varying.contains(*name);
    let own = cell.settings.iter().filter(is_own);
    own.map(|(name, value)| (name.clone(), value.clone()))
        .collect()
}

/// Each cell of A with the cell of B that has the same of what varies; several of the same settings
/// in order. Beside them how many cells of A and of B have no partner.
fn matched<'a>(
    a: &'a SweepTables,
    b: &'a SweepTables,
    varying: &BTreeSet<String>,
) -> Result<(Vec<Pair<'a>>, [usize; 2]), Incompatible> {
    let mut of_b: HashMap<BTreeMap<String, String>, Vec<&ObservedCell>> = HashMap::new();
    for cell in b.cells.iter().rev() {
        of_b.entry(own_settings(cell, varying))
            .or_default()
            .push(cell);
    }
    let partner = |cell: &'a ObservedCell| {
        let others = of_b.get_mut(&own_settings(cell, varying))?;
        Some((cell, others.pop()?))
    };
    let pairs: Vec<Pair<'_>> = a.cells.iter().filter_map(partner).collect();
    let n_alone = [a.cells.len() - pairs.len(), b.cells.len() - pairs.len()];
    if !pairs.is_empty() {
        return Ok((pairs, n_alone));
    }
    let first = |tables: &SweepTables| {
        tables.cells.first().map_or_else(String::new, |cell| {
            let own = own_settings(cell, varying);
            let parts = own.iter().map(|(name, value)| format!("{name} {value}"));
            let parts: Vec<String> = parts.collect();
            format!(" ({} is {})", cell.id, parts.join(", "))
        })
    };
    Err(Incompatible(format!(
        "got no cell in common among {} of A{} and {} of B{}, expected at least one; give both a \
         cell of the same settings",
        a.cells.len(),
        first(a),
        b.cells.len(),
        first(b)
    )))
}

/// The worlds that both cells have, with their numbers.
fn common<'a>(
    a: &'a ObservedCell,
    b: &'a ObservedCell,
) -> impl Iterator<Item = (u64, &'a ObservedWorld, &'a ObservedWorld)> {
    let with_other =
        |(number, own): (&u64, &'a ObservedWorld)| Some((*number, own, b.worlds.get(number)?));
    a.worlds.iter().filter_map(with_other)
}

fn same_data(a: &ObservedCell, b: &ObservedCell) -> Result<(), Incompatible> {
    let both = format!("cell {} of A and {} of B", a.id, b.id);
    if common(a, b).next().is_none() {
        return Err(Incompatible(format!(
            "{both}: got no world in common, expected at least one; run both to their end"
        )));
    }
    match common(a, b).find(|(_, of_a, of_b)| of_a.data != of_b.data) {
        Some((number, ..)) => Err(Incompatible(format!(
            "{both}: got different detections on world {number}, expected the same; give both the same seed, \
             world and settings of it"
        ))),
        None => Ok(()),
    }
}

fn settings_that_differ(
    pairs: &[Pair<'_>],
    varying: &BTreeSet<String>,
) -> BTreeMap<String, [String; 2]> {
    let Some((a, b)) = pairs.first() else {
        return BTreeMap::new();
    };
    let names: BTreeSet<&String> = a.settings.keys().chain(b.settings.keys()).collect();
    let differing = names.into_iter().filter(|name| !varying.contains(*name));
    let value =
        |cell: &ObservedCell, name: &String| cell.settings.get(name).cloned().unwrap_or_default();
    differing
        .map(|name| (name.clone(), [value(a, name), value(b, name)]))
        .filter(|(_, [a, b])| a != b)
        .collect()
}

/// (A, B) of a measure by unit, for those that both have.
fn by_unit(
    a: &ObservedCell,
    b: &ObservedCell,
    measure: Measure,
    by_world: bool,
) -> BTreeMap<u64, (f64, f64)> {
    let mut units = BTreeMap::new();
    for (number, of_a, of_b) in common(a, b) {
        if by_world || measure == Measure::Log10Ess {
            if let (Some(x), Some(y)) = (measure.on(of_a), measure.on(of_b)) {
                units.insert(number, (x, y));
            }
            continue;
        }
        for chain in &of_a.chains {
            let other = of_b.chains.iter().find(|other| other.chain == chain.chain);
            let values = (
                measure.of_chain(chain),
                other.and_then(|c| measure.of_chain(c)),
            );
            if let (Some(x), Some(y)) = values {
                units.insert(chain.chain, (x, y));
            }
        }
    }
    units
}

fn difference(measure: Measure, units: &[(f64, f64)]) -> Option<Difference> {
    let differences: Vec<f64> = units.iter().map(|(a, b)| b - a).collect();
    let UnitMean {
        mean,
        interval,
        p_value,
        n,
        standard_error,
    } = unit_mean(&differences)?;
    let is_share = matches!(measure, Measure::Recovery | Measure::Acceptance);
    let most = if is_share { 1.0 } else { f64::INFINITY };
    let agree = is_share && standard_error == Some(0.0);
    let range = Interval {
        low: -most,
        high: most,
    };
    let interval = interval.or_else(|| of_units_that_agree(mean, n, range).filter(|_| agree));
    let average = |of: fn(&(f64, f64)) -> f64| units.iter().map(of).sum::<f64>() / n as f64;
    Some(Difference {
        measure,
        a: average(|unit| unit.0),
        b: average(|unit| unit.1),
        difference: mean,
        interval: interval.map(|i| (i.low.max(-most), i.high.min(most))),
        n_units: n,
        test: if standard_error == Some(0.0) {
            "sign test over units that agree"
        } else {
            "Student over units"
        },
        p_value,
        p_adjusted: None,
        found: false,
    })
}

fn compare_cell(
    a: &ObservedCell,
    b: &ObservedCell,
    varying: &BTreeSet<String>,
    by_world: bool,
) -> CellComparison {
    let of = |measure: Measure| {
        let units: Vec<(f64, f64)> = by_unit(a, b, measure, by_world).into_values().collect();
        let mut found = difference(measure, &units)?;
        if measure == Measure::Recovery {
            let test = recovery_test(a, b, by_world)?;
            found.p_value = Some(test.p_value);
            found.test = test.test.words();
        }
        Some(found)
    };
    let n_converged = |of: fn((u64, &ObservedWorld, &ObservedWorld)) -> bool| {
        common(a, b).filter(|row| of(*row)).count()
    };
    CellComparison {
        a: a.id.clone(),
        b: b.id.clone(),
        settings: own_settings(a, varying),
        identical: common(a, b).all(|(_, a, b)| (&a.chains, a.n_failed) == (&b.chains, b.n_failed)),
        n_worlds: common(a, b).count(),
        n_converged: [
            n_converged(|(_, a, _)| a.converged),
            n_converged(|(_, _, b)| b.converged),
        ],
        differences: Measure::ALL.into_iter().filter_map(of).collect(),
    }
}

/// Whether chains recover as often on the worlds that both have.
fn recovery_test(a: &ObservedCell, b: &ObservedCell, by_world: bool) -> Option<RateDifference> {
    let outcomes = |world: &ObservedWorld| -> Vec<bool> {
        let known = world.chains.iter().filter_map(|chain| chain.recovered);
        known.collect()
    };
    let (of_a, of_b): (Vec<Vec<bool>>, Vec<Vec<bool>>) = common(a, b)
        .map(|(_, of_a, of_b)| (outcomes(of_a), outcomes(of_b)))
        .unzip();
    let pairing = if by_world {
        Pairing::SameWorlds
    } else {
        Pairing::OneDataSet
    };
    rate_difference(&of_a, &of_b, pairing, Scope::TheseWorlds)
}

/// Over all cells: a unit's value is the mean over the cells that have it.
fn overall(pairs: &[Pair<'_>], measure: Measure, by_world: bool) -> Option<Difference> {
    let mut sums: BTreeMap<u64, (f64, f64, f64)> = BTreeMap::new();
    for (a, b) in pairs {
        for (unit, (x, y)) in by_unit(a, b, measure, by_world) {
            let sum = sums.entry(unit).or_insert((0.0, 0.0, 0.0));
            *sum = (sum.0 + x, sum.1 + y, sum.2 + 1.0);
        }
    }
    let units: Vec<(f64, f64)> = sums.values().map(|(x, y, n)| (x / n, y / n)).collect();
    difference(measure, &units)
}

/// The difference of the recovery rates by the levels of each setting that varies.
fn by_level(
    pairs: &[Pair<'_>],
    varying: &BTreeSet<String>,
    by_world: bool,
) -> Vec<LevelDifference> {
    let of_setting = |setting: &String| {
        let mut at: BTreeMap<&str, Vec<Pair<'_>>> = BTreeMap::new();
        for pair in pairs {
            let level = pair.0.settings.get(setting).map_or("", String::as_str);
            at.entry(level).or_default().push(*pair);
        }
        let mut levels: Vec<(&str, Vec<Pair<'_>>)> = at.into_iter().collect();
        levels.sort_by(|a, b| level_order(a.0, b.0));
        levels.retain(|(level, _)| !level.is_empty());
        let is_one = levels.len() < 2;
        let of_level = |(level, own): (&str, Vec<Pair<'_>>)| {
            Some(LevelDifference {
                setting: setting.clone(),
                level: level.to_owned(),
                n_cells: own.len(),
                difference: overall(&own, Measure::Recovery, by_world)?,
            })
        };
        let found = levels.into_iter().filter_map(of_level);
        found.filter(|_| !is_one).collect::<Vec<_>>()
    };
    varying.iter().flat_map(of_setting).collect()
}

/// Numbers by their size, the rest by the alphabet.
pub fn level_order(a: &str, b: &str) -> std::cmp::Ordering {
    match (a.parse::<f64>(), b.parse::<f64>()) {
        (Ok(a), Ok(b)) => a.total_cmp(&b),
        _ => a.cmp(b),
    }
}

fn adjust(rows: Vec<&mut Difference>, how: fn(&[f64]) -> Vec<f64>, level: f64) {
    let known: Vec<f64> = rows.iter().filter_map(|row| row.p_value).collect();
    let mut adjusted = how(&known).into_iter();
    for row in rows {
        if row.p_value.is_some() {
            row.p_adjusted = adjusted.next();
            row.found = row.p_adjusted.is_some_and(|p| p <= level);
        }
    }
}

#[cfg(test)]
#[path = "compare_tests.rs"]
mod tests;
