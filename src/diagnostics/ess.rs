//! Effective sample size: how many independent draws would tell as much.
//!
//! ESS = M n/τ̂ of M (half-)chains of n draws, with τ̂ = 1 + 2Σρ̂_t, ρ̂_t = 1 − (W − mean over m of
//! s²_m ρ̂_t,m)/V⁺ and V⁺ = W(n − 1)/n + B/n (Vehtari, Gelman, Simpson, Carpenter & Bürkner,
//! Bayesian Analysis 16, 2021, §3.2): chains that disagree raise V⁺ and lower the ESS. The sum ends
//! by the initial monotone sequence of Geyer (Statistical Science 7, 1992), and τ̂ ≥ 1/log₁₀(M n),
//! as for antithetic chains. `bulk` is the ESS of the normal scores of the ranks, `tail` the
//! smaller one of the indicators of the 5 % and the 95 % quantile (§4.3). Cut into halves, so that
//! a drift counts as a disagreement.
//!
//! **Long chains.** ESS is V⁺ over the variance of the mean, and the mean of a series is the mean
//! of its batch means. So the autocovariances are those of at most [`MAX_BATCHES`] batch means per
//! half, which are exact sums over stretches, while V⁺ is that of all draws: τ̂ = b V⁺_b τ̂_b/V⁺
//! with batches of b draws. No draw is thinned away. What is lost is the shape of the
//! autocovariance within a batch, which the variance of the batch means holds summed; and fewer
//! than b draws at the start of each half. With b = 1, up to 2 × [`MAX_BATCHES`] draws a chain,
//! this is the definition above to the last digit. Ranks, quantiles and V⁺ are of all draws in any
//! case.

use super::autocovariance::Autocovariances;
use super::chains::{Chains, batch_means};
use super::r_hat::variance;
use super::ranks::{Ordered, rank_normalised};
use super::undefined::{FEWEST_CHANGES, Undefined};

/// Most batch means for each half of a chain. With τ̂ up to a hundredth of a half this resolves it
/// by 40 batches; chains that mix worse have other troubles than the precision of their ESS.
pub const MAX_BATCHES: u64 = 4096;
/// Fewer effective draws than this for each chain are too few to rely on (Vehtari et al. 2021,
/// §4.3: 400 for four chains).
pub const MIN_ESS_PER_CHAIN: f64 = 100.0;

/// An effective sample size with what it rests on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ess {
    /// Effective draws in all chains together.
    pub ess: f64,
    /// Standard error of `ess` over `ess`: √((4W + 2)/n) for a window of W of n batch means (Madras
    /// & Sokal, Journal of Statistical Physics 50, 1988). An approximation for W ≪ n; above 1 the
    /// size itself is not known.
    pub relative_error: f64,
    /// Lags in the sum, in draws.
    pub window: u64,
    /// Draws in all chains.
    pub n_total: u64,
}

impl Ess {
    /// From τ̂ in draws and the lags summed, of `n_batches` batches of `batch` draws.
    pub(super) fn new(n_total: u64, time: f64, lags: usize, n_batches: usize, batch: u64) -> Self {
        Self {
            ess: n_total as f64 / time,
            relative_error: ((4.0 * lags as f64 + 2.0) / n_batches as f64).sqrt(),
            window: lags as u64 * batch,
            n_total,
        }
    }

    /// τ̂, the integrated autocorrelation time in draws: how many draws are worth an independent
    /// one.
    pub fn autocorrelation_time(&self) -> f64 {
        self.n_total as f64 / self.ess
    }
}

/// ESS in both tails.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TailEss {
    /// Of the indicator of draws at or below the 5 % quantile.
    pub low: Result<Ess, Undefined>,
    /// Of the indicator of draws at or below the 95 % quantile: constant if no draw is above it,
    /// which is common for whole numbers.
    pub high: Result<Ess, Undefined>,
}

impl TailEss {
    /// The smaller one, among those that are defined.
    ///
    /// # Errors
    /// If neither is. A tail that is too rare, but neither constant nor an atom, makes the whole undefined.
    pub fn value(&self) -> Result<Ess, Undefined> {
        match (self.low, self.high) {
            (Ok(low), Ok(high)) => Ok(if low.ess <= high.ess { low } else { high }),
            (Ok(one), Err(Undefined::Constant { .. } | Undefined::Atom { .. })) => Ok(one),
            (Err(Undefined::Constant { .. } | Undefined::Atom { .. }), other) => other,
            (Err(reason), _) | (_, Err(reason)) => Err(reason),
        }
    }
}

/// ESS for the mean.
///
/// # Errors
/// [`Undefined::Constant`] and [`Undefined::StuckDisagree`]; [`Undefined::TooRare`] below
/// [`FEWEST_CHANGES`] changes of value in all chains.
pub fn ess_mean(chains: &Chains) -> Result<Ess, Undefined> {
    ess_of(&chains.split())
}

/// ESS of the bulk: of the normal scores of the ranks, defined for laws without a mean.
///
/// # Errors
/// As [`ess_mean`].
pub fn ess_bulk(chains: &Chains) -> Result<Ess, Undefined> {
    let halves = chains.split();
    halves
        .standstill()
        .map_or_else(|| ess_of(&rank_normalised(&halves)), Err)
}

/// ESS for the p-quantile: of the indicator of draws at or below it.
///
/// # Errors
/// As [`ess_mean`]; constant if no draw is above the quantile.
pub fn ess_quantile(chains: &Chains, p: f64) -> Result<Ess, Undefined> {
    let quantile = Ordered::new(chains).quantile(p);
    ess_mean(&chains.map(|value| f64::from(u8::from(value <= quantile))))
}

/// ESS of the tails, at 5 % and 95 %.
pub fn ess_tail(chains: &Chains) -> TailEss {
    TailEss {
        low: ess_quantile(chains, 0.05),
        high: ess_quantile(chains, 0.95),
    }
}

/// ESS for the standard deviation: of the squared distances from the mean.
///
/// # Errors
/// As [`ess_mean`].
pub fn ess_sd(chains: &Chains) -> Result<Ess, Undefined> {
    chains.standstill().map_or(Ok(()), Err)?;
    let mean = chains.mean();
    ess_mean(&chains.map(|value| (value - mean) * (value - mean)))
}

/// ESS of chains as they are, neither split nor ranked.
///
/// # Errors
/// As [`ess_mean`].
pub fn ess_of(chains: &Chains) -> Result<Ess, Undefined> {
    chains.standstill().map_or(Ok(()), Err)?;
    let n_changes = chains.n_changes();
    if n_changes < FEWEST_CHANGES {
        return Err(Undefined::TooRare {
            n_changes,
            fewest: FEWEST_CHANGES,
        });
    }
    let batch = chains.n_draws().div_ceil(MAX_BATCHES);
    let series: Vec<Vec<f64>> = chains
        .iter()
        .map(|chain| batch_means(chain, batch))
        .collect();
    let batches = Batches::new(series);
    let window = geyer(batches.n, |lag| batches.autocorrelation(lag));
    let n_total = chains.n_total();
    let n = chains.n_draws() as f64;
    let variances = chains.variances();
    let within = variances.iter().sum::<f64>() / variances.len() as f64;
    let v_plus = within * (n - 1.0) / n + variance(&chains.means()).unwrap_or(0.0);
    let time = if batch == 1 {
        window.time
    } else {
        batch as f64 * batches.v_plus * window.time / v_plus
    };
    // Antithetic batches may have no variance at all, and no autocorrelation then.
    let time = time.max(1.0 / libm::log10(n_total as f64));
    let n_batches = batches.n * chains.n_chains();
    Ok(Ess::new(n_total, time, window.n_lags, n_batches, batch))
}

/// Series about their means, with the pooled variance that the autocorrelations refer to.
struct Batches {
    autocovariances: Autocovariances,
    n: usize,
    within: f64,
    v_plus: f64,
}

impl Batches {
    fn new(mut series: Vec<Vec<f64>>) -> Self {
        let n = series[0].len();
        let mut means = Vec::with_capacity(series.len());
        for values in &mut series {
            let mean = values.iter().sum::<f64>() / n as f64;
            values.iter_mut().for_each(|value| *value -= mean);
            means.push(mean);
        }
        let autocovariances = Autocovariances::new(series);
        let at_0 = autocovariances.at(0);
        let between = variance(&means).unwrap_or(0.0);
        Self {
            autocovariances,
            n,
            within: at_0 * n as f64 / (n as f64 - 1.0),
            v_plus: at_0 + between,
        }
    }

    /// ρ̂ at a lag below the number of batches.
    fn autocorrelation(&self, lag: usize) -> f64 {
        1.0 - (self.within - self.autocovariances.at(lag)) / self.v_plus
    }
}

pub(super) struct Window {
    pub time: f64,
    pub n_lags: usize,
}

/// −1 + 2Σρ̂ over the initial positive sequence of pairs (ρ̂_2k, ρ̂_2k+1), made monotone; one even
/// lag more if it is positive (Vehtari et al. 2021, after Geyer 1992). Lags are asked for in order,
/// and no further than needed.
pub(super) fn geyer(n: usize, autocorrelation: impl Fn(usize) -> f64) -> Window {
    let (mut even, mut odd) = (1.0, autocorrelation(1));
    let mut pairs = vec![(even, odd)];
    let mut lag = 2;
    while lag + 2 < n && even + odd > 0.0 {
        (even, odd) = (autocorrelation(lag), autocorrelation(lag + 1));
        pairs.push((even, odd));
        lag += 2;
    }
    // The last pair ended the sequence, by its sign or by the end of the series; of it the even lag
    // stays if it is positive.
    let last = pairs.pop().map_or(0.0, |(even, _)| even.max(0.0));
    for k in 1..pairs.len() {
        let (before, here) = (pairs[k - 1], pairs[k]);
        if here.0 + here.1 > before.0 + before.1 {
            let half = (before.0 + before.1) / 2.0;
            pairs[k] = (half, half);
        }
    }
    let sum: f64 = pairs.iter().map(|(even, odd)| even + odd).sum();
    Window {
        time: -1.0 + 2.0 * sum + last,
        n_lags: 2 * pairs.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::tests::{ar1, two_state};

    /// τ = (1 + φ)/(1 − φ) for an AR(1). Five standard errors.
    #[test]
    fn finds_the_autocorrelation_time_of_an_ar1() {
        for (phi, purpose) in [(-0.5, 1), (0.0, 2), (0.5, 3), (0.9, 4), (0.99, 5)] {
            let chains: Vec<Vec<f64>> = (0..4)
                .map(|c| ar1(phi, 200_000, 100 * purpose + c))
                .collect();
            let ess = ess_mean(&Chains::from_draws(&chains).expect("draws")).expect("it moves");
            let time = (1.0 + phi) / (1.0 - phi);
            let error = (ess.autocorrelation_time() / time - 1.0).abs();
            assert!(error < 5.0 * ess.relative_error, "{phi}: {ess:?}");
            assert!(ess.relative_error < 0.2, "{phi}: {ess:?}");
        }
    }

    /// A chain of 10⁹ draws in 10⁴ or so stretches: τ = 2/(a + b) − 1 for a two-state chain that
    /// goes up with probability a and down with b.
    #[test]
    fn a_thousand_million_draws_cost_what_their_stretches_cost() {
        let (up, down) = (4e-5, 1e-5);
        let chains: Vec<_> = (0..2)
            .map(|c| two_state(up, down, 1_000_000_000, c))
            .collect();
        let ess = ess_mean(&Chains::new(&chains).expect("draws")).expect("it moves");
        let time = 2.0 / (up + down) - 1.0;
        let error = (ess.autocorrelation_time() / time - 1.0).abs();
        assert!(
            error < 5.0 * ess.relative_error && ess.relative_error < 0.1,
            "{ess:?}"
        );
    }

    #[test]
    fn batches_change_little_and_single_draws_nothing() {
        // Just above and just below the number of draws that are taken one by one.
        let long = ar1(0.8, 2 * MAX_BATCHES as usize + 2, 7);
        let short = long[2..].to_vec();
        let of = |chain: Vec<f64>| {
            ess_mean(&Chains::from_draws(&[chain]).expect("draws")).expect("it moves")
        };
        let (batched, single) = (of(long), of(short));
        assert!((batched.ess / single.ess - 1.0).abs() < 2.0 * single.relative_error);
        assert_eq!(batched.window % 2, 0);
    }

    #[test]
    fn draws_that_cancel_are_worth_more_than_independent_ones() {
        let chain: Vec<f64> = (0..20_000).map(|t| f64::from(t % 2)).collect();
        let ess = ess_mean(&Chains::from_draws(&[chain]).expect("draws")).expect("it moves");
        assert_eq!(ess.ess, 20_000.0 * 20_000_f64.log10());
    }

    #[test]
    fn undefined_with_a_reason() {
        let of = |chains: &[Vec<(f64, u64)>]| ess_mean(&Chains::new(chains).expect("draws"));
        assert_eq!(
            of(&[vec![(1.0, 90)]]),
            Err(Undefined::Constant { value: 1.0 })
        );
        let stuck = of(&[vec![(1.0, 90)], vec![(2.0, 90)]]).expect_err("stuck");
        assert_eq!(stuck.name(), "stuck-disagree");
        let rare = of(&[vec![(0.0, 800), (1.0, 3), (0.0, 400)]]);
        let reason = Undefined::TooRare {
            n_changes: 2,
            fewest: FEWEST_CHANGES,
        };
        assert_eq!(rare, Err(reason));
    }

    #[test]
    fn a_tail_without_draws_leaves_the_other() {
        let chain: Vec<f64> = (0..400).map(|t| f64::from(t * 7 % 3)).collect();
        let tail = ess_tail(&Chains::from_draws(&[chain]).expect("draws"));
        assert_eq!(tail.high, Err(Undefined::Constant { value: 1.0 }));
        assert_eq!(tail.value(), tail.low);
    }
}
