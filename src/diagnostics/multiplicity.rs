//! p-values of many tests, adjusted: what is below a level may be called found at that level.
//!
//! Holm (Scandinavian Journal of Statistics 6, 1979) bounds the probability of any false finding,
//! whatever the dependence. Benjamini & Hochberg (Journal of the Royal Statistical Society B 57, 1995)
//! bound the expected share of false findings, for tests that are independent or positively dependent.

/// Holm's adjusted p-values, in the order of the tests.
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let n = p_values.len();
    let mut adjusted = vec![0.0; n];
    let mut largest = 0.0_f64;
    for (rank, place) in ascending(p_values).into_iter().enumerate() {
        largest = largest.max((n - rank) as f64 * p_values[place]).min(1.0);
        adjusted[place] = largest;
    }
    adjusted
}

/// Benjamini & Hochberg's adjusted p-values, in the order of the tests.
pub fn benjamini_hochberg(p_values: &[f64]) -> Vec<f64> {
    let n = p_values.len();
    let mut adjusted = vec![0.0; n];
    let mut smallest = 1.0_f64;
    for (rank, place) in ascending(p_values).into_iter().enumerate().rev() {
        smallest = smallest.min(n as f64 / (rank + 1) as f64 * p_values[place]);
        adjusted[place] = smallest;
    }
    adjusted
}

fn ascending(p_values: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|&a, &b| p_values[a].total_cmp(&p_values[b]));
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: &[f64], expected: &[f64]) -> bool {
        let pairs = found.iter().zip(expected);
        found.len() == expected.len() && pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-12)
    }

    /// R's `p.adjust(c(0.01, 0.04, 0.03, 0.005, 0.9), …)`, by hand: sorted 0.005, 0.01, 0.03, 0.04, 0.9.
    #[test]
    fn worked_examples() {
        let p = [0.01, 0.04, 0.03, 0.005, 0.9];
        assert!(close(&holm(&p), &[0.04, 0.09, 0.09, 0.025, 0.9]));
        let found = benjamini_hochberg(&p);
        assert!(close(&found, &[0.025, 0.05, 0.05, 0.025, 0.9]), "{found:?}");
        assert!(holm(&[]).is_empty() && benjamini_hochberg(&[]).is_empty());
        assert!(close(&holm(&[0.7, 0.6]), &[1.0, 1.0]));
    }
}
