//! Geweke's test of a single chain: is its beginning like its end? (Geweke, Bayesian Statistics 4,
//! 1992).

use super::burn_in::BurnIn;
use super::chains::{Chains, Stretch};
use super::ess::ess_of;
use super::interval::Z_95;
use super::undefined::Undefined;

/// Share of the chain at its beginning, and at its end (Geweke 1992).
const FIRST: f64 = 0.1;
const LAST: f64 = 0.5;
/// Beginnings tried as burn-in: 0, 5 %, …, 50 % of the chain.
const N_CUTS: u64 = 10;

/// The difference of two means over its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geweke {
    /// Standard normal for a chain that has settled.
    pub z: f64,
    /// Mean of the first tenth.
    pub first: f64,
    /// Mean of the last half.
    pub last: f64,
    /// Effective draws of the first tenth.
    pub ess_first: f64,
    /// Effective draws of the last half.
    pub ess_last: f64,
}

/// z = (x̄_A − x̄_B)/√(s²_A/ESS_A + s²_B/ESS_B), A the first tenth of the chain and B its last
/// half. The spectral densities at 0 are those of Geyer's initial monotone sequence.
///
/// # Errors
/// As [`Chains::new`]; [`Undefined::Constant`]; [`Undefined::TooShort`] where the first tenth has
/// fewer than four draws; [`Undefined::TooRare`] where the value changes too seldom within A or B:
/// such a chain cannot be judged by itself.
pub fn geweke(chain: &[Stretch]) -> Result<Geweke, Undefined> {
    of_chains(&Chains::new(&[chain.to_vec()])?)
}

/// The first of the cuts 0, 5 %, …, 50 % after which |z| ≤ 1.96. A rule and no test: a chain that
/// has settled passes the first cut 19 times out of 20.
///
/// # Errors
/// As [`geweke`], if no cut can be judged.
pub fn geweke_burn_in(chain: &[Stretch]) -> Result<BurnIn, Undefined> {
    let chains = Chains::new(&[chain.to_vec()])?;
    let n = chains.n_draws();
    let cuts = (0..=N_CUTS).map(|k| n * k / (2 * N_CUTS));
    let (mut judged, mut first_reason) = (false, None);
    for cut in cuts {
        match of_chains(&chains.window(cut, n)) {
            Ok(found) if found.z.abs() <= Z_95 => return Ok(BurnIn::Settled(cut)),
            Ok(_) => judged = true,
            Err(reason) => first_reason = first_reason.or(Some(reason)),
        }
    }
    match first_reason {
        Some(reason) if !judged => Err(reason),
        _ => Ok(BurnIn::NeverSettled),
    }
}

fn of_chains(chains: &Chains) -> Result<Geweke, Undefined> {
    chains.standstill().map_or(Ok(()), Err)?;
    let n = chains.n_draws();
    let first = chains.window(0, ((n as f64 * FIRST) as u64).max(1));
    let last = chains.window(n - (n as f64 * LAST) as u64, n);
    let fewest = super::chains::FEWEST_DRAWS;
    if first.n_draws() < fewest {
        return Err(Undefined::TooShort {
            n: first.n_draws(),
            fewest,
        });
    }
    let ess = |window: &Chains| {
        let too_rare = Undefined::TooRare {
            n_changes: window.n_changes(),
            fewest: super::undefined::FEWEST_CHANGES,
        };
        // A window that stands still is no constant chain.
        ess_of(window).map(|ess| ess.ess).map_err(|_| too_rare)
    };
    let (ess_first, ess_last) = (ess(&first)?, ess(&last)?);
    let error = first.variance() / ess_first + last.variance() / ess_last;
    let (first, last) = (first.mean(), last.mean());
    Ok(Geweke {
        z: (first - last) / error.sqrt(),
        first,
        last,
        ess_first,
        ess_last,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::tests::ar1;

    fn stretches(draws: &[f64]) -> Vec<Stretch> {
        draws.iter().map(|x| (*x, 1)).collect()
    }

    /// z of 300 chains that have settled: mean 0 and variance 1, within five standard errors of
    /// each; the variance a little above 1, as the errors are estimates.
    #[test]
    fn z_is_standard_normal_for_chains_that_have_settled() {
        let z: Vec<f64> = (0..300)
            .map(|seed| {
                geweke(&stretches(&ar1(0.5, 4000, seed)))
                    .expect("it moves")
                    .z
            })
            .collect();
        let n = z.len() as f64;
        let mean = z.iter().sum::<f64>() / n;
        let variance = z.iter().map(|z| (z - mean) * (z - mean)).sum::<f64>() / (n - 1.0);
        assert!(mean.abs() < 5.0 / n.sqrt(), "{mean}");
        assert!(
            (variance - 1.0).abs() < 5.0 * (2.0 / n).sqrt(),
            "{variance}"
        );
    }

    /// The errors of both ends count: of one chain, from the variances of its parts by hand.
    #[test]
    fn z_has_the_errors_of_both_ends() {
        // The last half varies ten times as much as the rest, so its error is the larger.
        let mut chain = ar1(0.5, 2000, 7);
        for x in &mut chain[1000..] {
            *x *= 10.0;
        }
        let found = geweke(&stretches(&chain)).expect("it moves");
        let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
        let variance = |x: &[f64]| {
            let squares: f64 = x.iter().map(|v| (v - mean(x)).powi(2)).sum();
            squares / (x.len() - 1) as f64
        };
        let (first, last) = (&chain[..200], &chain[1000..]);
        let of_first = variance(first) / found.ess_first;
        let of_last = variance(last) / found.ess_last;
        assert!(of_last > of_first && of_first > 0.02 * of_last);
        let z = (mean(first) - mean(last)) / (of_first + of_last).sqrt();
        assert!((found.z / z - 1.0).abs() < 1e-9, "{} {z}", found.z);
    }

    #[test]
    fn finds_where_a_transient_ends() {
        let mut chain = ar1(0.5, 5000, 1);
        for x in &mut chain[..1000] {
            *x += 8.0;
        }
        assert!(geweke(&stretches(&chain)).expect("it moves").z > 10.0);
        let Ok(BurnIn::Settled(cut)) = geweke_burn_in(&stretches(&chain)) else {
            panic!("it settles")
        };
        assert!((750..=1250).contains(&cut), "{cut}");
        let ramp: Vec<f64> = chain
            .iter()
            .enumerate()
            .map(|(t, x)| x + t as f64 / 100.0)
            .collect();
        assert_eq!(geweke_burn_in(&stretches(&ramp)), Ok(BurnIn::NeverSettled));
    }

    #[test]
    fn undefined_with_a_reason() {
        assert_eq!(
            geweke(&[(2.0, 100)]),
            Err(Undefined::Constant { value: 2.0 })
        );
        assert_eq!(
            geweke_burn_in(&[(2.0, 100)]),
            Err(Undefined::Constant { value: 2.0 })
        );
        let rare = geweke(&[(2.0, 90), (3.0, 10)]).expect_err("one change");
        assert_eq!(rare.name(), "too-rare");
        assert_eq!(
            geweke(&stretches(&ar1(0.0, 39, 1)))
                .expect_err("short")
                .name(),
            "too-short"
        );
    }
}
