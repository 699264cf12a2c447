//! Chains pooled: their topologies, sets and pairs together, with verdict and estimates.

use std::collections::HashMap;

use rand::Rng;
use serde::{Deserialize, Serialize};

use super::convergence::{Diagnosis, diagnose};
use super::estimates::{Estimate, estimates};
use crate::chain::{PairSteps, Sums, TopologyCount};
use crate::diagnostics::recovery::Truth;
use crate::diagnostics::representatives::{N_DRAWS, Representative, representatives};
use crate::partition::Topology;
use crate::run::{ChainOutcome, SampledChain};

/// Above this many detections the co-clustering matrix is written as a list of pairs.
pub(super) const DENSE_LIMIT: usize = 1000;
/// Pairs of a smaller probability are left out of that list.
const SPARSE_FLOOR: f64 = 0.001;

/// A topology with its pooled counts.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct TopologyRow {
    /// In JSON its canonical `labels`.
    #[serde(flatten)]
    pub topology: Topology,
    /// Proposals after burn-in that ended there, over all chains.
    pub count: u64,
    /// `count` over all proposals after burn-in.
    pub frequency: f64,
}

/// Dense up to N = 1,000, then as (i, j, p) with i < j.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum CoClustering {
    /// N×N.
    Dense(Vec<Vec<f64>>),
    /// Pairs of probability 0.001 or more.
    Sparse(Vec<(usize, usize, f64)>),
}

impl<'de> Deserialize<'de> for CoClustering {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let rows = Vec::<Vec<f64>>::deserialize(from)?;
        // A list of three pairs is no matrix either: i of the first is 1 only if no pair has i = 0,
        // and then j of the second is no 1.
        let is_square = |(i, row): (usize, &Vec<f64>)| row.len() == rows.len() && row[i] == 1.0;
        if !rows.is_empty() && rows.iter().enumerate().all(is_square) {
            return Ok(Self::Dense(rows));
        }
        let pair = |row: Vec<f64>| match row[..] {
            [i, j, p] => Ok((i as usize, j as usize, p)),
            _ => Err(serde::de::Error::custom("no pair and no row of a matrix")),
        };
        Ok(Self::Sparse(
            rows.into_iter().map(pair).collect::<Result<_, _>>()?,
        ))
    }
}

impl CoClustering {
    /// Of pairs (i < j) of `n_detections`, each with its probability; others share no set.
    fn of(pairs: impl Iterator<Item = ((u32, u32), f64)>, n_detections: usize) -> Self {
        if n_detections <= DENSE_LIMIT {
            let mut matrix = vec![vec![0.0; n_detections]; n_detections];
            (0..n_detections).for_each(|i| matrix[i][i] = 1.0);
            for ((i, j), p) in pairs {
                matrix[i as usize][j as usize] = p;
                matrix[j as usize][i as usize] = p;
            }
            return Self::Dense(matrix);
        }
        let mut list: Vec<(usize, usize, f64)> = pairs
            .map(|((i, j), p)| (i as usize, j as usize, p))
            .filter(|(_, _, p)| *p >= SPARSE_FLOOR)
            .collect();
        list.sort_unstable_by_key(|&(i, j, _)| (i, j));
        Self::Sparse(list)
    }

    /// As a matrix of n×n; pairs that a list leaves out count as 0, and who is of one set with
    /// itself as 1.
    pub fn dense(&self, n: usize) -> Vec<Vec<f64>> {
        match self {
            Self::Dense(rows) => rows.clone(),
            Self::Sparse(pairs) => {
                let mut rows = vec![vec![0.0; n]; n];
                for (i, row) in rows.iter_mut().enumerate() {
                    row[i] = 1.0;
                }
                for &(i, j, p) in pairs {
                    rows[i][j] = p;
                    rows[j][i] = p;
                }
                rows
            }
        }
    }
}

/// A topology that stands for a share of the draws.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RepresentativeRow {
    /// In JSON its canonical `labels`.
    #[serde(flatten)]
    pub topology: Topology,
    /// M.
    pub n_sets: usize,
    /// The share of the draws that are nearest to it.
    pub weight: f64,
    /// Its standard error.
    pub weight_se: f64,
    /// Mean variation of information of these draws to it, nats.
    pub mean_distance: f64,
    /// Where there are several answers, of up to 1,000 detections: the probability in these draws that two detections share a
    /// set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub co_clustering: Option<CoClustering>,
}

impl RepresentativeRow {
    /// With so many effective topologies behind it.
    fn new(found: Representative, ess: f64, is_one_of_several: bool) -> Self {
        let n = 1.0 / (1.0 / ess + 1.0 / N_DRAWS as f64);
        let n_detections = found.topology.labels().len();
        Self {
            n_sets: found.topology.n_sets(),
            weight: found.weight,
            weight_se: (found.weight * (1.0 - found.weight) / n).max(0.0).sqrt(),
            mean_distance: found.mean_distance,
            co_clustering: (is_one_of_several && n_detections <= DENSE_LIMIT)
                .then(|| CoClustering::of(found.pairs().into_iter(), n_detections)),
            topology: found.topology,
        }
    }
}

/// Chains of one data set together.
pub(super) struct Pool {
    /// By falling count, then by labels.
    pub rows: Vec<TopologyCount>,
    n_counted: u64,
    n_sets: Sums,
    pairs: PairSteps,
    pub diagnosis: Option<Diagnosis>,
    pub estimates: Vec<Estimate>,
    pub representatives: Vec<RepresentativeRow>,
}

impl Pool {
    /// Of chains whose truth may be known. `rng` makes the null of the diagnosis; `stage` hears what
    /// is computed next.
    pub(super) fn new(
        chains: &[SampledChain],
        truth: Option<&Truth>,
        rng: &mut impl Rng,
        stage: &dyn Fn(&str),
    ) -> Self {
        stage("topologies and pairs of all chains together");
        let outcomes: Vec<&ChainOutcome> = chains.iter().map(|chain| &chain.outcome).collect();
        let mut counts: HashMap<Topology, u64> = HashMap::new();
        let (mut n_counted, mut n_sets, mut pairs) = (0, Sums::default(), PairSteps::new());
        for SampledChain { trace, outcome } in chains {
            let first = outcome.series.first_step;
            for row in trace.frequencies(first) {
                *counts.entry(row.topology).or_default() += row.count;
            }
            n_counted += trace.n_steps - first;
            let sums = trace.sums(first);
            n_sets.join(&sums.n_sets);
            for (pair, steps) in sums.pairs {
                *pairs.entry(pair).or_default() += steps;
            }
        }
        let mut rows: Vec<TopologyCount> = counts
            .into_iter()
            .map(|(topology, count)| TopologyCount { topology, count })
            .collect();
        rows.sort_unstable_by(|a, b| {
            b.count
                .cmp(&a.count)
                .then_with(|| a.topology.cmp(&b.topology))
        });
        stage("convergence");
        let diagnosis = diagnose(&outcomes, rng);
        stage("estimates and their credible balls");
        let estimates = diagnosis.as_ref().map_or_else(Vec::new, |diagnosis| {
            estimates(&rows, truth, diagnosis.ess_topologies)
        });
        let ess = diagnosis.as_ref().map_or(1.0, |own| own.ess_topologies);
        let answers = representatives(&rows);
        let is_one_of_several = answers.len() > 1;
        let row = |own| RepresentativeRow::new(own, ess, is_one_of_several);
        let representatives = answers.into_iter().map(row);
        Self {
            representatives: representatives.collect(),
            rows,
            n_counted,
            n_sets,
            pairs,
            diagnosis,
            estimates,
        }
    }

    /// Mean of M.
    pub(super) fn mean_n_sets(&self) -> f64 {
        self.n_sets.mean
    }

    pub(super) fn topologies(&self) -> Vec<TopologyRow> {
        let row = |row: &TopologyCount| TopologyRow {
            topology: row.topology.clone(),
            count: row.count,
            frequency: row.count as f64 / self.n_counted as f64,
        };
        self.rows.iter().map(row).collect()
    }

    /// Probability that two of `n_detections` share a set.
    pub(super) fn co_clustering(&self, n_detections: usize) -> CoClustering {
        let share = |(&pair, &steps)| (pair, steps as f64 / self.n_sets.n as f64);
        CoClustering::of(self.pairs.iter().map(share), n_detections)
    }
}
