//! The recovery rate of a cell: the share of worlds, or of chains, that recover the truth.
//!
//! The unit is the world, never the draw: chains on one world share its noise, and draws of one
//! chain share everything. A world's outcome is the share of its chains that recover.

//!
//! **Interval.** Where every chain of a world agrees, worlds are Bernoulli trials and the interval is Wilson's on
//! their number n. Otherwise it is Wilson's at an *effective* number of trials,
//!
//! ```text
//! n_eff = p̄ (1 − p̄) / (s²/n) · (z / t)²,    at least n and at most n² / Σ 1/m_w,
//! ```
//!
//! with p̄ and s² the mean and variance of the n worlds' shares, z the 97.5 % quantile of the normal law, t that of
//! Student's with n − 1 degrees of freedom, and m_w the chains of world w (Korn & Graubard, Survey Methodology 24, 1998,
//! for n_eff; Dean & Pagano, Journal of Survey Statistics and Methodology 3, 2015, for Wilson's interval at it). No law
//! on [0, 1] varies more than 0s and 1s, hence the lower bound; chains are at best independent, hence the upper one.
//! Where all shares are equal no spread is seen that one could go by, and n counts. So no interval has a width of 0.
//!
//! **Error.** Half the width of that interval, [`Rate::error`].

use super::interval::{Interval, Z_95, wilson, wilson_at};
use super::student::student_quantile;

/// How an interval was had.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum IntervalKind {
    /// Wilson on the number of worlds: every world's chains agree.
    WilsonWorlds,
    /// Wilson at the effective number of trials, between the number of worlds and that of chains.
    WilsonEffective,
    /// Student's law over worlds, each the mean of many cells.
    StudentWorlds,
    /// Wilson on the number of chains of the one data set: says how surely the sampler recovers on
    /// these data, and nothing of other data.
    SamplerOnly,
    /// Too few outcomes for an interval.
    None,
}

impl IntervalKind {
    /// In words, for tables and captions.
    pub fn words(self) -> &'static str {
        match self {
            Self::WilsonWorlds => "Wilson over worlds",
            Self::WilsonEffective => "Wilson at effective n",
            Self::StudentWorlds => "Student over worlds",
            Self::SamplerOnly => "sampler only (Wilson over chains)",
            Self::None => "no interval",
        }
    }
}

/// A rate with its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    /// The mean over worlds.
    pub rate: f64,
    /// Its 95 % interval.
    pub interval: Option<Interval>,
    /// How the interval was had.
    pub kind: IntervalKind,
    /// Number of units: worlds, or chains if there is one data set only.
    pub n: usize,
}

impl Rate {
    /// Monte Carlo error of the rate: half the width of its 95 % interval, never 0; `None` without an interval.
    pub fn error(&self) -> Option<f64> {
        self.interval
            .map(|interval| (interval.high - interval.low) / 2.0)
    }
}

/// The least error that any outcomes of n independent trials leave, that of none or all of them: z² / (2 (n + z²)).
pub fn least_error(n: f64) -> f64 {
    let z2 = Z_95 * Z_95;
    z2 / (2.0 * (n + z2))
}

/// From the outcomes of the chains of every world; worlds without outcomes do not count. `None`
/// without any outcome. `many_worlds`: whether the worlds are replicates of a
/// simulation; otherwise there is one data set, and the units are its chains.
pub fn recovery_rate(worlds: &[Vec<bool>], many_worlds: bool) -> Option<Rate> {
    let worlds: Vec<&Vec<bool>> = worlds
        .iter()
        .filter(|outcomes| !outcomes.is_empty())
        .collect();
    let share =
        |outcomes: &[bool]| outcomes.iter().filter(|&&o| o).count() as f64 / outcomes.len() as f64;
    let shares: Vec<f64> = worlds.iter().map(|outcomes| share(outcomes)).collect();
    if shares.is_empty() {
        return None;
    }
    if !many_worlds {
        let rate = shares.iter().sum::<f64>() / shares.len() as f64;
        let outcomes: Vec<bool> = worlds
            .iter()
            .flat_map(|outcomes| outcomes.iter().copied())
            .collect();
        let successes = outcomes.iter().filter(|&&o| o).count() as u64;
        let interval = wilson(successes as f64, outcomes.len() as u64);
        return Some(Rate {
            rate,
            interval,
            kind: IntervalKind::SamplerOnly,
            n: outcomes.len(),
        });
    }
    let n = shares.len();
    let rate = shares.iter().sum::<f64>() / n as f64;
    let all_equal = shares.iter().all(|share| *share == shares[0]);
    if all_equal || shares.iter().all(|&s| s == 0.0 || s == 1.0) {
        let interval = wilson(rate * n as f64, n as u64);
        return Some(Rate {
            rate,
            interval,
            kind: IntervalKind::WilsonWorlds,
            n,
        });
    }
    let n_effective = effective_trials(&shares, &worlds, rate);
    Some(Rate {
        rate,
        interval: Some(wilson_at(rate, n_effective)),
        kind: IntervalKind::WilsonEffective,
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
mod tests {
    use super::*;
    use crate::rng::Purpose;
    use rand::RngExt;

    #[test]
    fn the_unit_is_the_world() {
        let agree = recovery_rate(&[vec![true; 50], vec![false; 50]], true).expect("outcomes");
        assert_eq!(
            (agree.rate, agree.kind, agree.n),
            (0.5, IntervalKind::WilsonWorlds, 2)
        );
        // A hundred chains say no more than two worlds.
        assert_eq!(agree.interval, wilson(1.0, 2));
        let differ = recovery_rate(&[vec![true, false], vec![true; 2], vec![]], true);
        let differ = differ.expect("outcomes");
        assert_eq!(
            (differ.rate, differ.kind, differ.n),
            (0.75, IntervalKind::WilsonEffective, 2)
        );
        // Two worlds say so little of their spread that no more than two trials count.
        assert_eq!(differ.interval, wilson(1.5, 2));
        let lone = recovery_rate(&[vec![true, false]], true).expect("outcomes");
        assert_eq!(lone.interval, wilson(0.5, 1));
        let csv = recovery_rate(&[vec![true; 4]], false).expect("outcomes");
        assert_eq!(
            (csv.kind, csv.n, csv.interval),
            (IntervalKind::SamplerOnly, 4, wilson(4.0, 4))
        );
        let halves = recovery_rate(&vec![vec![true, false]; 5], true).expect("outcomes");
        assert_eq!(
            (halves.rate, halves.kind),
            (0.5, IntervalKind::WilsonWorlds)
        );
        assert_eq!(halves.interval, wilson(2.5, 5));
        assert_eq!(recovery_rate(&[], true), None);
    }

    /// By hand: shares ½ of eighteen worlds and 1 of two, of two chains each, have the mean 0.55 and the variance
    /// 0.45/19, which is worth 209 trials; (1.959964/2.093024)² takes that down to 183, still more than the 40 chains.
    #[test]
    fn effective_trials_lie_between_worlds_and_chains() {
        let mut worlds = vec![vec![true, false]; 18];
        worlds.extend([vec![true, true], vec![true, true]]);
        let found = recovery_rate(&worlds, true).expect("outcomes");
        assert_eq!(found.kind, IntervalKind::WilsonEffective);
        let (found, expected) = (found.interval, wilson(22.0, 40));
        assert_eq!(
            found.map(|i| i.low.to_bits()),
            expected.map(|i| i.low.to_bits())
        );
        // 0, ½ and 1 in equal parts of thirty: s² = 5/29, n_eff = 0.25 / (5/870) · (1.959964/2.045230)² = 39.9487.
        let parts = [vec![false, false], vec![true, false], vec![true, true]];
        let worlds: Vec<Vec<bool>> = (0..30).map(|world| parts[world % 3].clone()).collect();
        let found = recovery_rate(&worlds, true).and_then(|rate| rate.error());
        let expected = wilson_at(0.5, 39.9487);
        let expected = (expected.high - expected.low) / 2.0;
        assert!(
            (found.expect("an interval") - expected).abs() < 1e-6,
            "{found:?} {expected}"
        );
    }

    #[test]
    fn no_rate_is_known_without_error() {
        for (n, chains) in [(1, 1), (1, 5), (3, 2), (40, 2)] {
            for all in [false, true] {
                let rate = recovery_rate(&vec![vec![all; chains]; n], true).expect("outcomes");
                let error = rate.error().expect("an interval");
                assert!((error - least_error(n as f64)).abs() < 1e-12 && error > 0.0);
            }
        }
        // One chain of eighty that fails leaves a rate near 1 with an error, too.
        let mut worlds = vec![vec![true; 2]; 40];
        worlds[7][1] = false;
        let found = recovery_rate(&worlds, true).expect("outcomes");
        let interval = found.interval.expect("an interval");
        assert!(interval.high < 1.0 && interval.low > 0.9, "{interval:?}");
        assert!(found.error().expect("an interval") > least_error(80.0));
    }

    /// Worlds whose probability of success has the law Beta(μk, (1 − μ)k), from all but equal (k = 49) to nearly 0 or
    /// 1 (k = 1/9). Of 2,000 experiments at least 95 % less 2.5 (Wilson's own dips: its coverage falls to about 93 % at
    /// some p and n, Brown, Cai & DasGupta, Statistical Science 16, 2001) less three binomial standard errors hold μ.
    #[test]
    fn covers_however_much_worlds_differ() {
        let mut rng = Purpose::new("test", 11).generator();
        let n_experiments = 2000;
        let least = 0.95 - 0.025 - 3.0 * (0.95_f64 * 0.05 / f64::from(n_experiments)).sqrt();
        for (n_worlds, n_chains) in [(5, 2), (10, 4), (40, 2)] {
            for k in [49.0, 7.0 / 3.0, 1.0 / 9.0] {
                for mean in [0.5, 0.9] {
                    let law = rand_distr::Beta::new(mean * k, (1.0 - mean) * k).expect("positive");
                    let mut held = 0;
                    for _ in 0..n_experiments {
                        let worlds: Vec<Vec<bool>> = (0..n_worlds)
                            .map(|_| {
                                let p: f64 = rand_distr::Distribution::sample(&law, &mut rng);
                                (0..n_chains).map(|_| rng.random::<f64>() < p).collect()
                            })
                            .collect();
                        let rate = recovery_rate(&worlds, true).expect("outcomes");
                        let interval = rate.interval.expect("an interval");
                        held += u32::from(interval.low <= mean && mean <= interval.high);
                    }
                    let share = f64::from(held) / f64::from(n_experiments);
                    assert!(share > least, "{n_worlds} {n_chains} {k} {mean}: {share}");
                }
            }
        }
    }
}
