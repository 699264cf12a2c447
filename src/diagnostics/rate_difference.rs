//! Can two recovery rates be told apart? The one test that every "better" and every "cannot be told
//! apart" rests on.
//!
//! All tests are exact permutation tests of the difference of two mean shares: what else could have
//! come, were there no difference, and how much of that lies at least as far apart as what did. p
//! is two-sided. Overlapping intervals are no test: 18 of 20 and 10 of 20 have intervals that
//! overlap, and p = 0.014.
//!
//! | the two rates are of | if nothing differs, one may exchange | with one chain a world it is |
//! |---|---|---|
//! | the same worlds | A and B on each world, independently | McNemar's exact test, the sign test |
//! | other worlds each | worlds of A with worlds of B | Fisher's exact test |
//! | one data set | chains of A with chains of B | Fisher's exact test |
//!
//! The first two speak of new worlds, as the world is what varies. Fewer than [`FEWEST_WORLDS`]
//! worlds that both have can never show a difference that way (p ≥ 0.0625). Then chains are
//! exchanged within each world instead ([`stratified_p_value`]), and the answer is of these worlds
//! only: [`Scope::TheseWorlds`], which may also be asked for.
//!
//! Shares are multiples of 1/L, L the least common multiple of the numbers of chains; above
//! 50,000 sums they are rounded to coarser multiples. A permutation test of rounded
//! numbers is still exact.

use super::stratified::{Stratum, stratified_p_value};

/// Worlds that both must have for the least p-value of a sign test, 2^(1 − n), to be below 0.05.
pub const FEWEST_WORLDS: usize = 6;
/// Multiples of a share that are kept apart at most.
const MOST_PARTS: u64 = 5040;
/// Sums that are kept apart at most.
const MOST_STATES: u64 = 50_000;
/// Steps of the table of independent worlds at most; larger ones are judged by the normal law.
const MOST_STEPS: usize = 200_000_000;

/// How the units of two rates belong together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pairing {
    /// World k of A is world k of B.
    SameWorlds,
    /// The worlds of A are others than those of B.
    OtherWorlds,
    /// There is one data set, the same or not, and the units are chains.
    OneDataSet,
}

/// What a test speaks of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// New worlds of the same kind.
    NewWorlds,
    /// The worlds that were run, and no others.
    TheseWorlds,
}

/// Which test was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RateTest {
    /// Signs of the differences on worlds that both have.
    SignFlip,
    /// Fisher's, on worlds of which each recovers in all chains or in none.
    FisherWorlds,
    /// Worlds of A exchanged with worlds of B, by their shares.
    Permutation,
    /// Fisher's, on the chains of one data set.
    FisherChains,
    /// Chains exchanged within each world (Mantel & Haenszel).
    ChainsWithinWorlds,
}

impl RateTest {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::SignFlip => "exact sign test over worlds",
            Self::FisherWorlds => "Fisher’s exact test over worlds",
            Self::Permutation => "permutation test over worlds",
            Self::FisherChains => "Fisher’s exact test over chains",
            Self::ChainsWithinWorlds => "exact test over chains within worlds",
        }
    }

    /// What it speaks of.
    pub fn scope(self) -> Scope {
        match self {
            Self::SignFlip | Self::FisherWorlds | Self::Permutation => Scope::NewWorlds,
            Self::FisherChains | Self::ChainsWithinWorlds => Scope::TheseWorlds,
        }
    }
}

/// Two rates compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateDifference {
    /// The rate of B less that of A, over the units that the test uses.
    pub difference: f64,
    /// Two-sided p-value of "no difference".
    pub p_value: f64,
    /// The least p-value that any outcome with as many successes in all could have given: a test
    /// whose least p-value is above the level never finds anything, and takes nothing from the
    /// others of its family (Tarone, Biometrics 46, 1990).
    pub least_p_value: f64,
    /// Worlds that both have, or units of A and of B.
    pub n: [usize; 2],
    /// Which test.
    pub test: RateTest,
}

/// Compares B with A: of each the outcomes of the chains of every world, by the world's number.
/// Worlds without outcomes do not count; `None` if nothing is left to compare.
pub fn rate_difference(
    a: &[Vec<bool>],
    b: &[Vec<bool>],
    pairing: Pairing,
    scope: Scope,
) -> Option<RateDifference> {
    match pairing {
        Pairing::OneDataSet => {
            let pooled = |worlds: &[Vec<bool>]| vec![worlds.concat()];
            by_chains(&pooled(a), &pooled(b), RateTest::FisherChains)
        }
        Pairing::OtherWorlds => of_other_worlds(a, b),
        Pairing::SameWorlds => {
            let both = |(a, b): &(&Vec<bool>, &Vec<bool>)| !a.is_empty() && !b.is_empty();
            let n_both = a.iter().zip(b).filter(both).count();
            if scope == Scope::TheseWorlds || n_both < FEWEST_WORLDS {
                by_chains(a, b, RateTest::ChainsWithinWorlds)
            } else {
                sign_flip(a, b)
            }
        }
    }
}

fn n_recovered(outcomes: &[bool]) -> u64 {
    outcomes.iter().filter(|recovered| **recovered).count() as u64
}

/// Chains exchanged within each world that both have.
fn by_chains(a: &[Vec<bool>], b: &[Vec<bool>], test: RateTest) -> Option<RateDifference> {
    let of = |(a, b): (&Vec<bool>, &Vec<bool>)| Stratum {
        a: n_recovered(a),
        n_a: a.len() as u64,
        b: n_recovered(b),
        n_b: b.len() as u64,
    };
    let strata: Vec<Stratum> = (a.iter().zip(b))
        .map(of)
        .filter(|world| world.n_a > 0 && world.n_b > 0)
        .collect();
    if strata.is_empty() {
        return None;
    }
    let n_worlds = strata.len();
    let mean = |of: fn(&Stratum) -> f64| strata.iter().map(of).sum::<f64>() / n_worlds as f64;
    let ends = |to_a: bool| {
        let moved = strata.iter().map(|own| {
            let all = own.a + own.b;
            let a = if to_a {
                all.min(own.n_a)
            } else {
                all.saturating_sub(own.n_b)
            };
            Stratum {
                a,
                b: all - a,
                ..*own
            }
        });
        stratified_p_value(&moved.collect::<Vec<_>>())
    };
    let n = match test {
        RateTest::FisherChains => [strata[0].n_a as usize, strata[0].n_b as usize],
        _ => [n_worlds; 2],
    };
    Some(RateDifference {
        difference: mean(|own| own.b as f64 / own.n_b as f64)
            - mean(|own| own.a as f64 / own.n_a as f64),
        p_value: stratified_p_value(&strata),
        least_p_value: ends(true).min(ends(false)),
        n,
        test,
    })
}

/// Shares as multiples of one part, with the number of parts in 1.
struct Parts {
    a: Vec<i64>,
    b: Vec<i64>,
    n_parts: u64,
}

impl Parts {
    fn new(a: &[&Vec<bool>], b: &[&Vec<bool>]) -> Self {
        let chains = || a.iter().chain(b).map(|outcomes| outcomes.len() as u64);
        let common = chains().fold(1_u64, |common, n| {
            let (mut x, mut y) = (common, n);
            while y > 0 {
                (x, y) = (y, x % y);
            }
            (common / x).saturating_mul(n)
        });
        let most = (MOST_STATES / a.len().max(b.len()).max(1) as u64).clamp(1, MOST_PARTS);
        let n_parts = if common <= most { common } else { most };
        let part = |outcomes: &&Vec<bool>| {
            let n = outcomes.len() as u64;
            // Rounded to the nearest; a whole number where n_parts is a multiple of n.
            ((2 * n_recovered(outcomes) * n_parts + n) / (2 * n)) as i64
        };
        Self {
            a: a.iter().map(part).collect(),
            b: b.iter().map(part).collect(),
            n_parts,
        }
    }

    fn difference(&self) -> f64 {
        let mean = |of: &[i64]| of.iter().sum::<i64>() as f64 / of.len() as f64;
        (mean(&self.b) - mean(&self.a)) / self.n_parts as f64
    }
}

/// The signs of the differences on worlds that both have.
fn sign_flip(a: &[Vec<bool>], b: &[Vec<bool>]) -> Option<RateDifference> {
    let both = a.iter().zip(b);
    let both = both.filter(|(a, b)| !a.is_empty() && !b.is_empty());
    let (a, b): (Vec<&Vec<bool>>, Vec<&Vec<bool>>) = both.unzip();
    let parts = Parts::new(&a, &b);
    let differences = parts.a.iter().zip(&parts.b).map(|(a, b)| b - a);
    let differences: Vec<i64> = differences.filter(|d| *d != 0).collect();
    let observed = differences.iter().sum::<i64>().unsigned_abs();
    Some(RateDifference {
        difference: parts.difference(),
        p_value: sign_flip_p_value(&differences, observed),
        least_p_value: libm::exp2(1.0 - differences.len() as f64).min(1.0),
        n: [a.len(); 2],
        test: RateTest::SignFlip,
    })
}

/// The probability that the sum of these numbers with random signs is at least as far from 0 as
/// `observed`.
fn sign_flip_p_value(differences: &[i64], observed: u64) -> f64 {
    // The law of the sum of those that have a plus, from 0 on.
    let mut law = vec![1.0_f64];
    for difference in differences {
        let step = difference.unsigned_abs() as usize;
        let mut next = vec![0.0; law.len() + step];
        for (sum, p) in law.iter().enumerate() {
            next[sum] += p / 2.0;
            next[sum + step] += p / 2.0;
        }
        law = next;
    }
    let total = law.len() as u64 - 1;
    let is_as_far = |sum: u64| (2 * sum).abs_diff(total) >= observed;
    let far = law.iter().enumerate();
    let far = far.filter(|(sum, _)| is_as_far(*sum as u64));
    far.map(|(_, p)| p).sum::<f64>().min(1.0)
}

/// Worlds of A exchanged with worlds of B.
fn of_other_worlds(a: &[Vec<bool>], b: &[Vec<bool>]) -> Option<RateDifference> {
    let with_outcome = |worlds: &'_ [Vec<bool>]| -> Vec<usize> {
        (0..worlds.len())
            .filter(|w| !worlds[*w].is_empty())
            .collect()
    };
    let (in_a, in_b) = (with_outcome(a), with_outcome(b));
    if in_a.is_empty() || in_b.is_empty() {
        return None;
    }
    let a: Vec<&Vec<bool>> = in_a.into_iter().map(|w| &a[w]).collect();
    let b: Vec<&Vec<bool>> = in_b.into_iter().map(|w| &b[w]).collect();
    let n = [a.len(), b.len()];
    let agree = |outcomes: &&&Vec<bool>| {
        let k = n_recovered(outcomes);
        k == 0 || k == outcomes.len() as u64
    };
    if a.iter().chain(&b).filter(agree).count() == n[0] + n[1] {
        let first = |worlds: &[&Vec<bool>]| vec![worlds.iter().map(|own| own[0]).collect()];
        return by_chains(&first(&a), &first(&b), RateTest::FisherChains).map(|found| {
            RateDifference {
                test: RateTest::FisherWorlds,
                ..found
            }
        });
    }
    let parts = Parts::new(&a, &b);
    let all: Vec<i64> = parts.a.iter().chain(&parts.b).copied().collect();
    let own: i64 = parts.a.iter().sum();
    let (p_value, least_p_value) = exchange_p_values(&all, n[0], own);
    Some(RateDifference {
        difference: parts.difference(),
        p_value,
        least_p_value,
        n,
        test: RateTest::Permutation,
    })
}

/// The probability that the sum of `n_own` of these numbers, chosen at random, is at least as far
/// from its mean as `own`; and the least such probability of any sum.
fn exchange_p_values(all: &[i64], n_own: usize, own: i64) -> (f64, f64) {
    let n = all.len();
    let total: i64 = all.iter().sum();
    // n times the distance of a sum from the mean, a whole number.
    let distance = |sum: i64| (sum * n as i64 - total * n_own as i64).unsigned_abs();
    let width = total as usize + 1;
    if n_own * width > MOST_STEPS / n {
        return by_the_normal_law(all, n_own, own);
    }
    // By the number chosen and their sum, the share of all choices; numbers are taken one by one.
    let mut ways = vec![vec![0.0_f64; width]; n_own + 1];
    ways[0][0] = 1.0;
    for (taken, number) in all.iter().enumerate() {
        let step = *number as usize;
        for chosen in (1..=n_own.min(taken + 1)).rev() {
            let (before, after) = ways.split_at_mut(chosen);
            let from = &before[chosen - 1];
            for sum in (step..width).rev() {
                after[0][sum] += from[sum - step];
            }
        }
    }
    let law = &ways[n_own];
    let count: f64 = law.iter().sum();
    let at_least = |bound: u64| {
        let far = law.iter().enumerate();
        let far = far.filter(|(sum, _)| distance(*sum as i64) >= bound);
        far.map(|(_, ways)| ways).sum::<f64>() / count
    };
    let possible = law.iter().enumerate().filter(|(_, ways)| **ways > 0.0);
    let farthest = possible.map(|(sum, _)| distance(sum as i64)).max();
    (
        at_least(distance(own)).min(1.0),
        at_least(farthest.unwrap_or(0)),
    )
}

/// The same for many worlds, by the mean and variance of the sum.
fn by_the_normal_law(all: &[i64], n_own: usize, own: i64) -> (f64, f64) {
    let n = all.len() as f64;
    let mean = all.iter().sum::<i64>() as f64 / n;
    let squares: f64 = all.iter().map(|x| (*x as f64 - mean).powi(2)).sum();
    let m = n_own as f64;
    let variance = m * (n - m) / (n * (n - 1.0)) * squares;
    let z = (own as f64 - m * mean) / variance.sqrt();
    (libm::erfc(z.abs() / std::f64::consts::SQRT_2), 0.0)
}

#[cfg(test)]
#[path = "tests/rate_difference.rs"]
mod tests;
