//! Sums in log space, with the functions of `libm` so that every machine computes the same bits.

/// ln( (1/R) Σ_r exp(x_r) ) of R ≥ 1 values; −∞ if all are −∞.
///
/// Never above the largest value, in floating point too, which is what makes the early rejection
/// of `docs/model.md` exact: each exp(x_r − max) is at most 1, and a sum of R such is at most R.
pub fn ln_mean_exp(values: &[f64]) -> f64 {
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if largest == f64::NEG_INFINITY {
        return f64::NEG_INFINITY;
    }
    if values.iter().all(|&x| x == largest) {
        // What the sum below comes to, too: often no draw pays a penalty.
        return largest;
    }
    let sum: f64 = values.iter().map(|&x| libm::exp(x - largest)).sum();
    largest + libm::log(sum / values.len() as f64)
}

/// ln Γ(n) of a whole number n ≥ 1, which is ln (n−1)!.
pub fn ln_gamma(n: usize) -> f64 {
    libm::lgamma(n as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn survives_what_underflows() {
        assert_eq!(ln_mean_exp(&[-2000.0, -2000.0]), -2000.0);
        let value = ln_mean_exp(&[-1000.0, -1000.0 + 3.0_f64.ln()]);
        assert!((value - (-1000.0 + 2.0_f64.ln())).abs() < 1e-12);
        assert_eq!(ln_mean_exp(&[f64::NEG_INFINITY; 3]), f64::NEG_INFINITY);
    }

    #[test]
    fn never_exceeds_the_largest() {
        for n in 1..200 {
            let values: Vec<f64> = (0..n).map(|i| -1e-17 * f64::from(i)).collect();
            assert!(ln_mean_exp(&values) <= 0.0);
        }
    }
}
