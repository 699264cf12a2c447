//! Sums of importance weights exp(l), kept so that neither they nor their squares underflow.

/// n, Σ w and Σ w² of weights that are given by their logarithms.
#[derive(Clone, Copy, Debug)]
pub struct WeightSums {
    n: f64,
    ln_largest: f64,
    /// Σ w / largest and Σ (w / largest)².
    sum: f64,
    sum_of_squares: f64,
}

impl Default for WeightSums {
    fn default() -> Self {
        Self {
            n: 0.0,
            ln_largest: f64::NEG_INFINITY,
            sum: 0.0,
            sum_of_squares: 0.0,
        }
    }
}

impl WeightSums {
    /// Adds weights.
    pub fn add(&mut self, ln_weights: &[f64]) {
        let largest = ln_weights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut block = Self {
            n: ln_weights.len() as f64,
            ln_largest: largest,
            ..Self::default()
        };
        for l in ln_weights {
            let w = libm::exp(l - largest);
            block.sum += w;
            block.sum_of_squares += w * w;
        }
        self.merge(&block);
    }

    /// Adds the weights that another one holds.
    pub fn merge(&mut self, other: &Self) {
        let largest = self.ln_largest.max(other.ln_largest);
        let scale = |sums: &Self| {
            if sums.n > 0.0 {
                libm::exp(sums.ln_largest - largest)
            } else {
                0.0
            }
        };
        let (a, b) = (scale(self), scale(other));
        *self = Self {
            n: self.n + other.n,
            ln_largest: largest,
            sum: self.sum * a + other.sum * b,
            sum_of_squares: self.sum_of_squares * a * a + other.sum_of_squares * b * b,
        };
    }

    /// How many weights.
    pub fn n(&self) -> f64 {
        self.n
    }

    /// ln of their mean.
    pub fn ln_mean(&self) -> f64 {
        self.ln_largest + libm::log(self.sum / self.n)
    }

    /// (Σw)²/Σw², the effective number of draws; at most n.
    pub fn effective(&self) -> f64 {
        self.sum * self.sum / self.sum_of_squares
    }

    /// Squared standard error of `ln_mean`, by the delta method: 1/effective − 1/n.
    pub fn variance(&self) -> f64 {
        (1.0 / self.effective() - 1.0 / self.n).max(0.0)
    }
}

/// What estimates of one integral, given by their logarithms l, say if those are normal: Cox's upper limit
/// of exp(m + s²/2), m + s²/2 + z √(s²/n + s⁴/2(n − 1)) (Zhou & Gao, Statistics in Medicine 16, 1997).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LogNormal {
    n: f64,
    sum: f64,
    sum_of_squares: f64,
}

impl LogNormal {
    /// z: one in a thousand is above.
    const QUANTILE: f64 = 3.09;

    pub fn add(&mut self, l: f64) {
        self.merge(&Self {
            n: 1.0,
            sum: l,
            sum_of_squares: l * l,
        });
    }

    pub fn merge(&mut self, other: &Self) {
        self.n += other.n;
        self.sum += other.sum;
        self.sum_of_squares += other.sum_of_squares;
    }

    /// ln of the upper limit; `None` below two estimates.
    pub fn ln_upper(&self) -> Option<f64> {
        let n = self.n;
        (n >= 2.0).then(|| {
            let mean = self.sum / n;
            let variance = ((self.sum_of_squares - n * mean * mean) / (n - 1.0)).max(0.0);
            let error = (variance / n + variance * variance / (2.0 * (n - 1.0))).sqrt();
            mean + 0.5 * variance + Self::QUANTILE * error
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// m = −20 and s = 2: the limit is above exp(m + s²/2) and falls
    /// towards it.
    #[test]
    fn the_upper_limit_of_log_normal_estimates() {
        let of = |times: usize| {
            let mut runs = LogNormal::default();
            for l in [-22.0, -18.0].repeat(times) {
                runs.add(l);
            }
            runs.ln_upper().expect("two estimates")
        };
        assert!(LogNormal::default().ln_upper().is_none());
        assert!(of(5) > of(50) && of(50) > -18.0 && of(100_000) < -17.95);
    }

    #[test]
    fn sums_in_two_parts_are_sums_in_one() {
        let ln_weights = [-3000.0, -2999.0, -3010.0, -2998.5];
        let (mut whole, mut parts, mut second) = <(WeightSums, WeightSums, WeightSums)>::default();
        whole.add(&ln_weights);
        parts.add(&ln_weights[..1]);
        second.add(&ln_weights[1..]);
        parts.merge(&second);
        let w: Vec<f64> = ln_weights.iter().map(|l| (l + 3000.0).exp()).collect();
        let (sum, squares) = (w.iter().sum::<f64>(), w.iter().map(|w| w * w).sum::<f64>());
        for sums in [whole, parts] {
            assert!((sums.ln_mean() - ((sum / 4.0).ln() - 3000.0)).abs() < 1e-12);
            assert!((sums.effective() - sum * sum / squares).abs() < 1e-12);
            // The textbook form: Σ(w/w̄ − 1)²/n².
            let mean = sum / 4.0;
            let textbook = w.iter().map(|w| (w / mean - 1.0).powi(2)).sum::<f64>() / 16.0;
            assert!((sums.variance() - textbook).abs() < 1e-12);
        }
    }
}
