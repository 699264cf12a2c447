//! The posterior by enumeration of every set partition: what chains are checked against.
//!
//! ln π(T) = ln P(T) + Σ_S ln ∫exp(−E_S) + ln E[exp(−Pen)], the first two without noise and the last by
//! Monte Carlo with exact draws of X from exp(−E). Bell(N) partitions: for small N only.
//!
//! [`posterior`] draws until the whole table is known to a tolerance: `table` cuts partitions into groups
//! of sets, `rounds` draws, `error` says where it stands. [`affordable`] does so within a budget, or says
//! that it is too expensive. [`enumerate`] gives every partition as many
//! draws, without any cut, and checks it.

mod affordable;
mod anneal;
mod bounds;
mod error;
mod group;
mod rounds;
mod table;
mod weights;

pub use affordable::{Budget, TooExpensive, affordable};
pub use error::TableError;
pub use group::TRUSTED;
pub use weights::WeightSums;

use std::sync::atomic::AtomicBool;

use rand::Rng;

use crate::model::{Draws, Model, Prior};
use crate::partition::{Partition, Partitions, Topology};
use crate::rng::Purpose;

/// Most detections without being asked for more: Bell(10) = 115,975.
pub const MAX_DETECTIONS: usize = 10;
/// Most detections at all: Bell(12) = 4,213,597, a few gigabytes.
pub const MAX_DETECTIONS_LARGE: usize = 12;

/// How exact.
#[derive(Clone, Copy, Debug)]
pub struct ExactSettings {
    /// Total variation at which the table is good enough.
    pub tolerance: f64,
    /// Draws of locations, over all groups of sets, after which it has to be.
    pub max_draws: f64,
}

impl Default for ExactSettings {
    fn default() -> Self {
        Self {
            tolerance: 0.002,
            max_draws: 2e9,
        }
    }
}

/// The posterior over all partitions.
#[derive(Clone, Debug)]
pub struct Posterior {
    /// By falling probability, then by labels.
    pub topologies: Vec<ExactTopology>,
    /// Estimated total variation between this table and the posterior, by its parts.
    pub error: TableError,
    /// How drawing ended.
    pub ended: Ended,
    /// Draws of locations, over all groups of sets.
    pub n_draws: f64,
}

impl Posterior {
    /// E\[M\].
    pub fn expected_n_sets(&self) -> f64 {
        let rows = self.topologies.iter();
        rows.map(|row| row.probability * row.topology.n_sets() as f64)
            .sum()
    }

    /// N×N: the probability that i and j share a set.
    pub fn co_clustering(&self) -> Vec<Vec<f64>> {
        let n = self
            .topologies
            .first()
            .map_or(0, |row| row.topology.labels().len());
        let mut matrix = vec![vec![0.0; n]; n];
        for row in &self.topologies {
            let labels = row.topology.labels();
            for i in 0..n {
                for j in 0..i {
                    if labels[i] == labels[j] {
                        matrix[i][j] += row.probability;
                        matrix[j][i] = matrix[i][j];
                    }
                }
            }
        }
        for (i, row) in matrix.iter_mut().enumerate() {
            row[i] = 1.0;
        }
        matrix
    }
}

/// Where the table stands after a round of draws.
#[derive(Clone, Copy, Debug)]
pub struct Round {
    /// Its number, from 1.
    pub number: usize,
    /// Estimated error of the table.
    pub error: TableError,
    /// Draws of locations so far.
    pub n_draws: f64,
    /// Draws that it takes in all, as far as this round can tell.
    pub n_draws_needed: f64,
}

/// How drawing ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ended {
    /// The table is as good as it was to be.
    Reached,
    /// The draws are spent.
    OutOfDraws {
        /// Draws that it takes in all, as far as these can tell.
        n_draws_needed: f64,
    },
    /// It was clear before they were spent that they would not do.
    OutOfReach {
        /// Draws that it takes in all, as far as these can tell.
        n_draws_needed: f64,
    },
}

/// The posterior over all partitions of the model's detections, at most
/// [`MAX_DETECTIONS_LARGE`] of them, to a tolerance. A function of model, prior, settings and purpose: the number of
/// threads changes no bit.
pub fn posterior(
    model: &Model,
    prior: Prior,
    settings: &ExactSettings,
    purpose: &Purpose,
) -> Posterior {
    static NEVER: AtomicBool = AtomicBool::new(false);
    let nobody = Watch {
        round: &mut |_| (),
        stop: &NEVER,
    };
    watched_posterior(model, prior, settings, purpose, nobody).expect("nobody stops it")
}

/// Who watches the rounds of draws.
pub struct Watch<'a> {
    /// Sees every round.
    pub round: &'a mut dyn FnMut(&Round),
    /// Ends them once it is set, within some milliseconds.
    pub stop: &'a AtomicBool,
}

/// As [`posterior`]; `None` if the watch stopped it.
pub fn watched_posterior(
    model: &Model,
    prior: Prior,
    settings: &ExactSettings,
    purpose: &Purpose,
    watch: Watch<'_>,
) -> Option<Posterior> {
    let prior = prior.table(model.n_detections());
    let mut table = table::Table::new(model, &prior, (purpose, watch.stop));
    let (error, ended) = table.integrate(settings, watch.round)?;
    table.fit_tails();
    let n_draws = table.n_draws;
    let rows = table.rows.into_iter().map(|row| ExactTopology {
        topology: row.topology,
        probability: row.probability,
        ln_unnormalised: row.ln_unnormalised,
        se: row.se,
        effective_draws: row.effective_draws,
        pareto_k: row.pareto_k,
    });
    let mut topologies: Vec<ExactTopology> = rows.collect();
    topologies.sort_by(|a, b| {
        b.probability
            .total_cmp(&a.probability)
            .then_with(|| a.topology.cmp(&b.topology))
    });
    Some(Posterior {
        topologies,
        error,
        ended,
        n_draws,
    })
}

/// One topology of the posterior.
#[derive(Clone, Debug)]
pub struct ExactTopology {
    /// The topology.
    pub topology: Topology,
    /// Posterior probability.
    pub probability: f64,
    /// ln P(T) + Σ ln I₀ + ln E[exp(−Pen)], constants dropped.
    pub ln_unnormalised: f64,
    /// Monte Carlo standard error of `ln_unnormalised`; to be trusted where there are at least
    /// [`TRUSTED`] effective draws.
    pub se: f64,
    /// Effective number of draws; `None` where nothing had to be drawn.
    pub effective_draws: Option<f64>,
    /// Pareto k̂ of the weights, for the twenty likeliest topologies and where the weights vary.
    pub pareto_k: Option<f64>,
}

impl ExactTopology {
    /// Whether `se` can be trusted.
    pub fn is_reliable(&self) -> bool {
        self.effective_draws
            .is_none_or(|effective| effective >= TRUSTED)
    }
}

/// The posterior over all partitions of the model's detections, in the order of their restricted
/// growth strings, with `n_draws` draws of X for each.
pub fn enumerate(
    model: &Model,
    prior: Prior,
    n_draws: usize,
    rng: &mut impl Rng,
) -> Vec<ExactTopology> {
    let n = model.n_detections();
    let prior = prior.table(n);
    let mut draws = Draws::new(n, n_draws);
    let mut rows: Vec<ExactTopology> = Partitions::of(n)
        .map(|topology| {
            let partition = Partition::from_labels(topology.labels());
            let sets = || partition.sets().iter().map(Vec::as_slice);
            let ln_bound: f64 = sets().map(|members| draws.ln_bound(model, members)).sum();
            let ln_mean = draws.ln_mean_exp(model, sets(), rng);
            let ln_prior = prior.ln_prior(sets().map(<[u32]>::len));
            let mut sums = WeightSums::default();
            sums.add(draws.ln_weights());
            ExactTopology {
                topology,
                probability: 0.0,
                ln_unnormalised: ln_prior + ln_bound + ln_mean,
                se: sums.variance().sqrt(),
                effective_draws: Some(sums.effective()),
                pareto_k: None,
            }
        })
        .collect();
    let largest = rows
        .iter()
        .map(|row| row.ln_unnormalised)
        .fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = rows
        .iter()
        .map(|row| libm::exp(row.ln_unnormalised - largest))
        .sum();
    for row in &mut rows {
        row.probability = libm::exp(row.ln_unnormalised - largest) / total;
    }
    rows
}

#[cfg(test)]
mod tests;
