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
use super::ess::MIN_ESS_PER_CHAIN;
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

/// What nested R-hat of `n_superchains` ≥ 2 with at least `n_chains` each stays below if the starts are forgotten:
/// √(1.01² + q/(M (n + 1))).
///
/// The squared excess of [`nested_r_hat`] over 1 is, for n independent draws of M chains, 1/(M (n + 1)) on average
/// (Margossian et al. 2024: it is 1/M where each chain has one draw), times a chi-square with K − 1 degrees of freedom over
/// K − 1. Taken are the 99 % quantile q of that, as for topologies, the fewest effective draws that chains may have to
/// count as mixing, n = 100, and the slack of R-hat, 1.01. For two starts of two chains: 1.026. With fewer draws
/// chains are doubted for that; with more the bound is on the lenient side by at most as much.
pub fn max_nested_r_hat(n_superchains: usize, n_chains: usize) -> f64 {
    /// 99 % quantile of the normal law.
    const Z_99: f64 = 2.326_347_874_040_841;
    let degrees = (n_superchains - 1) as f64;
    // Wilson & Hilferty (1931): to 1 % for one degree of freedom, better for more.
    let spread = 2.0 / (9.0 * degrees);
    let quantile = (1.0 - spread + Z_99 * spread.sqrt()).powi(3);
    let by_chance = quantile / (n_chains as f64 * (MIN_ESS_PER_CHAIN + 1.0));
    (MAX_R_HAT * MAX_R_HAT + by_chance).sqrt()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::chains::Stretch;
    use crate::rng::Purpose;
    use rand_distr::{Distribution, StandardNormal};

    /// Of 2,000 sets of independent normal draws, as few as count, at most 1 % by each of location and spread may exceed
    /// the bound, and three binomial standard errors of that, 0.9 %; the slack alone without chance would let more through.
    #[test]
    fn starts_that_are_forgotten_stay_below_the_bound() {
        let mut rng = Purpose::new("test", 8).generator();
        for (n_superchains, n_chains) in [(2, 2), (3, 4)] {
            let (mut n_above, mut n_slack) = (0, 0);
            for _ in 0..2000 {
                let draws = |_| -> Vec<Stretch> {
                    let mut draw = || StandardNormal.sample(&mut rng);
                    (0..100).map(|_| (draw(), 1)).collect()
                };
                let all: Vec<Vec<Stretch>> = (0..n_superchains * n_chains).map(draws).collect();
                let chains = Chains::new(&all).expect("draws");
                let starts: Vec<usize> = (0..all.len()).map(|c| c % n_superchains).collect();
                let value = nested_r_hat(&chains, &starts).expect("draws").value();
                n_above += u32::from(value > max_nested_r_hat(n_superchains, n_chains));
                n_slack += u32::from(value > MAX_R_HAT);
            }
            assert!(n_above <= 58, "{n_above} of 2,000");
            assert!(n_slack > n_above, "{n_slack}");
        }
        // chi-square with one degree of freedom: 6.635; √(1.0201 + 6.635/202) = 1.02614.
        assert!((max_nested_r_hat(2, 2) - 1.026_14).abs() < 3e-4);
    }
}
