//! Monte Carlo standard errors: how far the chains' mean, standard deviation and quantiles may be
//! from those of the law that they sample (Vehtari, Gelman, Simpson, Carpenter & Bürkner, Bayesian
//! Analysis 16, 2021, §4.4). They hold for chains that have converged.

use super::beta::beta_quantile;
use super::chains::Chains;
use super::ess::{ess_mean, ess_quantile, ess_sd};
use super::ranks::Ordered;
use super::undefined::Undefined;

/// An estimate from chains, in the unit of the draws.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The estimate.
    pub value: f64,
    /// Its Monte Carlo standard error.
    pub mcse: f64,
    /// The effective draws that it rests on.
    pub ess: f64,
}

/// Φ(−1) and Φ(1), as the reference implementations round them.
const ONE_SIGMA: [f64; 2] = [0.158_655_3, 0.841_344_7];

/// The mean, with mcse = s/√ESS, s the standard deviation of all draws.
///
/// # Errors
/// As [`ess_mean`]. For a law without variance the error means nothing; use a quantile.
pub fn mean(chains: &Chains) -> Result<Estimate, Undefined> {
    let ess = ess_mean(chains)?.ess;
    Ok(Estimate {
        value: chains.mean(),
        mcse: (chains.variance() / ess).sqrt(),
        ess,
    })
}

/// The standard deviation (over n − 1), with mcse² = (m₄ − m₂²)/(4 m₂ ESS), mₖ the central moments.
///
/// # Errors
/// As [`ess_sd`].
pub fn standard_deviation(chains: &Chains) -> Result<Estimate, Undefined> {
    let ess = ess_sd(chains)?.ess;
    let mean = chains.mean();
    let second = chains.map(|x| (x - mean) * (x - mean)).mean();
    let fourth = chains
        .map(|x| ((x - mean) * (x - mean)) * ((x - mean) * (x - mean)))
        .mean();
    Ok(Estimate {
        value: chains.variance().sqrt(),
        mcse: ((fourth - second * second) / ess / second / 4.0).sqrt(),
        ess,
    })
}

/// The p-quantile, 0 < p < 1, with half the distance between the order statistics at the ±1σ
/// quantiles of Beta(ESS p + 1, ESS (1 − p) + 1). 0 for whole numbers whose quantile is sure.
///
/// # Errors
/// As [`ess_quantile`].
pub fn quantile(chains: &Chains, p: f64) -> Result<Estimate, Undefined> {
    let ess = ess_quantile(chains, p)?.ess;
    let ordered = Ordered::new(chains);
    let n = ordered.n() as f64;
    let place = |q: f64| beta_quantile(ess * p + 1.0, ess * (1.0 - p) + 1.0, q) * n - 1.0;
    let low = place(ONE_SIGMA[0]).max(0.0).floor();
    let high = place(ONE_SIGMA[1]).min(n - 1.0).ceil();
    Ok(Estimate {
        value: ordered.quantile(p),
        mcse: (ordered.at(high as u64) - ordered.at(low as u64)) / 2.0,
        ess,
    })
}
