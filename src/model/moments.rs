//! Number, mean and scatter of some points: all that the closed forms of the metric model need of a
//! set.
//!
//! With n points p, mean p̄ and W = Σ|p − p̄|², adding or removing one point p changes W by
//!
//! - with p: W + n/(n+1)·|p − p̄|²;
//! - without p: W − n/(n−1)·|p − p̄|².
//!
//! Means and scatters keep their digits far from the origin, which Σp and Σ|p|² would lose.

use serde::{Deserialize, Serialize};

/// Number, mean (m) and scatter (m²) of points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Moments {
    /// n.
    pub n: usize,
    /// p̄, m; 0 where n is 0.
    pub mean_m: [f64; 2],
    /// W = Σ|p − p̄|² ≥ 0, m².
    pub scatter_m2: f64,
}

/// |p − q|².
#[inline(always)]
pub fn square_distance(p: [f64; 2], q: [f64; 2]) -> f64 {
    let (dx, dy) = (p[0] - q[0], p[1] - q[1]);
    dx * dx + dy * dy
}

impl Moments {
    /// Of points, in two passes.
    pub fn of(points_m: impl Iterator<Item = [f64; 2]> + Clone) -> Self {
        let (mut n, mut sum) = (0, [0.0; 2]);
        for p in points_m.clone() {
            n += 1;
            sum[0] += p[0];
            sum[1] += p[1];
        }
        if n < 2 {
            return Self {
                n,
                mean_m: sum,
                scatter_m2: 0.0,
            };
        }
        let mean_m = sum.map(|total| total / n as f64);
        let scatter_m2 = points_m.map(|p| square_distance(p, mean_m)).sum();
        Self {
            n,
            mean_m,
            scatter_m2,
        }
    }

    /// With one point more.
    #[must_use]
    pub fn with(&self, p: [f64; 2]) -> Self {
        let n = self.n + 1;
        let step = |axis: usize| (p[axis] - self.mean_m[axis]) / n as f64;
        let grown = self.n as f64 / n as f64 * square_distance(p, self.mean_m);
        Self {
            n,
            mean_m: [self.mean_m[0] + step(0), self.mean_m[1] + step(1)],
            scatter_m2: self.scatter_m2 + grown,
        }
    }

    /// Without one of the points.
    #[must_use]
    pub fn without(&self, p: [f64; 2]) -> Self {
        let n = self.n - 1;
        if n == 0 {
            return Self::default();
        }
        let step = |axis: usize| (p[axis] - self.mean_m[axis]) / n as f64;
        let lost = self.n as f64 / n as f64 * square_distance(p, self.mean_m);
        Self {
            n,
            mean_m: [self.mean_m[0] - step(0), self.mean_m[1] - step(1)],
            // One point has no scatter, whatever rounding says.
            scatter_m2: if n == 1 {
                0.0
            } else {
                (self.scatter_m2 - lost).max(0.0)
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_more_or_less_is_as_from_scratch() {
        let points: Vec<[f64; 2]> = (0..9_i32)
            .map(|i| [1e4 + f64::from(i * i % 7), -0.3 * f64::from(i)])
            .collect();
        let near = |a: Moments, b: Moments| {
            assert_eq!(a.n, b.n);
            assert!((a.scatter_m2 - b.scatter_m2).abs() < 1e-9, "{a:?} {b:?}");
            assert!(square_distance(a.mean_m, b.mean_m) < 1e-20, "{a:?} {b:?}");
        };
        for n in 1..points.len() {
            let (some, one) = (&points[..n], points[n]);
            let more = Moments::of(points[..=n].iter().copied());
            let fewer = Moments::of(some.iter().copied());
            near(fewer.with(one), more);
            near(more.without(one), fewer);
        }
        assert_eq!(
            Moments::of(std::iter::empty()).with([2.0, 3.0]).mean_m,
            [2.0, 3.0]
        );
    }
}
