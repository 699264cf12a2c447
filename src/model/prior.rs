//! The prior over topologies, P(T).
//!
//! Every prior here is a term for the number of sets and a term for each set's size:
//! ln P(T) = c(M) + Σ_S s(|S|), up to a constant that does not depend on T.
//!
//! | prior | c(M) | s(n) | source |
//! |---|---|---|---|
//! | `uniform` | 0 | 0 | source report, §3.1.2 |
//! | `poisson:λ` | ln Σ_{L≥M} L^{−N} λ^L / (L−M)! | 0 | Ranganathan & Dellaert, T-RO 22(1), 2006 |
//! | `dirichlet-process:α` | M ln α | ln (n−1)! | Ferguson 1973 |
//!
//! The factor e^{−λ} of the Poisson prior is one of the constants left out.

use std::fmt;
use std::str::FromStr;

use super::numeric::ln_gamma;

/// Which prior, with its parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Prior {
    /// Every topology alike: the report's default.
    Uniform,
    /// Number of landmarks Poisson with this rate.
    Poisson {
        /// λ > 0, a number of landmarks.
        rate: f64,
    },
    /// Chinese restaurant process with this concentration.
    DirichletProcess {
        /// α > 0.
        concentration: f64,
    },
}

/// The Poisson series is summed past its mode, near λ, for every M: larger rates would take minutes.
const MAX_RATE: f64 = 100_000.0;

impl Prior {
    /// Terms of this prior for N detections.
    pub fn table(self, n_detections: usize) -> PriorTable {
        let sizes = 0..=n_detections;
        let by_n_sets = sizes.clone().map(|m| match self {
            Self::Uniform => 0.0,
            Self::Poisson { rate } => ln_poisson_term(n_detections, m, rate),
            Self::DirichletProcess { concentration } => m as f64 * libm::log(concentration),
        });
        let by_size = sizes.map(|n| match self {
            Self::DirichletProcess { .. } if n > 0 => ln_gamma(n),
            _ => 0.0,
        });
        PriorTable {
            by_n_sets: by_n_sets.collect(),
            by_size: by_size.collect(),
        }
    }
}

/// ln Σ_{L≥M} L^{−N} λ^L / (L−M)!, summed until the terms no longer count.
///
/// The terms rise to one maximum and then fall faster than geometrically, so the sum ends at the
/// first falling term that is e⁻⁴⁵ of the largest.
fn ln_poisson_term(n_detections: usize, n_sets: usize, rate: f64) -> f64 {
    let ln_rate = libm::log(rate);
    let (mut largest, mut sum) = (f64::NEG_INFINITY, 0.0);
    let mut previous = f64::NEG_INFINITY;
    for n_landmarks in n_sets.max(1).. {
        let l = n_landmarks as f64;
        let term = -(n_detections as f64) * libm::log(l) + l * ln_rate
            - ln_gamma(n_landmarks - n_sets + 1);
        if term > largest {
            sum = sum * libm::exp(largest - term) + 1.0;
            largest = term;
        } else {
            sum += libm::exp(term - largest);
            if term < previous && term < largest - 45.0 {
                break;
            }
        }
        previous = term;
    }
    largest + libm::log(sum)
}

/// The terms of a prior for one number of detections.
#[derive(Clone, Debug)]
pub struct PriorTable {
    by_n_sets: Vec<f64>,
    by_size: Vec<f64>,
}

impl PriorTable {
    /// From s(n) alone, for a test.
    #[cfg(test)]
    pub fn custom(n_detections: usize, ln_size: impl Fn(usize) -> f64) -> Self {
        let sizes = (1..=n_detections).map(ln_size);
        Self {
            by_n_sets: vec![0.0; n_detections + 1],
            by_size: std::iter::once(0.0).chain(sizes).collect(),
        }
    }

    /// c(M).
    pub fn ln_n_sets(&self, n_sets: usize) -> f64 {
        self.by_n_sets[n_sets]
    }

    /// s(n).
    pub fn ln_size(&self, size: usize) -> f64 {
        self.by_size[size]
    }

    /// ln P(T) from the sizes of its sets, without constants.
    pub fn ln_prior(&self, sizes: impl Iterator<Item = usize>) -> f64 {
        let (mut n_sets, mut sum) = (0, 0.0);
        for size in sizes {
            n_sets += 1;
            sum += self.ln_size(size);
        }
        self.ln_n_sets(n_sets) + sum
    }
}

impl fmt::Display for Prior {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Uniform => f.write_str("uniform"),
            Self::Poisson { rate } => write!(f, "poisson:{rate}"),
            Self::DirichletProcess { concentration } => {
                write!(f, "dirichlet-process:{concentration}")
            }
        }
    }
}

impl FromStr for Prior {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parameter = |number: &str| match number.parse::<f64>() {
            Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
            _ => Err("uniform, poisson:λ or dirichlet-process:α with a number > 0".to_owned()),
        };
        match text.split_once(':') {
            None if text == "uniform" => Ok(Self::Uniform),
            Some(("poisson", rate)) => match parameter(rate)? {
                rate if rate <= MAX_RATE => Ok(Self::Poisson { rate }),
                _ => Err(format!(
                    "poisson:λ with a number of landmarks λ of at most {MAX_RATE}"
                )),
            },
            Some(("dirichlet-process", alpha)) => Ok(Self::DirichletProcess {
                concentration: parameter(alpha)?,
            }),
            _ => Err("uniform, poisson:λ or dirichlet-process:α, as in poisson:8".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back() {
        for text in ["uniform", "poisson:8", "dirichlet-process:0.5"] {
            assert_eq!(
                text.parse::<Prior>().map(|prior| prior.to_string()),
                Ok(text.to_owned())
            );
        }
        for text in [
            "poisson",
            "poisson:-1",
            "poisson:nan",
            "dirichlet-process:inf",
            "flat",
        ] {
            assert!(text.parse::<Prior>().is_err(), "{text}");
        }
    }

    #[test]
    fn poisson_against_the_plain_sum() {
        let (n, m, rate) = (6, 3, 4.0_f64);
        let mut factorial = 1.0;
        let mut sum = 0.0;
        for l in m..60 {
            if l > m {
                factorial *= (l - m) as f64;
            }
            sum += (l as f64).powi(-n) * rate.powi(l) / factorial;
        }
        let table = Prior::Poisson { rate }.table(n as usize);
        assert!((table.ln_n_sets(m as usize) - sum.ln()).abs() < 1e-12);
        // A large rate with many detections neither overflows nor loops for ever.
        assert!(
            Prior::Poisson { rate: 5000.0 }
                .table(2000)
                .ln_n_sets(1500)
                .is_finite()
        );
    }

    #[test]
    fn dirichlet_process_sums_to_the_rising_factorial() {
        // Σ_T α^M Π (|S|−1)! = α(α+1)…(α+N−1).
        let (n, alpha) = (6, 0.7);
        let table = Prior::DirichletProcess {
            concentration: alpha,
        }
        .table(n);
        let total: f64 = crate::partition::Partitions::of(n)
            .map(|topology| {
                let mut sizes = vec![0; topology.n_sets()];
                for &label in topology.labels() {
                    sizes[label as usize] += 1;
                }
                table.ln_prior(sizes.into_iter()).exp()
            })
            .sum();
        let rising: f64 = (0..n).map(|k| alpha + k as f64).product();
        assert!((total / rising - 1.0).abs() < 1e-12);
    }
}
