//! The length scales of a data set: how far its detections lie apart, and how precise they say they
//! are. σ_o and σ_t compare with the precision, the penalty radius with the distances.

use crate::detections::Detections;

/// Length scales, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Median over detections of the distance to the nearest other; `None` for a single detection.
    pub nearest_m: Option<f64>,
    /// Diagonal of the box round all detections.
    pub extent_m: f64,
    /// Median over detections of √((C_xx + C_yy)/2); `None` without covariances.
    pub precision_m: Option<f64>,
}

impl Scales {
    /// Of N detections; takes N² time.
    pub fn of(detections: &Detections) -> Self {
        let positions_m = detections.positions_m();
        let distance = |a: [f64; 2], b: [f64; 2]| libm::hypot(a[0] - b[0], a[1] - b[1]);
        let nearest = positions_m.iter().enumerate().filter_map(|(i, &a)| {
            let others = positions_m.iter().enumerate().filter(|(j, _)| *j != i);
            others.map(|(_, &b)| distance(a, b)).min_by(f64::total_cmp)
        });
        let side = |axis: usize| {
            let values = || positions_m.iter().map(|z| z[axis]);
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        };
        let precisions = detections.covariances_m2().map(|covariances| {
            covariances
                .iter()
                .map(|c| ((c.xx + c.yy) / 2.0).sqrt())
                .collect::<Vec<_>>()
        });
        Self {
            nearest_m: median(nearest.collect()),
            extent_m: libm::hypot(side(0), side(1)),
            precision_m: precisions.and_then(median),
        }
    }
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let (low, high) = (
        values.get(values.len().checked_sub(1)? / 2)?,
        values.get(values.len() / 2)?,
    );
    Some((low + high) / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detections::{Covariance, Detection};

    #[test]
    fn scales_of_a_small_set() {
        let at = |x: f64, y: f64, variance: f64| Detection {
            covariance_m2: Some(Covariance {
                xx: variance,
                xy: 0.0,
                yy: variance,
            }),
            ..Detection::at(x, y)
        };
        let detections = Detections::new(vec![
            at(0.0, 0.0, 4.0),
            at(1.0, 0.0, 1.0),
            at(4.0, 4.0, 9.0),
        ]);
        let scales = Scales::of(&detections.expect("good detections"));
        assert_eq!(
            (scales.nearest_m, scales.precision_m),
            (Some(1.0), Some(2.0))
        );
        assert!((scales.extent_m - 32.0_f64.sqrt()).abs() < 1e-12);
        let one = Detections::new(vec![Detection::at(1.0, 1.0)]).expect("a good detection");
        let none = Scales {
            nearest_m: None,
            extent_m: 0.0,
            precision_m: None,
        };
        assert_eq!(Scales::of(&one), none);
    }
}
