//! Exact posteriors for small data sets, and how far a chain is from them.
//!
//! One table for each data set under each model and prior, shared by all cells and chains that have
//! them; a function of these and the seed, so that a run that is continued makes the same table.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Plan, Task};
use crate::chain::Trace;
use crate::dataset::DataSet;
use crate::diagnostics::exact_distance::{
    LEAST_EFFECTIVE, at_least, effective_sample_size, null, total_variation,
};
use crate::exact::{Budget, affordable};
use crate::partition::Topology;
use crate::rng::{Purpose, SAMPLER_SEMANTICS};
use crate::settings::{Section, Settings};
use crate::sweep::Sweep;

/// Topologies whose indicators the effective sample size is of.
const N_INDICATORS: usize = 5;

/// The distance of a chain to the exact posterior, or why there is none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExactComparison {
    /// It was compared.
    Compared(ExactDistance),
    /// It was not.
    Not {
        /// Why.
        reason: String,
    },
}

/// Total variation between a chain's frequencies after burn-in and the exact posterior.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExactDistance {
    /// The distance.
    pub total_variation: f64,
    /// Estimated total variation between the table and the posterior itself.
    pub table_error: f64,
    /// The chain's effective sample size; `None` if it stood still or is too short to tell.
    pub effective_samples: Option<f64>,
    /// Mean distance of a correct chain of that size (of the least that it may be), the table's error not
    /// counted; `None` if the size is unknown or too small to be believed.
    pub expected: Option<f64>,
    /// What a correct chain stays below 999 times in 1,000, the table's error counted in.
    pub high: Option<f64>,
    /// The likeliest topologies by the table, by falling probability.
    pub top: Vec<PosteriorTopology>,
    /// What a verdict compares: every topology of mass .05 or more, by falling mass, then
    /// every pair of detections. The same list for every chain on one data set.
    pub quantities: Vec<ExactQuantity>,
}

/// A topology and its probability.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PosteriorTopology {
    /// Canonical labels, as in `0,0,1`.
    pub labels: String,
    /// M.
    pub n_sets: u64,
    /// Its probability.
    pub probability: f64,
    /// Whether it is the truth; `None` if no truth is known.
    pub is_truth: Option<bool>,
}

/// Topologies kept of a table.
const N_TOP: usize = 10;

/// A topology of less mass is not compared by itself.
const LEAST_MASS: f64 = 0.05;

/// The probability of one event: that the chain stands at a topology, or that a pair shares a set.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExactQuantity {
    /// By the table.
    pub exact: f64,
    /// Share of the chain's draws after burn-in.
    pub sampled: f64,
}

impl ExactDistance {
    /// Whether the chain is not drawn from the posterior; `None` if that cannot be told.
    pub fn differs(&self) -> Option<bool> {
        self.high.map(|high| self.total_variation > high)
    }
}

/// An exact posterior: topologies by falling probability.
pub struct ExactTable {
    by_rank: Vec<(Topology, f64)>,
    error: f64,
}

/// The tables of a sweep, by what they are of; or why one is not to be had.
pub type ExactTables = HashMap<[u8; 32], Result<ExactTable, String>>;

/// What the random numbers of an exact posterior come from, and its identity.
pub fn exact_purpose(settings: &Settings, data: &DataSet) -> Purpose {
    let model = settings.identity_text(|key| key.section == Section::Model);
    Purpose::new(SAMPLER_SEMANTICS, settings.count("seed"))
        .text("use", "exact")
        .text("settings", &model)
        .text("data", &data.sampled_hash(settings))
}

/// Whether the chains on these data are compared.
fn is_small(settings: &Settings, data: &DataSet) -> bool {
    data.detections.len() as u64 <= settings.count("exact_up_to")
}

/// The table of one data set, if it is small: some seconds of computing.
pub fn tables_of_one(settings: &Settings, data: &DataSet) -> ExactTables {
    let mut tables = ExactTables::new();
    if is_small(settings, data) {
        let key = exact_purpose(settings, data).key();
        tables.insert(key, isolated_table(settings, data));
    }
    tables
}

fn isolated_table(settings: &Settings, data: &DataSet) -> Result<ExactTable, String> {
    super::isolated(|| table(settings, data)).unwrap_or_else(|panic| Err(format!("panic: {panic}")))
}

/// The tables that these tasks need.
pub fn exact_tables(sweep: &Sweep, plan: &Plan, tasks: &[&Task], stop: &AtomicBool) -> ExactTables {
    let mut wanted = HashMap::new();
    for task in tasks {
        let settings = plan.settings(sweep, task);
        if let Ok(data) = plan.data(task)
            && is_small(settings, data)
        {
            let key = exact_purpose(settings, data).key();
            wanted.entry(key).or_insert((settings, data));
        }
    }
    let made = wanted
        .into_par_iter()
        .filter_map(|(key, (settings, data))| {
            (!stop.load(Ordering::Relaxed)).then(|| (key, isolated_table(settings, data)))
        });
    made.collect()
}

fn table(settings: &Settings, data: &DataSet) -> Result<ExactTable, String> {
    let model = data.model(settings).map_err(|error| error.to_string())?;
    let purpose = exact_purpose(settings, data);
    let budget = Budget {
        max_detections: settings.count("exact_up_to") as usize,
        ..Budget::default()
    };
    let posterior = affordable(&model, settings.prior(), &budget, &purpose)
        .map_err(|error| error.to_string())?;
    let error = posterior.error.total();
    let rows = posterior.topologies.into_iter();
    let by_rank: Vec<(Topology, f64)> = rows.map(|row| (row.topology, row.probability)).collect();
    Ok(ExactTable { by_rank, error })
}

/// The distance of a chain, after so many proposals of burn-in.
pub fn compare(
    tables: &ExactTables,
    trace: &Trace,
    burn_in: u64,
    settings: &Settings,
    data: &DataSet,
    chain: &Purpose,
) -> ExactComparison {
    let not = |reason: String| ExactComparison::Not { reason };
    if !is_small(settings, data) {
        let most = settings.count("exact_up_to");
        return not(format!(
            "{} detections, and exact_up_to is {most}",
            data.detections.len()
        ));
    }
    let table = match tables.get(&exact_purpose(settings, data).key()) {
        Some(Ok(table)) => table,
        Some(Err(reason)) => return not(reason.clone()),
        None => return not("the exact posterior was not computed".to_owned()),
    };
    let n = (trace.n_steps - burn_in) as f64;
    let counts: HashMap<Topology, u64> = trace
        .frequencies(burn_in)
        .into_iter()
        .map(|row| (row.topology, row.count))
        .collect();
    let shares = table.by_rank.iter().map(|(topology, probability)| {
        let count = counts.get(topology).copied().unwrap_or(0);
        (count as f64 / n, *probability)
    });
    let total_variation = total_variation(shares);
    let effective_samples = effective_samples(trace, burn_in, table);
    let probabilities: Vec<f64> = table.by_rank.iter().map(|row| row.1).collect();
    let known = effective_samples.filter(|&effective| effective >= LEAST_EFFECTIVE);
    let null = known.map(|effective| {
        let mut rng = chain.clone().text("use", "exact null").generator();
        null(&probabilities, at_least(effective), &mut rng)
    });
    ExactComparison::Compared(ExactDistance {
        total_variation,
        table_error: table.error,
        effective_samples,
        expected: null.map(|null| null.mean),
        high: null.map(|null| null.high + table.error),
        top: top(table, data),
        quantities: quantities(table, &counts, n),
    })
}

fn top(table: &ExactTable, data: &DataSet) -> Vec<PosteriorTopology> {
    let truth = data.truth.as_ref();
    let rows = table.by_rank.iter().take(N_TOP);
    rows.map(|(topology, probability)| PosteriorTopology {
        labels: topology.to_string(),
        n_sets: topology.n_sets() as u64,
        probability: *probability,
        is_truth: truth.map(|truth| truth.is_recovered_by(topology)),
    })
    .collect()
}

fn quantities(table: &ExactTable, counts: &HashMap<Topology, u64>, n: f64) -> Vec<ExactQuantity> {
    let likely = table
        .by_rank
        .iter()
        .take_while(|(_, mass)| *mass >= LEAST_MASS);
    let of_topology = |(topology, mass): &(Topology, f64)| ExactQuantity {
        exact: *mass,
        sampled: counts.get(topology).map_or(0.0, |count| *count as f64 / n),
    };
    let mut quantities: Vec<ExactQuantity> = likely.map(of_topology).collect();
    let n_detections = table
        .by_rank
        .first()
        .map_or(0, |(topology, _)| topology.labels().len());
    let pairs = (0..n_detections).flat_map(|i| (i + 1..n_detections).map(move |j| (i, j)));
    quantities.extend(pairs.map(|(i, j)| {
        let is_together = |topology: &Topology| topology.labels()[i] == topology.labels()[j];
        let exact = table
            .by_rank
            .iter()
            .filter(|(topology, _)| is_together(topology));
        let sampled = counts.iter().filter(|(topology, _)| is_together(topology));
        ExactQuantity {
            exact: exact.map(|(_, mass)| mass).sum(),
            sampled: sampled.map(|(_, count)| *count as f64).sum::<f64>() / n,
        }
    }));
    quantities
}

/// The smallest over M and the indicators of the likeliest topologies that the chain moved in and out of.
fn effective_samples(trace: &Trace, burn_in: u64, table: &ExactTable) -> Option<f64> {
    let after = |series: Vec<f64>| effective_sample_size(&series[burn_in as usize..]);
    let of_n_sets = after(trace.expand(|run| f64::from(run.n_sets)));
    let likeliest = table.by_rank.iter().take(N_INDICATORS);
    let of_indicators = likeliest.filter_map(|(topology, _)| {
        after(trace.expand(|run| f64::from(trace.topologies.get(run.topology) == Some(topology))))
    });
    of_n_sets.into_iter().chain(of_indicators).reduce(f64::min)
}
