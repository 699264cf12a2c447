//! How many importance samples R suffice: the noise of the log estimate ln Ẑ(T) at the topologies
//! visited.
//!
//! A chain whose target is estimated stays exact for every R, but noise makes it stick: after a
//! lucky overestimate it rejects for long. More samples cost in proportion to R, and lower the
//! variance of ln Ẑ as 1/R. The theory balances the two for normal noise of the same variance
//! everywhere: a standard deviation of 0.92 (Pitt, Silva, Giordani & Kohn, Journal of Econometrics
//! 171, 2012), 1.0 to 1.7 as the exact chain mixes well or badly, with 1.2 to be on the safe side
//! (Doucet, Pitt, Deligiannidis & Kohn, Biometrika 102, 2015), 1.81 in high dimensions for random
//! walks (Sherlock, Thiery, Roberts & Rosenthal, Annals of Statistics 43, 2015). It speaks of
//! `fresh` estimates; under `common` the chain sees only the noise of the *difference* of two log
//! estimates with shared draws, which can be given here just as well, but these recommendations
//! then err on the side of too many samples.

use super::undefined::Undefined;

/// Standard deviations of ln Ẑ to aim at: from Doucet et al.'s safe choice to their value for
/// chains that mix badly.
pub const RECOMMENDED_SD: (f64, f64) = (1.2, 1.7);

/// The noise of ln Ẑ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EstimateNoise {
    /// √ of the mean over states of the variance between replicates, in nats.
    pub sd: f64,
    /// Its standard error, from how the variances differ between states; for one state, that of
    /// normal noise.
    pub standard_error: f64,
    /// The largest standard deviation at any state.
    pub largest: f64,
    /// States.
    pub n_states: usize,
    /// Replicates, over all states.
    pub n_replicates: usize,
}

/// What the noise says of R.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplesVerdict {
    /// Less noise than pays: R could be lowered.
    MoreThanNeeded,
    /// Within the recommendation.
    Suffice,
    /// Too noisy: the chain sticks.
    TooFew,
    /// The interval of two standard errors reaches beyond the recommendation's upper end, but not
    /// wholly.
    Unclear,
}

impl SamplesVerdict {
    /// One word, for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::MoreThanNeeded => "more-than-needed",
            Self::Suffice => "suffice",
            Self::TooFew => "too-few",
            Self::Unclear => "unclear",
        }
    }
}

impl EstimateNoise {
    /// Of several chains, from each one's standard deviation and its standard error; the error is from how their
    /// variances differ. `None` without any.
    pub fn pooled(chains: &[(f64, f64)]) -> Option<Self> {
        let variances: Vec<f64> = chains.iter().map(|(sd, _)| sd * sd).collect();
        let n = variances.len();
        let sd = (variances.iter().sum::<f64>() / n as f64).sqrt();
        let error_of_variance = match super::r_hat::variance(&variances) {
            Some(spread) => (spread / n as f64).sqrt(),
            None => chains.first().map(|(sd, error)| 2.0 * sd * error)?,
        };
        Some(Self {
            sd,
            standard_error: if sd > 0.0 {
                error_of_variance / (2.0 * sd)
            } else {
                0.0
            },
            largest: chains.iter().map(|(sd, _)| *sd).fold(0.0, f64::max),
            n_states: n,
            n_replicates: n,
        })
    }

    /// By the interval sd ± 2 standard errors against [`RECOMMENDED_SD`].
    pub fn verdict(&self) -> SamplesVerdict {
        let (low, high) = (
            self.sd - 2.0 * self.standard_error,
            self.sd + 2.0 * self.standard_error,
        );
        if low > RECOMMENDED_SD.1 {
            SamplesVerdict::TooFew
        } else if high < RECOMMENDED_SD.0 {
            SamplesVerdict::MoreThanNeeded
        } else if high <= RECOMMENDED_SD.1 {
            SamplesVerdict::Suffice
        } else {
            SamplesVerdict::Unclear
        }
    }

    /// The fewest samples at which the noise is at most `sd`, if `n_samples` were used here and the
    /// variance falls as 1/R; that holds where the variance is not large, so an answer far from
    /// `n_samples` is a direction only.
    pub fn n_samples_for(&self, sd: f64, n_samples: u64) -> u64 {
        ((n_samples as f64 * (self.sd / sd) * (self.sd / sd)).ceil() as u64).max(1)
    }
}

/// From replicates of ln Ẑ with the same R at each of some visited states, which should be drawn
/// from the chain, so that they weigh as it dwells.
///
/// # Errors
/// [`Undefined::TooFew`] without states; [`Undefined::TooShort`] for fewer than two replicates at a
/// state; [`Undefined::NotFinite`] if some estimate is 0, ln Ẑ = −∞: then no finite standard
/// deviation exists, and R is too small by far; [`Undefined::Constant`] without any noise, as where
/// no penalty is felt.
pub fn estimate_noise(replicates: &[Vec<f64>]) -> Result<EstimateNoise, Undefined> {
    if replicates.is_empty() {
        return Err(Undefined::TooFew { n: 0, fewest: 1 });
    }
    if let Some(short) = replicates.iter().find(|values| values.len() < 2) {
        return Err(Undefined::TooShort {
            n: short.len() as u64,
            fewest: 2,
        });
    }
    let n_infinite = replicates
        .iter()
        .flatten()
        .filter(|value| !value.is_finite())
        .count();
    if n_infinite > 0 {
        return Err(Undefined::NotFinite {
            n: n_infinite as u64,
        });
    }
    let variance = |values: &Vec<f64>| super::r_hat::variance(values).unwrap_or(0.0);
    let variances: Vec<f64> = replicates.iter().map(variance).collect();
    let n_states = variances.len();
    let mean = variances.iter().sum::<f64>() / n_states as f64;
    if mean == 0.0 {
        return Err(Undefined::Constant {
            value: replicates[0][0],
        });
    }
    let sd = mean.sqrt();
    let error_of_variance = match super::r_hat::variance(&variances) {
        Some(spread) => (spread / n_states as f64).sqrt(),
        None => mean * (2.0 / (replicates[0].len() as f64 - 1.0)).sqrt(),
    };
    Ok(EstimateNoise {
        sd,
        standard_error: error_of_variance / (2.0 * sd),
        largest: variances.iter().copied().fold(0.0, f64::max).sqrt(),
        n_states,
        n_replicates: replicates.iter().map(Vec::len).sum(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::tests::ar1;

    fn noise(sd: f64, n_states: u64, n: usize) -> Vec<Vec<f64>> {
        let of_state = |state| ar1(0.0, n, state).iter().map(|z| 100.0 + sd * z).collect();
        (0..n_states).map(of_state).collect()
    }

    #[test]
    fn finds_the_noise_within_its_error() {
        for sd in [0.3, 1.4, 5.0] {
            for (n_states, n) in [(50, 10), (1, 400)] {
                let found = estimate_noise(&noise(sd, n_states, n)).expect("noise");
                assert!(
                    (found.sd - sd).abs() < 5.0 * found.standard_error,
                    "{found:?}"
                );
                assert!(found.standard_error < 0.1 * sd && found.largest >= found.sd);
            }
        }
    }

    #[test]
    fn says_which_number_suffices() {
        let verdict = |sd, n| estimate_noise(&noise(sd, 50, n)).expect("noise").verdict();
        assert_eq!(verdict(0.5, 50), SamplesVerdict::MoreThanNeeded);
        assert_eq!(verdict(1.45, 50), SamplesVerdict::Suffice);
        assert_eq!(verdict(2.5, 50), SamplesVerdict::TooFew);
        assert_eq!(verdict(1.7, 3), SamplesVerdict::Unclear);
        let found = estimate_noise(&[vec![-2.0, 2.0]]).expect("noise");
        // Variance 8: eight times the samples for a standard deviation of 1.
        assert_eq!(
            (found.n_samples_for(1.0, 30), found.n_samples_for(100.0, 1)),
            (241, 1)
        );
    }

    #[test]
    fn chains_are_pooled_by_their_variances() {
        let pooled = EstimateNoise::pooled(&[(1.0, 0.1), (7.0, 0.2)]).expect("chains");
        // Variances 1 and 49: mean 25, standard error 24.
        assert_eq!(
            (pooled.sd, pooled.standard_error, pooled.largest),
            (5.0, 2.4, 7.0)
        );
        let one = EstimateNoise::pooled(&[(2.0, 0.3)]).expect("a chain");
        assert_eq!((one.sd, one.standard_error), (2.0, 0.3));
        assert_eq!(EstimateNoise::pooled(&[]), None);
    }

    #[test]
    fn undefined_with_a_reason() {
        let name =
            |replicates: &[Vec<f64>]| estimate_noise(replicates).expect_err("undefined").name();
        assert_eq!(name(&[]), "too-few");
        assert_eq!(name(&[vec![1.0, 2.0], vec![1.0]]), "too-short");
        assert_eq!(name(&[vec![1.0, f64::NEG_INFINITY]]), "not-finite");
        assert_eq!(name(&[vec![1.0, 1.0]]), "constant");
    }
}
