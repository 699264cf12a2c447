//! The recovery rate of a cell: the share of worlds, or of chains, that recover the truth.
//!
//! The unit is the world, never the draw: chains on one world share its noise, and draws of one
//! chain share everything. A world's outcome is the share of its chains that recover.
//!
//! **Interval.** Where every chain of a world agrees, worlds are Bernoulli trials and the interval
//! is that of Clopper & Pearson on their number n: it holds the true rate with a probability of at
//! least 95 %, whatever the rate. Otherwise it is theirs at an *effective* number of trials (Korn &
//! Graubard, Survey Methodology 24, 1998),
//!
//! ```text
//! n_eff = p̄ (1 − p̄) / (s²/n) · (z / t)²,    at least n and at most n² / Σ 1/m_w,
//! ```
//!
//! with p̄ and s² the mean and variance of the n worlds' shares, z the 97.5 % quantile of the
//! normal law, t that of Student's with n − 1 degrees of freedom, and m_w the chains of world w. No
//! law on [0, 1] varies more than 0s and 1s, hence the lower bound; chains are at best independent,
//! hence the upper one. Where all shares are equal no spread is seen that one could go by, and n
//! counts. So no interval has a width of 0.
//!
//! **Error.** Half the width of that interval, [`Rate::error`].

use super::interval::{Interval, Z_95, clopper_pearson};
use super::student::student_quantile;

/// What the interval of a rate rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IntervalKind {
    /// Exact on the number of worlds: every world's chains agree.
    Worlds,
    /// At the effective number of trials, between the number of worlds and that of chains.
    EffectiveTrials,
    /// Exact on the number of chains of the one data set: says how surely the sampler recovers on
    /// these data, and nothing of other data.
    SamplerOnly,
}

impl IntervalKind {
    /// In words, for tables and captions.
    pub fn words(self) -> &'static str {
        match self {
            Self::Worlds => "exact over worlds",
            Self::EffectiveTrials => "exact at effective n",
            Self::SamplerOnly => "sampler only (exact over chains)",
        }
    }
}

/// More than so many tens of trials no plan asks for: ± 5 points take at most 400.
const MOST_TENS: usize = 1000;

/// A rate with its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    /// The mean over worlds.
    pub rate: f64,
    /// Its 95 % interval, of a width above 0.
    pub interval: Interval,
    /// What the interval rests on.
    pub kind: IntervalKind,
    /// Number of units: worlds, or chains if there is one data set only.
    pub n: usize,
}

impl Rate {
    /// Monte Carlo error of the rate: half the width of its 95 % interval, never 0.
    pub fn error(&self) -> f64 {
        (self.interval.high - self.interval.low) / 2.0
    }

    /// Independent trials that would give a rate like this to ± `error`, rounded up to tens: half
    /// the width of the interval of Clopper & Pearson at this share. At 0 and 1 the interval is
    /// one-sided, and the numbers are the fewest.
    pub fn worlds_for(&self, error: f64) -> usize {
        let is_enough = |n: &usize| {
            let n = *n as f64;
            let found = clopper_pearson(self.rate * n, n);
            found.high - found.low <= 2.0 * error
        };
        (1..=MOST_TENS)
            .map(|tens| 10 * tens)
            .find(is_enough)
            .unwrap_or(10 * MOST_TENS)
    }
}

/// The least error that any outcomes of n independent trials leave, that of none or all of them: (1
/// − 0.025^(1/n)) / 2.
pub fn least_error(n: f64) -> f64 {
    let none = clopper_pearson(0.0, n);
    (none.high - none.low) / 2.0
}

/// From the outcomes of the chains of every world; worlds without outcomes do not count. `None`
/// without any outcome. `many_worlds`: whether the worlds are replicates of a
/// simulation; otherwise there is one data set, and the units are its chains.
pub fn recovery_rate(worlds: &[Vec<bool>], many_worlds: bool) -> Option<Rate> {
    let worlds: Vec<&Vec<bool>> = worlds
        .iter()
        .filter(|outcomes| !outcomes.is_empty())
        .collect();
    let count = |outcomes: &[bool]| outcomes.iter().filter(|&&o| o).count() as f64;
    if worlds.is_empty() {
        return None;
    }
    if !many_worlds {
        let n: usize = worlds.iter().map(|outcomes| outcomes.len()).sum();
        let successes: f64 = worlds.iter().map(|outcomes| count(outcomes)).sum();
        return Some(Rate {
            rate: successes / n as f64,
            interval: clopper_pearson(successes, n as f64),
            kind: IntervalKind::SamplerOnly,
            n,
        });
    }
    let share = |outcomes: &&Vec<bool>| count(outcomes) / outcomes.len() as f64;
    let shares: Vec<f64> = worlds.iter().map(share).collect();
    let n = shares.len();
    let sum: f64 = shares.iter().sum();
    let rate = sum / n as f64;
    let all_equal = shares.iter().all(|share| *share == shares[0]);
    let (n_trials, kind) = if all_equal || shares.iter().all(|&s| s == 0.0 || s == 1.0) {
        (n as f64, IntervalKind::Worlds)
    } else {
        let n_trials = effective_trials(&shares, &worlds, rate);
        (n_trials, IntervalKind::EffectiveTrials)
    };
    // Whole sums stay whole, so that 0 of n and n of n are seen as such.
    let successes = if n_trials == n as f64 {
        sum
    } else {
        rate * n_trials
    };
    Some(Rate {
        rate,
        interval: clopper_pearson(successes, n_trials),
        kind,
        n,
    })
}

/// Independent trials that the mean of these shares, not all equal, is worth.
fn effective_trials(shares: &[f64], worlds: &[&Vec<bool>], rate: f64) -> f64 {
    let n = shares.len() as f64;
    let squares: f64 = shares.iter().map(|share| (share - rate).powi(2)).sum();
    let variance_of_mean = squares / (n - 1.0) / n;
    let few = Z_95 / student_quantile(n - 1.0);
    let n_effective = rate * (1.0 - rate) / variance_of_mean * few * few;
    let harmonic: f64 = worlds.iter().map(|chains| 1.0 / chains.len() as f64).sum();
    n_effective.clamp(n, n * n / harmonic)
}

#[cfg(test)]
#[path = "tests/rate.rs"]
mod tests;
