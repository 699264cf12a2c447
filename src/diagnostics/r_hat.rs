//! R-hat: do the chains agree? Rank-normalised and split (Vehtari, Gelman, Simpson, Carpenter &
//! Bürkner, Bayesian Analysis 16, 2021, eqs 1–4 and §4.1), and nested (Margossian, Hoffman,
//! Sountsov, Riou-Durand, Vehtari & Gelman, Bayesian Analysis, 2024, eqs 15–19).
//!
//! With chains of n draws, W the mean of their variances and B n times the variance of their means,
//! R-hat = √((n − 1)/n + B/(n W)). Computed of the halves of the chains, after the draws have been
//! replaced by normal scores of their ranks; once as they are (`bulk`), once as distances from the
//! median (`folded`), which finds chains that agree in location but not in spread.

use std::collections::BTreeMap;

use super::chains::Chains;
use super::ranks::{folded, rank_normalised};
use super::undefined::Undefined;

/// Above this the chains are not to be trusted (Vehtari et al. 2021, §4.3).
pub const MAX_R_HAT: f64 = 1.01;

/// An R-hat. It has no standard error of its own; `n_chains` and `n_draws` say what it rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RHat {
    /// Of location.
    pub bulk: f64,
    /// Of spread; undefined where the distances from the median are all one, as for an indicator
    /// that is as often 0 as 1.
    pub folded: Result<f64, Undefined>,
    /// Chains, before they are split.
    pub n_chains: usize,
    /// Draws of each.
    pub n_draws: u64,
}

impl RHat {
    /// The larger of the two: the one to report.
    pub fn value(&self) -> f64 {
        self.folded
            .map_or(self.bulk, |folded| self.bulk.max(folded))
    }
}

/// R-hat of the halves of the chains, rank-normalised. One chain is enough: its halves are
/// compared.
///
/// # Errors
/// [`Undefined::Constant`]; [`Undefined::StuckDisagree`] if no half moves, in location or in
/// spread, though they differ.
pub fn r_hat(chains: &Chains) -> Result<RHat, Undefined> {
    bulk_and_folded(&chains.split(), chains, basic_r_hat)
}

/// R-hat of chains as they are, neither split nor rank-normalised (their eq. 4).
///
/// # Errors
/// [`Undefined::TooFew`] for one chain; what stands still, as in [`r_hat`].
pub fn plain_r_hat(chains: &Chains) -> Result<f64, Undefined> {
    at_least_two(chains.n_chains())?;
    chains
        .standstill()
        .map_or_else(|| Ok(basic_r_hat(chains)), Err)
}

/// Nested R-hat of the draws' normal scores: `superchain[c]` says from which start chain c set out,
/// as an index of the initial topology. √(1 + B/W) with B the variance of the superchains' means,
/// and W the mean over superchains of the variance between its chains plus their mean variance
/// within.
///
/// It asks whether the starts are forgotten, and so needs no chain to be long. It is never below 1:
/// with n independent draws of M chains a superchain it is about √(1 + 1/(M(n + 1))). Superchains
/// may differ in their number of chains, each then counts the same; the paper has equal numbers.
///
/// # Errors
/// [`Undefined::TooFew`] for one superchain; what stands still, as in [`r_hat`].
///
/// # Panics
/// If `superchain` has not one entry for each chain.
pub fn nested_r_hat(chains: &Chains, superchain: &[usize]) -> Result<RHat, Undefined> {
    assert_eq!(
        superchain.len(),
        chains.n_chains(),
        "a start for each chain"
    );
    let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (chain, &start) in superchain.iter().enumerate() {
        members.entry(start).or_default().push(chain);
    }
    at_least_two(members.len())?;
    let members: Vec<Vec<usize>> = members.into_values().collect();
    bulk_and_folded(chains, chains, |scores| {
        let (means, variances) = (scores.means(), scores.variances());
        let mut of_superchains = Vec::new();
        let mut within = 0.0;
        for chains in &members {
            let own: Vec<f64> = chains.iter().map(|&c| means[c]).collect();
            within += variance(&own).unwrap_or(0.0);
            within += chains.iter().map(|&c| variances[c]).sum::<f64>() / chains.len() as f64;
            of_superchains.push(own.iter().sum::<f64>() / own.len() as f64);
        }
        within /= members.len() as f64;
        let between = variance(&of_superchains).unwrap_or(0.0);
        (1.0 + between / within).sqrt()
    })
}

fn bulk_and_folded(
    draws: &Chains,
    whole: &Chains,
    of_scores: impl Fn(&Chains) -> f64,
) -> Result<RHat, Undefined> {
    let of = |quantity: &Chains| match quantity.standstill() {
        Some(reason) => Err(reason),
        None => Ok(of_scores(&rank_normalised(quantity))),
    };
    let bulk = of(draws)?;
    let folded = of(&folded(draws));
    if let Err(reason @ Undefined::StuckDisagree { .. }) = folded {
        return Err(reason);
    }
    Ok(RHat {
        bulk,
        folded,
        n_chains: whole.n_chains(),
        n_draws: whole.n_draws(),
    })
}

fn basic_r_hat(chains: &Chains) -> f64 {
    let n = chains.n_draws() as f64;
    let variances = chains.variances();
    let within = variances.iter().sum::<f64>() / variances.len() as f64;
    let between = n * variance(&chains.means()).unwrap_or(0.0);
    ((between / within + n - 1.0) / n).sqrt()
}

/// Over n − 1; `None` for fewer than two values.
pub(super) fn variance(values: &[f64]) -> Option<f64> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = |x: &f64| (x - mean) * (x - mean);
    (values.len() > 1).then(|| values.iter().map(square).sum::<f64>() / (n - 1.0))
}

fn at_least_two(n: usize) -> Result<(), Undefined> {
    if n < 2 {
        return Err(Undefined::TooFew { n, fewest: 2 });
    }
    Ok(())
}
