//! How many partitions, splits and merges there are, in natural logarithms where they overflow.

/// ln S(n, 2), the Stirling number of the **second** kind: the number of ways to split a set of
/// n ≥ 2 members in two, 2^{n−1} − 1 (Ranganathan & Dellaert 2006; the source report's "first
/// kind" is a slip that breaks detailed balance).
pub fn ln_stirling_second_2(n: usize) -> f64 {
    assert!(n >= 2, "a set of one member has no split");
    let bits = (n - 1) as f64;
    bits * std::f64::consts::LN_2 + libm::log1p(-libm::exp2(-bits))
}

/// ln c(n, 2), the unsigned Stirling number of the **first** kind, (n−1)!·H_{n−1} with the
/// harmonic number H: what the source report's program put into its ratio. Wrong there; kept for
/// the labelled fault `--split prefix-cut`.
pub fn ln_stirling_first_2(n: usize) -> f64 {
    assert!(n >= 2, "a set of one member has no split");
    let harmonic: f64 = (1..n).rev().map(|k| 1.0 / k as f64).sum();
    libm::lgamma(n as f64) + libm::log(harmonic)
}

/// N_m = C(M, 2): the number of merges out of a topology of M sets.
pub fn n_merges(n_sets: usize) -> f64 {
    let m = n_sets as f64;
    m * (m - 1.0) / 2.0
}

/// The Bell number: how many partitions n detections have; `None` where it exceeds 128 bits.
pub fn bell(n: usize) -> Option<u128> {
    // The Bell triangle: each row starts with the last entry of the row before it.
    let mut row = vec![1_u128];
    for _ in 1..n.max(1) {
        let mut next = vec![*row.last()?];
        for &above in &row {
            next.push(next.last()?.checked_add(above)?);
        }
        row = next;
    }
    row.last().copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_counts() {
        assert_eq!(bell(0), Some(1));
        assert_eq!(bell(1), Some(1));
        assert_eq!(bell(4), Some(15));
        assert_eq!(bell(6), Some(203));
        assert_eq!(bell(16), Some(10_480_142_147));
        assert_eq!(bell(200), None);
        for (n, splits) in [(2, 1.0_f64), (3, 3.0), (4, 7.0), (10, 511.0)] {
            assert!((ln_stirling_second_2(n) - splits.ln()).abs() < 1e-14, "{n}");
        }
        // c(4, 2) = 11, c(5, 2) = 50, c(6, 2) = 274.
        for (n, cycles) in [(2, 1.0_f64), (3, 3.0), (4, 11.0), (5, 50.0), (6, 274.0)] {
            assert!((ln_stirling_first_2(n) - cycles.ln()).abs() < 1e-14, "{n}");
        }
    }

    #[test]
    fn no_overflow_at_ten_thousand() {
        assert!((ln_stirling_second_2(10_000) - 9_999.0 * std::f64::consts::LN_2).abs() < 1e-9);
        assert!(ln_stirling_first_2(10_000).is_finite());
    }
}
