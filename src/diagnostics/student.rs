//! The mean of a few independent units, such as simulated worlds, with Student's interval and test.
//!
//! With n units of mean x̄ and standard deviation s the interval is x̄ ± t·s/√n, t the 97.5 % quantile of
//! Student's law with n − 1 degrees of freedom (Student, Biometrika 6, 1908): 12.7 for two units, 2.78 for
//! five. A percentile bootstrap of five units is too narrow by about a third and covers some 83 times in 100
//! (`tests` below), which is why it is not used here. Units that all agree show no spread: then there is no
//! such interval, and the p-value is that of a sign test, 2^(1−n), which no unit's law can make smaller.

use super::beta::{beta_quantile, regularised_beta};
use super::interval::Interval;

/// The mean of independent units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitMean {
    /// The mean.
    pub mean: f64,
    /// Its standard error; `None` for one unit.
    pub standard_error: Option<f64>,
    /// Its 95 % interval; `None` for one unit, or if all agree.
    pub interval: Option<Interval>,
    /// Two-sided p-value of "the mean is 0"; `None` for one unit.
    pub p_value: Option<f64>,
    /// Units.
    pub n: usize,
}

/// `None` without units.
pub fn unit_mean(values: &[f64]) -> Option<UnitMean> {
    let n = values.len();
    if n == 0 {
        return None;
    }
    let mean = values.iter().sum::<f64>() / n as f64;
    // Rounding of sums is no spread.
    let spread = super::r_hat::variance(values).filter(|variance| {
        let size = values.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        variance.sqrt() > 1e-12 * size
    });
    let (standard_error, interval, p_value) = match spread {
        Some(variance) => {
            let error = (variance / n as f64).sqrt();
            let half = student_quantile((n - 1) as f64) * error;
            let interval = Interval {
                low: mean - half,
                high: mean + half,
            };
            let p = student_p_value(mean / error, (n - 1) as f64);
            (Some(error), Some(interval), Some(p))
        }
        None if n == 1 => (None, None, None),
        None if mean == 0.0 => (Some(0.0), None, Some(1.0)),
        None => (Some(0.0), None, Some(libm::exp2(1.0 - n as f64))),
    };
    Some(UnitMean {
        mean,
        standard_error,
        interval,
        p_value,
        n,
    })
}

/// 97.5 % quantile of Student's law, from that of the beta law: t²/(ν + t²) ~ Beta(½, ν/2).
pub fn student_quantile(degrees: f64) -> f64 {
    // The share of the beta law beyond is taken from the side where it is small.
    let x = beta_quantile(degrees / 2.0, 0.5, 0.05);
    (degrees * (1.0 - x) / x).sqrt()
}

/// Probability that |t| is at least this large.
pub fn student_p_value(t: f64, degrees: f64) -> f64 {
    let x = degrees / (degrees + t * t);
    if x >= 1.0 {
        return 1.0;
    }
    if x <= 0.0 {
        return 0.0;
    }
    regularised_beta(degrees / 2.0, 0.5, x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Purpose;
    use rand::{Rng, RngExt};

    /// `scipy.stats.t.ppf(0.975, ν)` and `2 * t.sf(2.5, ν)`, scipy 1.17.1.
    #[test]
    fn quantiles_and_p_values_as_scipy_has_them() {
        let rows = [
            (1.0, 12.706_204_736_174_694, 0.242_237_883_181_686_82),
            (4.0, 2.776_445_105_197_793_6, 0.066_766_544_811_988_14),
            (9.0, 2.262_157_162_798_205, 0.033_861_827_682_985_735),
            (100.0, 1.983_971_518_523_551_8, 0.014_045_789_124_077_172),
        ];
        for (degrees, quantile, p) in rows {
            let found = student_quantile(degrees);
            assert!((found / quantile - 1.0).abs() < 1e-10, "{degrees}: {found}");
            let found = student_p_value(2.5, degrees);
            assert!((found / p - 1.0).abs() < 1e-10, "{degrees}: {found}");
            assert_eq!(student_p_value(-2.5, degrees), found);
        }
        assert_eq!(student_p_value(0.0, 3.0), 1.0);
    }

    /// 1, 2 and 4: mean 7/3, standard error √7/3; with 2 degrees of freedom t = 4.302653 and p = 1
    /// − t/√(2 + t²), t² = 7.
    #[test]
    fn three_units_have_two_degrees_of_freedom() {
        let found = unit_mean(&[1.0, 2.0, 4.0]).expect("units");
        let error = 7.0_f64.sqrt() / 3.0;
        assert!((found.standard_error.expect("a spread") - error).abs() < 1e-12);
        let interval = found.interval.expect("an interval");
        let half = 4.302_652_729_911_275 * error;
        assert!(
            (interval.high - 7.0 / 3.0 - half).abs() < 1e-9,
            "{interval:?}"
        );
        assert!(
            (7.0 / 3.0 - interval.low - half).abs() < 1e-9,
            "{interval:?}"
        );
        let p = 1.0 - (7.0_f64 / 9.0).sqrt();
        assert!((found.p_value.expect("a test") - p).abs() < 1e-12);
    }

    #[test]
    fn what_shows_no_spread_has_no_interval() {
        assert_eq!(unit_mean(&[]), None);
        let one = unit_mean(&[0.3]).expect("a unit");
        assert_eq!((one.interval, one.p_value, one.n), (None, None, 1));
        let agree = unit_mean(&[-1.0; 5]).expect("units");
        assert_eq!((agree.interval, agree.p_value), (None, Some(1.0 / 16.0)));
        // 0.1 · 3 / 3 is not 0.1 to the last bit.
        let rounded = unit_mean(&[0.1, 0.1, 0.1]).expect("units");
        assert_eq!(rounded.interval, None);
        assert_eq!(unit_mean(&[0.0; 4]).expect("units").p_value, Some(1.0));
    }

    /// Percentile bootstrap (Efron 1979) of the mean; 4,000 replications know its ends to about 1 % of its width.
    fn bootstrap_mean(values: &[f64], rng: &mut impl Rng) -> Interval {
        let n = values.len();
        let mut means: Vec<f64> = (0..4000)
            .map(|_| (0..n).map(|_| values[rng.random_range(0..n)]).sum::<f64>() / n as f64)
            .collect();
        means.sort_unstable_by(f64::total_cmp);
        Interval {
            low: means[100],
            high: means[3899],
        }
    }

    /// Five worlds, each the mean of twelve cells whose probability of success the world sets. Of 4,000
    /// such experiments 95 % should hold the true mean: within five binomial standard errors, 0.0172, of
    /// it. The percentile bootstrap falls far short of the same.
    #[test]
    fn covers_with_five_worlds_where_a_bootstrap_does_not() {
        let mut rng = Purpose::new("test", 3).generator();
        let n = 4000;
        let (mut student, mut bootstrap, mut n_bootstrap) = (0, 0, 0);
        for k in 0..n {
            let worlds: Vec<f64> = (0..5)
                .map(|_| {
                    let p = 0.25 + 0.5 * rng.random::<f64>();
                    let hits = (0..12).filter(|_| rng.random::<f64>() < p).count();
                    hits as f64 / 12.0
                })
                .collect();
            let holds = |interval: Interval| interval.low <= 0.5 && 0.5 <= interval.high;
            let found = unit_mean(&worlds).expect("units");
            student += usize::from(found.interval.is_some_and(holds));
            if k < 200 {
                n_bootstrap += 1;
                bootstrap += usize::from(holds(bootstrap_mean(&worlds, &mut rng)));
            }
        }
        let share = student as f64 / f64::from(n);
        assert!((share - 0.95).abs() < 0.0172, "{share}");
        // 200 of them: 0.95 less five standard errors is 0.873.
        assert!(
            (bootstrap as f64) < 0.873 * f64::from(n_bootstrap),
            "{bootstrap}"
        );
    }
}
