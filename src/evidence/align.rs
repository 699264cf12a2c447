//! Detections moved to where they would be if the frame had not drifted.
//!
//! Draws (T, s, u) of the likelihood with shared drift ([`mixture`](super::mixture)) say together which detections
//! are one landmark and how the frame has drifted: simultaneous localisation and mapping with unknown data
//! association, over the places of landmarks and the drift (Dellaert, Seitz, Thorpe & Thrun, CVPR 2000, sample
//! correspondences for structure from motion in the same way). T̂ is the draw of highest mean adjusted Rand index with
//! the others, û the mean of u given T̂, and detection i is moved to x_i(û). The likelihood is linear in u; so it is
//! sampled in rounds, each about û of the one before (Gauss-Newton). What is still unknown of the drift,
//! V = E[(u−û)(u−û)ᵀ] over all draws, stays in its covariance: s²·R_i + B_i·V·B_iᵀ. So where draws differ
//! about the sets, covariances say so.
//!
//! The positions of revisited landmarks are used here, and again by whoever samples topologies of what comes out:
//! the drift is an estimate then, not a part of the posterior.

use nalgebra::{DMatrix, DVector, Vector2};
use rayon::prelude::*;

use super::drift::{DriftError, Linear, SharedDrift, covariance, matrix};
use super::mixture::{Draw, MOST_FACTOR, Mixture};
use crate::detections::{Detection, Detections, DetectionsError};
use crate::diagnostics::agreement::adjusted_rand_index;
use crate::diagnostics::chains::Chains;
use crate::diagnostics::r_hat::r_hat;
use crate::diagnostics::undefined::Undefined;
use crate::partition::Topology;
use crate::rng::Purpose;
use crate::sighting::FrameDrift;

/// Chains of a round.
const N_CHAINS: u64 = 4;
/// Sweeps of a round that are left out, and that are kept.
const FIRST_ROUNDS: [[usize; 2]; 2] = [[20, 20]; 2];
const LAST_ROUND: [usize; 2] = [50, 100];
/// Draws that the mean agreement is taken over.
const N_COMPARED: usize = 100;
/// Chains this far from 1 have not agreed.
const MOST_R_HAT: f64 = 1.1;
/// Beyond this the places of far detections lie on arcs.
const MOST_HEADING_RAD: f64 = 0.5;
/// A draw is expected to agree less than this with the truth: the sets are not known.
const LEAST_RAND_INDEX: f64 = 0.8;

/// What came of it.
#[derive(Clone, Debug)]
pub struct Alignment {
    /// Moved, with covariances of what is still unknown.
    pub detections: Detections,
    /// Root mean square of how far they were moved, m.
    pub moved_m: f64,
    /// Root mean square per axis of the drift before, m.
    pub drift_before_m: f64,
    /// What is left of it, m.
    pub drift_left_m: f64,
    /// Median of s: what detections err by themselves, over what they state.
    pub noise_factor: f64,
    /// Sets of T̂.
    pub n_sets: usize,
    /// The set of each detection under T̂.
    pub labels: Vec<u32>,
    /// Mean adjusted Rand index of T̂ with the draws: what it is expected to have with the truth.
    pub expected_rand_index: f64,
    /// Why it may be wrong, in sentences; empty if nothing speaks against it.
    pub doubts: Vec<String>,
}

/// Why nothing can be aligned.
#[derive(Debug, thiserror::Error)]
pub enum AlignError {
    /// Detections whose drift is of no use.
    #[error(transparent)]
    Drift(#[from] DriftError),
    /// Too few of them.
    #[error("got {0}, expected at least 4 detections; bring more of them")]
    TooFew(usize),
    /// Nothing to tell apart.
    #[error("got {0} detections at one place, expected at least two places; bring others")]
    OnePlace(usize),
    /// Covariances that are none once they are turned and added.
    #[error("of what comes out {0}")]
    Out(#[from] DetectionsError),
}

/// Aligns detections whose covariances are against the frame of the start, given its drift at each.
///
/// # Errors
/// Detections without covariances, fewer than four, all at one place, or so far away that numbers overflow.
pub fn align(
    detections: &Detections,
    drifts: &[FrameDrift],
    purpose: &Purpose,
) -> Result<Alignment, AlignError> {
    let n = detections.len();
    let positions_m = detections.positions_m();
    if n < 4 {
        return Err(AlignError::TooFew(n));
    }
    if positions_m.iter().all(|z| *z == positions_m[0]) {
        return Err(AlignError::OnePlace(n));
    }
    let drift = SharedDrift::of(detections, drifts)?;
    let before = drift.about(&DVector::zeros(drift.n_factors()))?;
    let mut about = before.clone();
    for (k, sweeps) in (0..).zip(FIRST_ROUNDS) {
        let round = Round::run(
            detections,
            &about,
            sweeps,
            &purpose.clone().number("round", k),
        );
        about = drift.about(&round.factors)?;
    }
    let last = Round::run(
        detections,
        &about,
        LAST_ROUND,
        &purpose.clone().text("round", "last"),
    );
    let now = drift.about(&last.factors)?;

    let root_mean = |square: &dyn Fn(usize) -> f64| root_mean(n, square);
    let unknown = |i: usize| &now.loadings_m[i] * &last.unknown * now.loadings_m[i].transpose();
    let row = |(i, row): (usize, &Detection)| {
        let own = matrix(now.own_m2[i]) * last.noise_factor.powi(2);
        Detection {
            position_m: now.places_m[i].into(),
            covariance_m2: Some(covariance(own + unknown(i))),
            ..row.clone()
        }
    };
    let rows: Vec<Detection> = detections.iter().enumerate().map(row).collect();
    let heading_rad = drifts.iter().map(|drift| drift.heading_std_rad());
    let heading_rad = heading_rad.fold(0.0, f64::max);
    Ok(Alignment {
        moved_m: root_mean(&|i| (now.places_m[i] - Vector2::from(positions_m[i])).norm_squared()),
        drift_before_m: root_mean(&|i| before.loadings_m[i].norm_squared() / 2.0),
        drift_left_m: root_mean(&|i| unknown(i).trace() / 2.0),
        noise_factor: last.noise_factor,
        n_sets: last.best.n_sets,
        labels: Topology::canonical(&last.best.labels).labels().to_vec(),
        expected_rand_index: last.expected_rand_index,
        doubts: last.doubts(heading_rad),
        detections: Detections::new(rows)?,
    })
}

/// What chains about one û say.
struct Round {
    chains: Vec<Vec<Draw>>,
    /// T̂.
    best: Draw,
    /// Of T̂ with the draws.
    expected_rand_index: f64,
    /// Median of s.
    noise_factor: f64,
    /// û.
    factors: DVector<f64>,
    /// V.
    unknown: DMatrix<f64>,
}

impl Round {
    fn run(
        detections: &Detections,
        about: &Linear,
        [n_left_out, n_kept]: [usize; 2],
        purpose: &Purpose,
    ) -> Self {
        let mixture = Mixture::with_drift(detections, about.clone());
        let chain = |k: u64| {
            let purpose = purpose.clone().number("chain", k);
            // Errors as they are stated, to begin with.
            mixture.sample(n_left_out, n_kept, 1.0, &mut purpose.generator())
        };
        let chains: Vec<Vec<Draw>> = (0..N_CHAINS).into_par_iter().map(chain).collect();
        let draws: Vec<&Draw> = chains.iter().flatten().collect();
        let (best, expected_rand_index) = most_agreed(&draws);
        let best = best.clone();
        let mut noises: Vec<f64> = draws.iter().map(|draw| draw.noise).collect();
        noises.sort_unstable_by(f64::total_cmp);
        let noise_factor = noises[noises.len() / 2];
        let factors = mixture.factors_given(&best.labels, noise_factor).mean;
        let unknown = spread(&draws, &factors);
        Self {
            chains,
            best,
            expected_rand_index,
            noise_factor,
            factors,
            unknown,
        }
    }

    fn doubts(&self, heading_rad: f64) -> Vec<String> {
        let mut doubts = Vec::new();
        let of = |value: fn(&Draw) -> f64| {
            let values = |chain: &Vec<Draw>| chain.iter().map(value).collect();
            let chains: Vec<Vec<f64>> = self.chains.iter().map(values).collect();
            match Chains::from_draws(&chains).and_then(|chains| r_hat(&chains)) {
                Ok(found) => found.value(),
                Err(Undefined::StuckDisagree { .. }) => f64::INFINITY,
                // Constant: all agree.
                Err(_) => 1.0,
            }
        };
        let n_sets = of(|draw| draw.n_sets as f64);
        let factor = of(|draw| draw.factors.first().copied().unwrap_or(0.0));
        for (of_what, found) in [("the number of landmarks", n_sets), ("the drift", factor)] {
            if found > MOST_R_HAT {
                doubts.push(format!(
                    "chains of the likelihood do not agree on {of_what} (R-hat {found:.2})"
                ));
            }
        }
        if self.expected_rand_index < LEAST_RAND_INDEX {
            doubts.push(format!(
                "which detections are one landmark is not known: its best guess is expected to have a Rand index of {:.2}",
                self.expected_rand_index
            ));
        }
        if self.noise_factor > MOST_FACTOR / 1.2 {
            doubts.push(format!(
                "detections err {:.1} times as much as they state: odometry may be worse than it says",
                self.noise_factor
            ));
        }
        if heading_rad > MOST_HEADING_RAD {
            doubts.push(format!(
                "the heading is known to {heading_rad:.2} rad at the end, more than the {MOST_HEADING_RAD} up to which places are \
                 nearly Gaussian; cut the recording into windows"
            ));
        }
        doubts
    }
}

/// T̂ among at most a hundred draws, and its mean adjusted Rand index with them.
fn most_agreed<'a>(draws: &[&'a Draw]) -> (&'a Draw, f64) {
    let every = draws.len().div_ceil(N_COMPARED);
    let compared: Vec<&Draw> = draws.iter().step_by(every).copied().collect();
    let topology = |draw: &&Draw| Topology::canonical(&draw.labels);
    let topologies: Vec<Topology> = compared.iter().map(topology).collect();
    let mean = |of: &Topology| {
        let index = |other: &Topology| adjusted_rand_index(of, other).unwrap_or(1.0);
        // Not with itself.
        let others = (topologies.len() - 1).max(1) as f64;
        (topologies.iter().map(index).sum::<f64>() - 1.0) / others
    };
    let means: Vec<f64> = topologies.par_iter().map(mean).collect();
    let mut best = 0;
    for (k, mean) in means.iter().enumerate() {
        if *mean > means[best] {
            best = k;
        }
    }
    (compared[best], means[best])
}

/// √ of the mean of n values.
fn root_mean(n: usize, value: impl Fn(usize) -> f64) -> f64 {
    libm::sqrt((0..n).map(value).sum::<f64>() / n as f64)
}

/// V.
fn spread(draws: &[&Draw], factors: &DVector<f64>) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(factors.len(), factors.len());
    for draw in draws {
        let from_mean = DVector::from_column_slice(&draw.factors) - factors;
        sum.ger(1.0 / draws.len() as f64, &from_mean, &from_mean, 1.0);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_is_about_the_mean() {
        let draw = |factors: [f64; 2]| Draw {
            noise: 1.0,
            n_sets: 1,
            labels: vec![0],
            factors: factors.to_vec(),
        };
        let draws = [draw([1.0, 5.0]), draw([3.0, 5.0])];
        let mean = DVector::from_vec(vec![2.0, 5.0]);
        let found = spread(&draws.iter().collect::<Vec<_>>(), &mean);
        assert_eq!(found, DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 0.0]));
    }

    #[test]
    fn a_root_mean_is_of_all() {
        // √((9 + 16 + 11)/3).
        let squares = [9.0, 16.0, 11.0];
        assert!((root_mean(3, |i| squares[i]) - 12_f64.sqrt()).abs() < 1e-15);
    }
}
