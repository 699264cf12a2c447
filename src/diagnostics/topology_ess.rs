//! How many independent topologies a chain is worth.
//!
//! A chain of topologies is a series of indicator vectors e_t, 1 at the topology of step t. Its
//! autocovariance γ_t = Σ_k Cov(e_s,k, e_s+t,k) = P(T_s = T_s+t) − Σ p_k² is a number, and ESS = n
//! γ₀/(γ₀ + 2Σγ_t) is the number of independent draws whose frequencies p̂ have the same Σ_k Var
//! p̂_k. It is the effective size that a comparison of frequencies needs; for two topologies it is
//! that of their indicator. (The distance behind it is 0 or 1 as two topologies are equal or not,
//! in the sense of the generalised autocovariances of Magee, Karcher, Matsen & Minin, Bayesian
//! Analysis, 2024.) Sums end as in [`ess`](super::ess), over batch means likewise.

use std::collections::BTreeMap;

use super::ess::{Ess, geyer};
use super::undefined::{FEWEST_CHANGES, Undefined};

/// Most batches of one chain; a batch holds as many numbers as it has distinct topologies.
const MAX_BATCHES: u64 = 1024;

/// Shares of the topologies met in a batch, by rising index.
type Shares = Vec<(u32, f64)>;

/// ESS of one chain of topologies given as (index, number of steps).
///
/// # Errors
/// [`Undefined::TooShort`] below four steps; [`Undefined::TooRare`] below [`FEWEST_CHANGES`]
/// changes of topology, of which none is the chain that stands still.
pub fn topology_ess(stretches: &[(u32, u64)]) -> Result<Ess, Undefined> {
    let n_total: u64 = stretches.iter().map(|(_, n)| n).sum();
    let fewest = super::chains::FEWEST_DRAWS;
    if n_total < fewest {
        return Err(Undefined::TooShort { n: n_total, fewest });
    }
    let kept: Vec<u32> = stretches
        .iter()
        .filter(|(_, n)| *n > 0)
        .map(|(k, _)| *k)
        .collect();
    let n_changes = kept.windows(2).filter(|pair| pair[0] != pair[1]).count() as u64;
    if n_changes < FEWEST_CHANGES {
        return Err(Undefined::TooRare {
            n_changes,
            fewest: FEWEST_CHANGES,
        });
    }
    let length = n_total.div_ceil(MAX_BATCHES);
    let batches = shares_of_batches(stretches, n_total, length);
    let n = batches.len();
    let mean = mean_shares(&batches);
    // ⟨f_s − f̄, f_s+t − f̄⟩ multiplied out; ⟨f̄, f_s⟩ is needed once for each batch.
    let with_mean: Vec<f64> = batches.iter().map(|f| dot(f, &mean)).collect();
    let mean_square = dot(&mean, &mean);
    // Of single steps only whether they are at the same topology, which is asked for a lot of lags.
    let places: Option<Vec<u32>> = (length == 1).then(|| batches.iter().map(|f| f[0].0).collect());
    let autocovariance = |lag: usize| {
        let products: f64 = if let Some(places) = &places {
            let pairs = places.iter().zip(&places[lag..]);
            pairs.map(|(a, b)| u32::from(a == b)).sum::<u32>().into()
        } else {
            let pairs = batches.iter().zip(&batches[lag..]);
            pairs.map(|(f, g)| dot(f, g)).sum()
        };
        let ends: f64 =
            with_mean[..n - lag].iter().sum::<f64>() + with_mean[lag..].iter().sum::<f64>();
        (products - ends + (n - lag) as f64 * mean_square) / n as f64
    };
    let at_0 = autocovariance(0);
    let within = at_0 * n as f64 / (n as f64 - 1.0);
    let window = geyer(n, |lag| 1.0 - (within - autocovariance(lag)) / at_0);
    let time = if length == 1 {
        window.time
    } else {
        length as f64 * at_0 * window.time / (1.0 - mean_square)
    };
    let time = time.max(1.0 / libm::log10(n_total as f64));
    Ok(Ess::new(n_total, time, window.n_lags, n, length))
}

fn shares_of_batches(stretches: &[(u32, u64)], n_total: u64, length: u64) -> Vec<Shares> {
    let mut skip = n_total % length;
    let (mut batches, mut steps, mut filled) = (Vec::new(), BTreeMap::new(), 0);
    for &(topology, n) in stretches {
        let skipped = n.min(skip);
        skip -= skipped;
        let mut left = n - skipped;
        while left > 0 {
            let taken = left.min(length - filled);
            *steps.entry(topology).or_insert(0_u64) += taken;
            filled += taken;
            left -= taken;
            if filled == length {
                let share = |(topology, n): (u32, u64)| (topology, n as f64 / length as f64);
                batches.push(std::mem::take(&mut steps).into_iter().map(share).collect());
                filled = 0;
            }
        }
    }
    batches
}

fn mean_shares(batches: &[Shares]) -> Shares {
    let mut sums = BTreeMap::new();
    for &(topology, share) in batches.iter().flatten() {
        *sums.entry(topology).or_insert(0.0) += share;
    }
    let n = batches.len() as f64;
    sums.into_iter()
        .map(|(topology, sum)| (topology, sum / n))
        .collect()
}

/// Inner product of two sparse vectors in the same order; the shorter is looked up in the longer
/// where it is much shorter.
fn dot(a: &Shares, b: &Shares) -> f64 {
    let (few, many) = if a.len() <= b.len() { (a, b) } else { (b, a) };
    let find = |(topology, share): &(u32, f64)| {
        let place = many
            .binary_search_by_key(topology, |(other, _)| *other)
            .ok()?;
        Some(share * many[place].1)
    };
    few.iter().filter_map(find).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::chains::Chains;
    use crate::diagnostics::ess::ess_of;
    use crate::diagnostics::tests::two_state;
    use crate::rng::Purpose;
    use rand::RngExt;

    fn indices(chain: &[(f64, u64)]) -> Vec<(u32, u64)> {
        chain.iter().map(|(at, n)| (10 + *at as u32, *n)).collect()
    }

    #[test]
    fn of_two_topologies_it_is_that_of_their_indicator() {
        let chain = two_state(0.1, 0.2, 1000, 1);
        let one =
            ess_of(&Chains::new(std::slice::from_ref(&chain)).expect("draws")).expect("it moves");
        let both = topology_ess(&indices(&chain)).expect("it moves");
        assert!((both.ess / one.ess - 1.0).abs() < 1e-9, "{both:?} {one:?}");
    }

    /// Chains that stay with probability 0.95 and else draw anew: τ = 1.95/0.05, for any number of
    /// topologies, in batches too. Five standard errors.
    #[test]
    fn finds_the_autocorrelation_time() {
        let mut rng = Purpose::new("topologies", 1).generator();
        let mut at = 0;
        let chain: Vec<(u32, u64)> = (0..300_000)
            .map(|_| {
                if rng.random::<f64>() < 0.05 {
                    at = rng.random_range(0..40);
                }
                (at, 1)
            })
            .collect();
        let found = topology_ess(&chain).expect("it moves");
        let error = (found.autocorrelation_time() / 39.0 - 1.0).abs();
        assert!(
            error < 5.0 * found.relative_error && found.relative_error < 0.2,
            "{found:?}"
        );
    }

    #[test]
    fn standing_still_is_worth_nothing_that_can_be_told() {
        let still = topology_ess(&[(3, 1000), (3, 500)]);
        let reason = Undefined::TooRare {
            n_changes: 0,
            fewest: FEWEST_CHANGES,
        };
        assert_eq!(still, Err(reason));
        assert_eq!(
            topology_ess(&[]),
            Err(Undefined::TooShort { n: 0, fewest: 4 })
        );
    }
}
