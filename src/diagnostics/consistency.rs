//! Whether errors are as large as their covariances say: the normalised estimation error squared,
//! NEES, of n errors eᵢ (2, m) with covariances Cᵢ (2×2, m²),
//!
//! εᵢ = eᵢᵀ·Cᵢ⁻¹·eᵢ,
//!
//! is chi-square with 2 degrees of freedom if eᵢ ~ N(0, Cᵢ): mean 2, median 1.39, 95 % below 5.99
//! (Bar-Shalom, Li & Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, §5.4).
//! A larger mean says that covariances claim too much, a smaller one too little. Errors of one mission
//! share its drift, so their mean scatters more than that of n independent ones, and no test is made.

use std::collections::BTreeMap;

use crate::detections::{Covariance, Detection, Detections};

/// The 95 % quantile of chi-square with 2 degrees of freedom, −2·ln 0.05.
pub const NEES_95: f64 = 5.991_464_547_107_979;

/// What n normalised errors are like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nees {
    /// How many.
    pub n: usize,
    /// Their mean; 2 if covariances are honest.
    pub mean: f64,
    /// Their median; 1.39 if covariances are honest. Gross errors hardly move it.
    pub median: f64,
    /// The share below [`NEES_95`].
    pub within_95: f64,
    /// Root mean square of the errors themselves, m.
    pub rms_m: f64,
}

/// NEES of errors (m) with their covariances; `None` of none.
pub fn nees(errors: &[([f64; 2], Covariance)]) -> Option<Nees> {
    let n = errors.len();
    let of = |([x, y], c): &([f64; 2], Covariance)| {
        (c.yy * x * x - 2.0 * c.xy * x * y + c.xx * y * y) / c.determinant()
    };
    let mut values: Vec<f64> = errors.iter().map(of).collect();
    values.sort_by(f64::total_cmp);
    let (low, high) = (*values.get(n.checked_sub(1)? / 2)?, *values.get(n / 2)?);
    let squares = errors.iter().map(|([x, y], _)| x * x + y * y);
    Some(Nees {
        n,
        mean: values.iter().sum::<f64>() / n as f64,
        median: (low + high) / 2.0,
        within_95: values.partition_point(|value| *value < NEES_95) as f64 / n as f64,
        rms_m: (squares.sum::<f64>() / n as f64).sqrt(),
    })
}

/// Errors of the detections whose landmark has a known place (m, in the frame of the detections).
/// None without covariances.
pub fn errors_against(
    detections: &Detections,
    places_m: &BTreeMap<i64, [f64; 2]>,
) -> Vec<([f64; 2], Covariance)> {
    let error = |row: &Detection| {
        let [x, y] = *places_m.get(&row.landmark?)?;
        let [z_x, z_y] = row.position_m;
        Some(([z_x - x, z_y - y], row.covariance_m2?))
    };
    detections.iter().filter_map(error).collect()
}

/// Differences of each detection and the one before of the same landmark, with the sum of their
/// covariances: what a model sees that takes detections as independent. Drift that both share makes
/// them smaller than that.
pub fn differences_between_visits(detections: &Detections) -> Vec<([f64; 2], Covariance)> {
    let mut last: BTreeMap<i64, ([f64; 2], Covariance)> = BTreeMap::new();
    let difference = |row: &Detection| {
        let (z, c) = (row.position_m, row.covariance_m2?);
        let (z_before, c_before) = last.insert(row.landmark?, (z, c))?;
        let sum = Covariance {
            xx: c.xx + c_before.xx,
            xy: c.xy + c_before.xy,
            yy: c.yy + c_before.yy,
        };
        Some(([z[0] - z_before[0], z[1] - z_before[1]], sum))
    };
    detections.iter().filter_map(difference).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_measured_in_their_own_covariance() {
        let c = Covariance {
            xx: 4.0,
            xy: 0.0,
            yy: 1.0,
        };
        // 2 along σ 2, 3 along σ 1, both at once with a correlation: by hand 1, 9, and 4/3.
        let correlated = Covariance {
            xx: 1.0,
            xy: 0.5,
            yy: 1.0,
        };
        let found = nees(&[([2.0, 0.0], c), ([0.0, 3.0], c), ([1.0, 1.0], correlated)]);
        let found = found.expect("three errors");
        assert!((found.mean - (1.0 + 9.0 + 4.0 / 3.0) / 3.0).abs() < 1e-12);
        assert!((found.median - 4.0 / 3.0).abs() < 1e-12);
        assert!((found.within_95 - 2.0 / 3.0).abs() < 1e-12);
        assert!((found.rms_m - (15.0f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!(found.n, 3);
        assert_eq!(nees(&[]), None);
    }

    #[test]
    fn visits_of_one_landmark_are_compared_in_turn() {
        let at = |x: f64, landmark| Detection {
            covariance_m2: Some(Covariance {
                xx: 1.0,
                xy: 0.25,
                yy: 2.0,
            }),
            landmark,
            ..Detection::at(x, 1.0)
        };
        let rows = vec![
            at(0.0, Some(7)),
            at(9.0, None),
            at(3.0, Some(7)),
            at(4.0, Some(7)),
            at(1.0, Some(8)),
        ];
        let detections = Detections::new(rows).expect("good rows");
        let found = differences_between_visits(&detections);
        let sum = Covariance {
            xx: 2.0,
            xy: 0.5,
            yy: 4.0,
        };
        assert_eq!(found, [([3.0, 0.0], sum), ([1.0, 0.0], sum)]);
        let places = BTreeMap::from([(8, [0.5, 2.0])]);
        let errors = errors_against(&detections, &places);
        assert_eq!(errors.len(), 1);
        assert_eq!(errors[0].0, [0.5, -1.0]);
    }
}
