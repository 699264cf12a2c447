//! The longest time that a chain stood still: a sticky estimate shows here first.

use super::undefined::{FEWEST_CHANGES, Undefined};

/// γ, Euler's constant.
const EULER_GAMMA: f64 = 0.577_215_664_901_532_9;

/// The longest stretch without an accepted move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LongestHold {
    /// Its number of steps.
    pub steps: u64,
    /// Its share of the chain.
    pub share: f64,
    /// What would be expected of it.
    pub expected: Result<ExpectedHold, Undefined>,
    /// Accepted moves.
    pub n_moves: u64,
    /// Steps.
    pub n_steps: u64,
}

/// The longest hold of a chain that accepts every step with the same probability.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedHold {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub sd: f64,
}

impl LongestHold {
    /// How many standard deviations longer it is than expected; `None` where that is undefined.
    /// Some states are harder to leave than others, so a few are no surprise; tens of them are.
    pub fn excess(&self) -> Option<f64> {
        let expected = self.expected.ok().filter(|expected| expected.sd > 0.0)?;
        Some((self.steps as f64 - expected.mean) / expected.sd)
    }
}

/// From the lengths of a chain's runs in steps, in order; each but the first begins with an
/// accepted move. The longest of the gaps between successes in n trials of probability p is ln(n
/// p)/λ + γ/λ + ½ steps on average, λ = −ln(1 − p), with variance π²/(6λ²) + 1/12 (Gordon,
/// Schilling & Waterman, Probability Theory and Related Fields 72, 1986, for the run without the
/// step that ends it).
///
/// # Errors
/// [`Undefined::TooShort`] without steps.
pub fn longest_hold(run_lengths: &[u64]) -> Result<LongestHold, Undefined> {
    let n_steps: u64 = run_lengths.iter().sum();
    let steps = run_lengths.iter().copied().max().unwrap_or(0);
    if n_steps == 0 {
        return Err(Undefined::TooShort { n: 0, fewest: 1 });
    }
    let n_moves = run_lengths.len() as u64 - 1;
    Ok(LongestHold {
        steps,
        share: steps as f64 / n_steps as f64,
        expected: expected(n_moves, n_steps),
        n_moves,
        n_steps,
    })
}

fn expected(n_moves: u64, n_steps: u64) -> Result<ExpectedHold, Undefined> {
    if n_moves < FEWEST_CHANGES {
        return Err(Undefined::TooRare {
            n_changes: n_moves,
            fewest: FEWEST_CHANGES,
        });
    }
    let decay = -libm::log1p(-(n_moves as f64 / n_steps as f64));
    let pi = std::f64::consts::PI;
    // The formula is that of a limit; a chain that moves nearly always has holds of one step.
    let mean = (libm::log(n_moves as f64) + EULER_GAMMA) / decay + 0.5;
    Ok(ExpectedHold {
        mean: mean.max(1.0),
        sd: (pi * pi / (6.0 * decay * decay) + 1.0 / 12.0).sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;
    use rand::RngExt;

    /// Over 400 chains of 20,000 steps that move with probability 0.02: five standard errors of the
    /// mean.
    #[test]
    fn as_long_as_expected_where_every_step_is_alike() {
        let mut rng = Purpose::new("hold", 1).generator();
        let mut excess = Vec::new();
        for _ in 0..400 {
            let mut runs = vec![0];
            for _ in 0..20_000 {
                if rng.random::<f64>() < 0.02 {
                    runs.push(0);
                }
                *runs.last_mut().expect("a run") += 1;
            }
            excess.push(longest_hold(&runs).expect("steps").excess().expect("moves"));
        }
        let n = excess.len() as f64;
        let mean = excess.iter().sum::<f64>() / n;
        let variance = excess.iter().map(|z| (z - mean) * (z - mean)).sum::<f64>() / n;
        assert!(mean.abs() < 5.0 / n.sqrt(), "{mean}");
        // The fourth moment of a Gumbel law is 5.4: the error of the variance is √(4.4/n).
        assert!(
            (variance - 1.0).abs() < 5.0 * (4.4 / n).sqrt(),
            "{variance}"
        );
    }

    #[test]
    fn a_sticky_stretch_stands_out() {
        let mut runs = vec![50; 200];
        runs[100] = 5000;
        let found = longest_hold(&runs).expect("steps");
        assert_eq!(
            (found.steps, found.n_moves, found.n_steps),
            (5000, 199, 14_950)
        );
        assert!(found.excess().expect("moves") > 30.0);
        let still = longest_hold(&[1000]).expect("steps");
        assert_eq!((still.share, still.excess()), (1.0, None));
        assert_eq!(
            longest_hold(&[]),
            Err(Undefined::TooShort { n: 0, fewest: 1 })
        );
        let busy = longest_hold(&[1; 100]).expect("steps");
        assert!(busy.excess().expect("moves").abs() < 3.0, "{busy:?}");
    }
}
