//! Quantiles of the beta law, for the errors of quantiles.

/// Bisection ends when the interval has no double between its ends, at the latest.
const MAX_HALVINGS: usize = 1100;
/// Terms of the continued fraction; about √max(a, b) are needed.
const MAX_TERMS: usize = 1_000_000;

/// x with I_x(a, b) = p, for a, b > 0 and 0 < p < 1, by bisection.
pub fn beta_quantile(a: f64, b: f64, p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..MAX_HALVINGS {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            break;
        }
        if regularised_beta(a, b, middle) < p {
            low = middle;
        } else {
            high = middle;
        }
    }
    f64::midpoint(low, high)
}

/// I_x(a, b), the probability that a beta variable is at most x, 0 < x < 1: the continued fraction
/// 26.5.8 of Abramowitz & Stegun (1964) by the method of Lentz, on the side where it converges
/// fast.
pub fn regularised_beta(a: f64, b: f64, x: f64) -> f64 {
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - regularised_beta(b, a, 1.0 - x);
    }
    let ln_front = a * libm::log(x) + b * libm::log1p(-x) + libm::lgamma(a + b)
        - libm::lgamma(a)
        - libm::lgamma(b);
    let coefficient = |term: usize| {
        let m = (term / 2) as f64;
        if term.is_multiple_of(2) {
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        }
    };
    let nonzero = |v: f64| if v == 0.0 { f64::MIN_POSITIVE } else { v };
    let (mut fraction, mut c, mut d) = (1.0, 1.0, 0.0);
    for term in 1..MAX_TERMS {
        d = 1.0 / nonzero(1.0 + coefficient(term) * d);
        c = nonzero(1.0 + coefficient(term) / c);
        fraction *= c * d;
        if (c * d - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    libm::exp(ln_front) / (a * fraction)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::tests::{golden, number};

    #[test]
    fn as_scipy_has_it() {
        for row in golden("functions")["beta_quantile"]
            .as_array()
            .expect("rows")
        {
            let [a, b, p, x] = [0, 1, 2, 3].map(|column| number(&row[column]));
            let found = beta_quantile(a, b, p);
            // ln Γ(10⁵) is known to about 10⁻¹⁰ absolutely, and so is the front factor.
            assert!((found / x - 1.0).abs() < 1e-11, "{a} {b} {p}: {found}, {x}");
        }
    }

    #[test]
    fn closed_forms() {
        for x in [0.1, 0.5, 0.9] {
            assert!((regularised_beta(3.0, 1.0, x) - x * x * x).abs() < 1e-15);
            assert!((regularised_beta(1.0, 2.0, x) - (1.0 - (1.0 - x) * (1.0 - x))).abs() < 1e-15);
        }
    }
}
