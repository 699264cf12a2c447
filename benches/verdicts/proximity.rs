//! What genMCMCDiag makes of chains of topologies: every draw becomes a number by a distance, and the
//! number is judged as any other.
//!
//! Duttweiler, Klus, Coull, Geller, Claus Henn & Thurston (arXiv 2408.15392) call the way from a draw
//! to a number a proximity map. Their package has two for draws that are no numbers:
//!
//! - **Lanfear's**: the distance to a reference, by default a draw that is taken at random;
//! - **TS**, a tour: all distinct draws in a line, each followed by the nearest one that is left. The
//!   number is the way along the tour, which is cut where the chains travel least.
//!
//! The distance is Hamming's, of the matrices that say which two detections share a set (their
//! `hammingDist`; here pairs count once), or the variation of information. `psrf` is that of
//! `coda::gelman.diag`, which the package calls: not split, no ranks, no burn-in of its own.

use rand::RngExt;
use topometric::chain::{TopologyId, Trace};
use topometric::diagnostics::chains::{Chains, Stretch};
use topometric::diagnostics::information::variation_of_information;
use topometric::diagnostics::undefined::Undefined;
use topometric::partition::Topology;
use topometric::rng::Generator;

/// Chains of topologies, each by its place among the distinct ones.
pub struct Draws {
    distinct: Vec<Topology>,
    pairs: Vec<Pairs>,
    chains: Vec<Vec<(usize, u64)>>,
}

/// Which pairs of at most 23 detections share a set, a bit for each.
type Pairs = [u64; 4];

impl Draws {
    /// Of whole traces from step `first_step` on.
    pub fn new(traces: &[&Trace], first_step: u64) -> Self {
        let mut places: std::collections::HashMap<TopologyId, usize> = Default::default();
        let mut distinct = Vec::new();
        let of_trace = |trace: &&Trace| -> Vec<(usize, u64)> {
            let runs = trace.dwell_times(first_step);
            let of_run = |(run, dwell): (&topometric::chain::Run, u64)| {
                let place = *places.entry(run.topology).or_insert_with(|| {
                    let topology = trace.topologies.get(run.topology);
                    distinct.push(topology.expect("a whole trace").clone());
                    distinct.len() - 1
                });
                (place, dwell)
            };
            runs.map(of_run).collect()
        };
        let chains = traces.iter().map(of_trace).collect();
        Self::of(distinct, chains)
    }

    /// Of topologies, and chains of (place among them, draws there).
    pub fn of(distinct: Vec<Topology>, chains: Vec<Vec<(usize, u64)>>) -> Self {
        Self {
            pairs: distinct.iter().map(pairs).collect(),
            distinct,
            chains,
        }
    }

    /// A draw of all chains, taken at random: its place.
    pub fn one_of_them(&self, rng: &mut Generator) -> usize {
        let all = || self.chains.iter().flatten();
        let mut left = rng.random_range(0..all().map(|(_, n)| n).sum::<u64>());
        let found = all().find(|(_, n)| {
            let is_here = left < *n;
            left = left.saturating_sub(*n);
            is_here
        });
        found.expect("less than all").0
    }

    /// Lanfear's map by Hamming's distance: pairs that one puts into a set and the other does not.
    pub fn hamming_to(&self, reference: usize) -> Result<Chains, Undefined> {
        let to = |own: &Pairs| hamming(own, &self.pairs[reference]);
        self.mapped(&self.pairs.iter().map(to).collect::<Vec<_>>())
    }

    /// Lanfear's map by the variation of information, nats.
    pub fn information_to(&self, reference: usize) -> Result<Chains, Undefined> {
        let reference = &self.distinct[reference];
        let to = |own: &Topology| variation_of_information(own, reference).unwrap_or(0.0);
        self.mapped(&self.distinct.iter().map(to).collect::<Vec<_>>())
    }

    /// The way along the tour, by Hamming's distance.
    pub fn way(&self) -> Result<Chains, Undefined> {
        let tour = self.tour();
        let n = tour.len();
        let step = |k: usize| hamming(&self.pairs[tour[k]], &self.pairs[tour[(k + 1) % n]]);
        let (mut places, mut starts, mut length) = (vec![0; n], vec![0.0; n], 0.0);
        for k in 0..n {
            places[tour[k]] = k;
            starts[k] = length;
            length += step(k);
        }
        // What the chains travel if the tour begins at its k-th: a change from a to b goes the other
        // way round where the cut lies between.
        let mut travel = vec![0.0; n + 1];
        for chain in &self.chains {
            for two in chain.windows(2) {
                let [a, b] = [places[two[0].0], places[two[1].0]];
                let (a, b) = (a.min(b), a.max(b));
                let between = starts[b] - starts[a];
                travel[0] += between;
                travel[a + 1] += length - 2.0 * between;
                travel[b + 1] -= length - 2.0 * between;
            }
        }
        for k in 1..n {
            travel[k] += travel[k - 1];
        }
        let cut = (0..n).fold(0, |best, k| if travel[k] < travel[best] { k } else { best });
        let from_cut = |place: usize| {
            let way = starts[places[place]] - starts[cut];
            if places[place] < cut {
                way + length
            } else {
                way
            }
        };
        self.mapped(&(0..n).map(from_cut).collect::<Vec<_>>())
    }

    /// From the first draw to the nearest one that is left, the first of several, and so on.
    fn tour(&self) -> Vec<usize> {
        let mut left: Vec<usize> = (1..self.distinct.len()).collect();
        let mut tour = vec![0];
        while !left.is_empty() {
            let last = &self.pairs[tour[tour.len() - 1]];
            let far: Vec<f64> = left
                .iter()
                .map(|&own| hamming(&self.pairs[own], last))
                .collect();
            let nearest =
                (0..far.len()).fold(0, |best, k| if far[k] < far[best] { k } else { best });
            tour.push(left.remove(nearest));
        }
        tour
    }

    fn mapped(&self, values: &[f64]) -> Result<Chains, Undefined> {
        let of_chain = |chain: &Vec<(usize, u64)>| -> Vec<Stretch> {
            chain.iter().map(|&(place, n)| (values[place], n)).collect()
        };
        Chains::new(&self.chains.iter().map(of_chain).collect::<Vec<_>>())
    }
}

fn pairs(topology: &Topology) -> Pairs {
    let labels = topology.labels();
    let (mut bits, mut bit) = ([0; 4], 0);
    for (i, label) in labels.iter().enumerate() {
        for other in &labels[..i] {
            bits[bit / 64] |= u64::from(label == other) << (bit % 64);
            bit += 1;
        }
    }
    bits
}

fn hamming(a: &Pairs, b: &Pairs) -> f64 {
    let differ = a.iter().zip(b).map(|(a, b)| (a ^ b).count_ones());
    f64::from(differ.sum::<u32>())
}

/// The point estimate of the potential scale reduction factor as `coda::gelman.diag` computes it
/// (Brooks & Gelman, Journal of Computational and Graphical Statistics 7, 1998): √(V/W (d + 3)/(d + 1))
/// with V and its degrees of freedom d of the t law that the chains predict together. NaN for chains
/// that stand still.
pub fn psrf(chains: &Chains) -> f64 {
    let (means, variances) = (chains.means(), chains.variances());
    let (m, n) = (means.len() as f64, chains.n_draws() as f64);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / m;
    let covariance = |a: &[f64], b: &[f64]| {
        let (of_a, of_b) = (mean(a), mean(b));
        let products = a.iter().zip(b).map(|(a, b)| (a - of_a) * (b - of_b));
        products.sum::<f64>() / (m - 1.0)
    };
    let (within, between) = (mean(&variances), n * covariance(&means, &means));
    let squares: Vec<f64> = means.iter().map(|mean| mean * mean).collect();
    let var_within = covariance(&variances, &variances) / m;
    let var_between = 2.0 * between * between / (m - 1.0);
    let cov = n / m
        * (covariance(&variances, &squares) - 2.0 * mean(&means) * covariance(&variances, &means));
    let of_between = 1.0 + 1.0 / m;
    let pooled = ((n - 1.0) * within + of_between * between) / n;
    let var_pooled = ((n - 1.0).powi(2) * var_within
        + of_between.powi(2) * var_between
        + 2.0 * (n - 1.0) * of_between * cov)
        / (n * n);
    let degrees = 2.0 * pooled * pooled / var_pooled;
    (pooled / within * (degrees + 3.0) / (degrees + 1.0)).sqrt()
}
