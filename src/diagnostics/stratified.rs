//! Do two programs succeed equally often, on the same worlds? An exact test that lets worlds differ.
//!
//! On world k, A succeeds in a_k of n_k chains and B in b_k of m_k. If a chain's law is the same in both, then
//! given a_k + b_k all choices of which chains those were are equally likely, however hard the world: a_k is
//! hypergeometric, independently over the worlds. The p-value is the probability of all values of Σ a_k that are
//! no likelier than the one found (the exact form of the test of Mantel & Haenszel, Journal of the National
//! Cancer Institute 22, 1959; Fisher's for one world).

/// Successes and chains of A, then of B, on one world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stratum {
    /// Successes of A.
    pub a: u64,
    /// Chains of A.
    pub n_a: u64,
    /// Successes of B.
    pub b: u64,
    /// Chains of B.
    pub n_b: u64,
}

/// Two-sided; 1 where nothing could differ.
pub fn stratified_p_value(strata: &[Stratum]) -> f64 {
    // Law of Σ a_k, from its least value on.
    let (mut law, mut observed) = (vec![1.0], 0);
    for stratum in strata {
        let successes = stratum.a + stratum.b;
        let least = successes.saturating_sub(stratum.n_b);
        let most = successes.min(stratum.n_a);
        let ln_weight = |a: u64| ln_choose(stratum.n_a, a) + ln_choose(stratum.n_b, successes - a);
        let ln_all = ln_choose(stratum.n_a + stratum.n_b, successes);
        let own: Vec<f64> = (least..=most)
            .map(|a| libm::exp(ln_weight(a) - ln_all))
            .collect();
        let mut sum = vec![0.0; law.len() + own.len() - 1];
        for (i, p) in law.iter().enumerate() {
            for (j, q) in own.iter().enumerate() {
                sum[i + j] += p * q;
            }
        }
        law = sum;
        observed += (stratum.a - least) as usize;
    }
    // What is as likely but for rounding counts as no likelier.
    let bound = law[observed] * (1.0 + 1e-9);
    let p: f64 = law.iter().filter(|p| **p <= bound).sum();
    p.min(1.0)
}

fn ln_choose(n: u64, k: u64) -> f64 {
    let ln_factorial = |n: u64| libm::lgamma(n as f64 + 1.0);
    ln_factorial(n) - ln_factorial(k) - ln_factorial(n - k)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stratum(a: u64, n_a: u64, b: u64, n_b: u64) -> Stratum {
        Stratum { a, n_a, b, n_b }
    }

    /// `scipy.stats.fisher_exact([[8, 2], [1, 5]])` and `([[3, 1], [1, 3]])`, scipy 1.17.1.
    #[test]
    fn one_world_is_fishers_test() {
        let found = stratified_p_value(&[stratum(8, 10, 1, 6)]);
        assert!((found - 0.034_965_034_965_034_97).abs() < 1e-12, "{found}");
        let found = stratified_p_value(&[stratum(3, 4, 1, 4)]);
        assert!((found - 0.485_714_285_714_285_7).abs() < 1e-12, "{found}");
    }

    #[test]
    fn worlds_add_up() {
        // Two chains each, all of one and none of the other: probability 1/6 a world, either way round.
        let apart = [stratum(2, 2, 0, 2); 5];
        let found = stratified_p_value(&apart);
        assert!((found - 2.0 / 6.0_f64.powi(5)).abs() < 1e-12, "{found}");
        // Worlds on which all succeed, or none, say nothing.
        let with_others = [&apart[..], &[stratum(2, 2, 2, 2), stratum(0, 2, 0, 2)]].concat();
        assert!((stratified_p_value(&with_others) - found).abs() < 1e-15);
        assert_eq!(stratified_p_value(&[]), 1.0);
    }

    /// Of all outcomes of two worlds, those with p ≤ α have a probability of at most α, whatever the
    /// worlds' own probabilities of success.
    #[test]
    fn holds_its_level_exactly() {
        let binomial = |n: u64, k: u64, p: f64| {
            libm::exp(ln_choose(n, k)) * p.powi(k as i32) * (1.0 - p).powi((n - k) as i32)
        };
        for (p, q) in [(0.5, 0.5), (0.1, 0.8), (0.3, 0.95)] {
            let mut rejected = 0.0;
            for (a, b) in (0..=4).flat_map(|a| (0..=4).map(move |b| (a, b))) {
                for (c, d) in (0..=4).flat_map(|c| (0..=4).map(move |d| (c, d))) {
                    let strata = [stratum(a, 4, b, 4), stratum(c, 4, d, 4)];
                    if stratified_p_value(&strata) <= 0.05 {
                        rejected += binomial(4, a, p)
                            * binomial(4, b, p)
                            * binomial(4, c, q)
                            * binomial(4, d, q);
                    }
                }
            }
            assert!(rejected > 0.0 && rejected <= 0.05, "{p} {q}: {rejected}");
        }
    }
}
