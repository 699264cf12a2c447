//! Sobol's indices: how much of the variance over the settings each factor explains, by itself (first order)
//! and with all its interactions (total).
//!
//! Of base points A_j, B_j and the mixtures A_j with factor i from B_j, and with f the mean over worlds,
//! V_i = mean of (f(B) − f̄)(f(AB_i) − f(A)) (Saltelli et al., Computer Physics Communications 181, 2010, their
//! estimator b) and V_Ti = ½ mean of (f(AB_i) − f(A))² (Jansen 1999), each over V, the variance of f.
//!
//! **Noise.** f is known from a few worlds only, y(x, w) = f(x) + g(w) + noise. Worlds are shared by all
//! points, so g drops out of differences and of values that have the mean of their world taken off; and
//! every product is taken across different worlds ([`product_across`]), where noise has mean 0. So noise
//! raises no index, it only widens the intervals. With one world noise counts as effect, and it is said.
//!
//! Intervals: Bayesian bootstrap of base points and worlds alike (Owen, Annals of Applied Statistics 1,
//! 2007, for crossed units, where it errs on the wide side), percentiles. Of two or three worlds they are
//! still rough.

use rand::Rng;

use super::interval::Interval;
use super::weights::{N_DRAWS, equal_weights, percentiles, product_across, random_weights};

/// Base points below this number give no indices.
pub const FEWEST_POINTS: usize = 4;

/// The responses at one base point, each world by world.
#[derive(Clone, Debug)]
pub struct BasePoint {
    /// At A.
    pub a: Vec<f64>,
    /// At B.
    pub b: Vec<f64>,
    /// At A with each factor from B.
    pub mixed: Vec<Vec<f64>>,
}

/// An index with its 95 % interval. Estimates may be a little below 0 or above 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Index {
    /// The estimate.
    pub value: f64,
    /// Its interval.
    pub interval: Option<Interval>,
}

/// Indices of all factors.
#[derive(Clone, Debug)]
pub struct SobolIndices {
    /// First order, by factor.
    pub first: Vec<Index>,
    /// Total, by factor.
    pub total: Vec<Index>,
    /// Variance of f over the settings, and its interval.
    pub variance: Index,
    /// Variance of g: how much worlds differ whatever the settings; `None` for one world.
    pub variance_of_worlds: Option<f64>,
    /// Variance of the noise in a world at a point; `None` for one world.
    pub variance_of_noise: Option<f64>,
    /// Base points.
    pub n_points: usize,
    /// Worlds.
    pub n_units: usize,
}

/// Why there are no indices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoIndices {
    /// Fewer base points than [`FEWEST_POINTS`].
    TooFew,
    /// The response is the same everywhere.
    Constant,
    /// It varies no more than noise explains.
    OnlyNoise,
}

impl NoIndices {
    /// In a sentence.
    pub fn words(self) -> &'static str {
        match self {
            Self::TooFew => "too few base points have a value",
            Self::Constant => "it is the same for all settings",
            Self::OnlyNoise => "it varies no more than noise explains",
        }
    }

    /// In a word, for tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::TooFew => "too-few",
            Self::Constant => "constant",
            Self::OnlyNoise => "only-noise",
        }
    }
}

/// Of base points that all have the same worlds and factors.
///
/// # Errors
/// Too few points, or nothing but noise.
pub fn sobol_indices(points: &[BasePoint], rng: &mut impl Rng) -> Result<SobolIndices, NoIndices> {
    let n_points = points.len();
    if n_points < FEWEST_POINTS {
        return Err(NoIndices::TooFew);
    }
    let (n_factors, n_units) = (points[0].mixed.len(), points[0].a.len());
    let all = || {
        points
            .iter()
            .flat_map(|point| point.a.iter().chain(&point.b))
    };
    if all().all(|y| *y == points[0].a[0]) {
        return Err(NoIndices::Constant);
    }
    let of = |by_point: &[f64], by_unit: &[f64]| Parts::new(points, n_factors, by_point, by_unit);
    let whole = of(&equal_weights(n_points), &equal_weights(n_units));
    if whole.variance <= 0.0 {
        return Err(NoIndices::OnlyNoise);
    }
    let mut draws: Vec<Parts> = Vec::with_capacity(N_DRAWS);
    for _ in 0..N_DRAWS {
        let by_point = random_weights(n_points, rng);
        let by_unit = random_weights(n_units, rng);
        draws.push(of(&by_point, &by_unit));
    }
    let index = |value: f64, of: &dyn Fn(&Parts) -> f64| {
        let ratios: Vec<f64> = (draws.iter())
            .filter(|draw| draw.variance > 0.0)
            .map(of)
            .collect();
        // Where the variance itself may be none, a share of it has no interval.
        let enough = ratios.len() * 40 >= N_DRAWS * 39;
        Index {
            value,
            interval: percentiles(ratios).filter(|_| enough),
        }
    };
    let by_factor = |of: fn(&Parts) -> &Vec<f64>| {
        (0..n_factors)
            .map(|i| index(of(&whole)[i] / whole.variance, &|d| of(d)[i] / d.variance))
            .collect()
    };
    let (worlds, noise) = noise(points, n_units).unzip();
    Ok(SobolIndices {
        first: by_factor(|parts| &parts.first),
        total: by_factor(|parts| &parts.total),
        variance: Index {
            value: whole.variance,
            interval: percentiles(draws.iter().map(|draw| draw.variance).collect()),
        },
        variance_of_worlds: worlds,
        variance_of_noise: noise,
        n_points,
        n_units,
    })
}

/// Variances, before they are divided.
struct Parts {
    first: Vec<f64>,
    total: Vec<f64>,
    variance: f64,
}

impl Parts {
    fn new(points: &[BasePoint], n_factors: usize, by_point: &[f64], by_unit: &[f64]) -> Self {
        let means = unit_means(points, by_point);
        let less_mean =
            |y: &[f64]| -> Vec<f64> { y.iter().zip(&means).map(|(y, m)| y - m).collect() };
        let mut parts = Self {
            first: vec![0.0; n_factors],
            total: vec![0.0; n_factors],
            variance: 0.0,
        };
        for (point, weight) in points.iter().zip(by_point) {
            let (a, b) = (less_mean(&point.a), less_mean(&point.b));
            let of_both = product_across(&a, &a, by_unit) + product_across(&b, &b, by_unit);
            parts.variance += weight * of_both / 2.0;
            for (i, mixed) in point.mixed.iter().enumerate() {
                let moved: Vec<f64> = mixed.iter().zip(&point.a).map(|(y, a)| y - a).collect();
                parts.first[i] += weight * product_across(&b, &moved, by_unit);
                parts.total[i] += weight * product_across(&moved, &moved, by_unit) / 2.0;
            }
        }
        parts
    }
}

/// The mean of each world over A and B.
fn unit_means(points: &[BasePoint], by_point: &[f64]) -> Vec<f64> {
    let mut means = vec![0.0; points[0].a.len()];
    for (point, weight) in points.iter().zip(by_point) {
        for (mean, (a, b)) in means.iter_mut().zip(point.a.iter().zip(&point.b)) {
            *mean += weight * (a + b) / 2.0;
        }
    }
    means
}

/// Variances of g and of the noise: a two-way analysis of variance of points and worlds.
fn noise(points: &[BasePoint], n_units: usize) -> Option<(f64, f64)> {
    if n_units < 2 {
        return None;
    }
    let means = unit_means(points, &equal_weights(points.len()));
    let rows = || points.iter().flat_map(|point| [&point.a, &point.b]);
    let n_rows = 2 * points.len();
    let mut sum = 0.0;
    for row in rows() {
        let residuals: Vec<f64> = row.iter().zip(&means).map(|(y, m)| y - m).collect();
        sum += super::r_hat::variance(&residuals)? * (n_units - 1) as f64;
    }
    let noise = sum / ((n_units - 1) * (n_rows - 1)) as f64;
    let worlds = super::r_hat::variance(&means)? - noise / n_rows as f64;
    Some((worlds.max(0.0), noise))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;
    use crate::settings::KEYS;
    use crate::sweep::{Axis, SampledDesign, Sampling, Spread};
    use rand_distr::{Distribution, StandardNormal};
    use std::f64::consts::PI;

    /// Responses of a function at the points of our own design of k factors.
    fn base_points(k: usize, n: u64, y: &mut dyn FnMut(&[f64]) -> Vec<f64>) -> Vec<BasePoint> {
        let numbers = KEYS
            .iter()
            .filter(|key| key.unit == "m" || !key.symbol.is_empty());
        let axis = |key| Axis {
            key,
            spread: Spread::Range {
                low: 1.0,
                high: 2.0,
                log: false,
            },
        };
        let design = SampledDesign {
            sampling: Sampling::SobolIndices,
            axes: numbers.take(k).map(axis).collect(),
            amount: n,
            seed: 11,
        };
        assert_eq!(design.axes.len(), k);
        let values: Vec<Vec<f64>> = design.points().iter().map(|point| y(point)).collect();
        values
            .chunks(design.n_each())
            .map(|block| BasePoint {
                a: block[0].clone(),
                b: block[1].clone(),
                mixed: block[2..].to_vec(),
            })
            .collect()
    }

    fn ishigami(u: &[f64]) -> f64 {
        let x = |i: usize| PI * (2.0 * u[i] - 1.0);
        let sine = libm::sin(x(1));
        libm::sin(x(0)) * (1.0 + 0.1 * libm::pow(x(2), 4.0)) + 7.0 * sine * sine
    }

    /// a = 7, b = 0.1 (Ishigami & Homma 1990; values as in Saltelli et al., Global Sensitivity Analysis, 2008).
    const ISHIGAMI_FIRST: [f64; 3] = [0.313_905_191, 0.442_411_144, 0.0];
    const ISHIGAMI_TOTAL: [f64; 3] = [0.557_588_856, 0.442_411_144, 0.243_683_664];
    const ISHIGAMI_VARIANCE: f64 = 13.844_587_94;

    fn holds(index: &Index, value: f64) -> bool {
        let interval = index.interval.expect("an interval");
        interval.low <= value && value <= interval.high
    }

    #[test]
    fn ishigami_without_noise() {
        let points = base_points(3, 1024, &mut |u| vec![ishigami(u)]);
        let mut rng = Purpose::new("test", 1).generator();
        let found = sobol_indices(&points, &mut rng).expect("indices");
        assert_eq!((found.variance_of_noise, found.n_units), (None, 1));
        assert!((found.variance.value / ISHIGAMI_VARIANCE - 1.0).abs() < 0.01);
        for i in 0..3 {
            let (first, total) = (found.first[i], found.total[i]);
            // Even points are several times better than random ones, whose error the interval is.
            assert!(
                (first.value - ISHIGAMI_FIRST[i]).abs() < 0.02,
                "{i}: {first:?}"
            );
            assert!(
                (total.value - ISHIGAMI_TOTAL[i]).abs() < 0.02,
                "{i}: {total:?}"
            );
            assert!(holds(&first, ISHIGAMI_FIRST[i]) && holds(&total, ISHIGAMI_TOTAL[i]));
        }
    }

    /// Sobol's g-function: V_i = 1/(3(1 + a_i)²), V = Π(1 + V_i) − 1.
    #[test]
    fn the_g_function() {
        let a = [0.0, 1.0, 4.5, 9.0, 99.0];
        let g = |u: &[f64]| {
            let terms = a
                .iter()
                .zip(u)
                .map(|(a, u)| ((4.0 * u - 2.0).abs() + a) / (1.0 + a));
            vec![terms.product()]
        };
        let own = a.map(|a: f64| 1.0 / (3.0 * (1.0 + a) * (1.0 + a)));
        let product: f64 = own.iter().map(|v| 1.0 + v).product();
        let points = base_points(5, 1024, &mut |u| g(u));
        let mut rng = Purpose::new("test", 2).generator();
        let found = sobol_indices(&points, &mut rng).expect("indices");
        for (i, v) in own.iter().enumerate() {
            let (first, total) = (
                v / (product - 1.0),
                v * product / (1.0 + v) / (product - 1.0),
            );
            assert!(
                (found.first[i].value - first).abs() < 0.02,
                "{i}: {:?}",
                found.first[i]
            );
            assert!(
                (found.total[i].value - total).abs() < 0.02,
                "{i}: {:?}",
                found.total[i]
            );
        }
    }

    /// Four worlds that differ by 5 each, and noise of the variance of the function itself. Taken as effect it
    /// would raise the total index of the factor without any, the fourth, to ¼ and the others with it.
    #[test]
    fn noise_and_worlds_raise_no_index() {
        let mut rng = Purpose::new("test", 3).generator();
        let sd = ISHIGAMI_VARIANCE.sqrt();
        let mut noisy = |u: &[f64]| -> Vec<f64> {
            let y = ishigami(u);
            let world = |w: usize| y + 5.0 * w as f64;
            (0..4)
                .map(|w| {
                    let noise: f64 = StandardNormal.sample(&mut rng);
                    world(w) + sd * noise
                })
                .collect()
        };
        let points = base_points(4, 512, &mut noisy);
        let mut rng = Purpose::new("test", 4).generator();
        let found = sobol_indices(&points, &mut rng).expect("indices");
        for i in 0..4 {
            let first = ISHIGAMI_FIRST.get(i).copied().unwrap_or(0.0);
            let total = ISHIGAMI_TOTAL.get(i).copied().unwrap_or(0.0);
            assert!(holds(&found.first[i], first), "{i}: {:?}", found.first[i]);
            assert!(holds(&found.total[i], total), "{i}: {:?}", found.total[i]);
        }
        let inert = found.total[3].interval.expect("an interval");
        assert!(inert.high < 0.15, "{inert:?}");
        // 3,069 degrees of freedom: five standard errors of a variance are 0.128 of it.
        let noise = found.variance_of_noise.expect("four worlds");
        assert!((noise / ISHIGAMI_VARIANCE - 1.0).abs() < 0.128, "{noise}");
        // Worlds at 0, 5, 10, 15: variance 41.7.
        let worlds = found.variance_of_worlds.expect("four worlds");
        assert!((worlds - 125.0 / 3.0).abs() < 5.0, "{worlds}");
    }

    /// Two worlds on four rows, by hand: less the means of the worlds (1 and 4) and of each row,
    /// residuals of ±1 are left in two of the rows, a sum of squares of 4 over (2 − 1)(4 − 1)
    /// degrees of freedom. The means vary by 4.5, of which noise explains a quarter of 4/3.
    #[test]
    fn the_noise_is_that_of_an_analysis_of_variance() {
        let point = |a: [f64; 2], b: [f64; 2]| BasePoint {
            a: a.to_vec(),
            b: b.to_vec(),
            mixed: Vec::new(),
        };
        let points = [point([0.0, 3.0], [0.0, 5.0]), point([2.0, 3.0], [2.0, 5.0])];
        let (worlds, noise) = noise(&points, 2).expect("two worlds");
        assert!((noise - 4.0 / 3.0).abs() < 1e-12, "{noise}");
        assert!((worlds - (4.5 - 1.0 / 3.0)).abs() < 1e-12, "{worlds}");
    }

    #[test]
    fn nothing_but_noise_has_no_indices() {
        let mut rng = Purpose::new("test", 5).generator();
        let refusal = |points: &[BasePoint]| {
            let mut rng = Purpose::new("test", 6).generator();
            sobol_indices(points, &mut rng).err()
        };
        assert_eq!(refusal(&[]), Some(NoIndices::TooFew));
        let flat = base_points(3, 8, &mut |_| vec![2.0, 2.0]);
        assert_eq!(refusal(&flat), Some(NoIndices::Constant));
        // The variance found is as often below 0 as above; here either is no index to rely on.
        let noisy = base_points(3, 64, &mut |_| {
            (0..3).map(|_| StandardNormal.sample(&mut rng)).collect()
        });
        let mut rng = Purpose::new("test", 6).generator();
        match sobol_indices(&noisy, &mut rng) {
            Err(reason) => assert_eq!(reason, NoIndices::OnlyNoise),
            Ok(found) => assert!(found.total.iter().all(|index| index.interval.is_none())),
        }
    }
}
