//! The penalty on landmarks that lie close together (source report, eq. 2).
//!
//! Pen(X;T) = Σ f(|x_i − x_j|) over the pairs i < j in different sets, with f(d) = 0 for d ≥ D
//! and, for u = d/D < 1,
//!
//! - `quadratic`, the report's: f = H (1 − u²);
//! - `cubic`, Ranganathan & Dellaert's (value H at 0, 0 at D): f = H (1 − 3u² + 2u³).
//!
//! The kernels work on draws that lie contiguous in memory, need no square root (quadratic) or one
//! (cubic), and are compiled for several instruction sets. Without fused multiply-add each lane
//! does the same operations in the same order, so all of them give the same bits.

use std::fmt;
use std::str::FromStr;

/// The form of f.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PenaltyShape {
    /// H (1 − u²): the source report, §3.2.
    Quadratic,
    /// H (1 − 3u² + 2u³): Ranganathan & Dellaert 2004, 2006.
    Cubic,
}

/// f, with its radius and height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Penalty {
    /// The form.
    pub shape: PenaltyShape,
    /// D, m: pairs at this distance or further apart cost nothing.
    pub radius_m: f64,
    /// H, nats: what a pair at distance 0 costs.
    pub height: f64,
}

impl Penalty {
    /// f(d)/H as a function of (d/D)².
    pub fn share(shape: PenaltyShape, u2: f64) -> f64 {
        match shape {
            PenaltyShape::Quadratic => quadratic_share(u2),
            PenaltyShape::Cubic => cubic_share(u2),
        }
    }

    /// 1/D², m⁻².
    pub fn inverse_square_radius(&self) -> f64 {
        1.0 / (self.radius_m * self.radius_m)
    }

    /// Adds f(|x_i − x_j|)/H of one pair to every draw's sum. All slices have length R.
    pub fn add_pair(&self, first: [&[f64]; 2], second: [&[f64]; 2], sums: &mut [f64]) {
        let scale = self.inverse_square_radius();
        match self.shape {
            PenaltyShape::Quadratic => kernel::add_quadratic(first, second, scale, sums),
            PenaltyShape::Cubic => kernel::add_cubic(first, second, scale, sums),
        }
    }

    /// The same for one detection and many others: the draws of another are row `others[k]` of `at`,
    /// rows as long as `sums`.
    pub fn add_pairs(&self, first: [&[f64]; 2], others: &[u32], at: [&[f64]; 2], sums: &mut [f64]) {
        let scale = self.inverse_square_radius();
        match self.shape {
            PenaltyShape::Quadratic => {
                kernel::add_many_quadratic(first, others, at, scale, sums);
            }
            PenaltyShape::Cubic => kernel::add_many_cubic(first, others, at, scale, sums),
        }
    }

    /// Σ f(|x − x_j|)/H over points j of other sets than `set`. The points come as coordinates and set, slices of one
    /// length, a multiple of [`LANES`]; padding has the coordinates [`PADDING`].
    pub fn sum_over_others(&self, x: [f64; 2], set: f64, points: [&[f64]; 3]) -> f64 {
        let scale = self.inverse_square_radius();
        match self.shape {
            PenaltyShape::Quadratic => kernel::sum_quadratic(x, set, points, scale),
            PenaltyShape::Cubic => kernel::sum_cubic(x, set, points, scale),
        }
    }

    /// The same of the distance |M(x_i − x_j)|, M an upper triangle.
    pub fn add_whitened_pair(
        &self,
        whiten: [f64; 3],
        first: [&[f64]; 2],
        second: [&[f64]; 2],
        sums: &mut [f64],
    ) {
        let root = 1.0 / self.radius_m;
        let whiten = whiten.map(|m| m * root);
        match self.shape {
            PenaltyShape::Quadratic => kernel::add_whitened_quadratic(whiten, first, second, sums),
            PenaltyShape::Cubic => kernel::add_whitened_cubic(whiten, first, second, sums),
        }
    }
}

/// Points that [`Penalty::sum_over_others`] takes at once.
pub const LANES: usize = 8;
/// A coordinate at which a point pays nothing.
pub const PADDING: f64 = 1e150;

#[inline(always)]
fn quadratic_share(u2: f64) -> f64 {
    (1.0 - u2).max(0.0)
}

#[inline(always)]
fn cubic_share(u2: f64) -> f64 {
    let u2 = u2.min(1.0);
    let u = u2.sqrt();
    ((1.0 - 3.0 * u2) + 2.0 * u2 * u).max(0.0)
}

/// The instruction set that the kernels use on this machine.
pub fn cpu_path() -> &'static str {
    kernel::path()
}

mod kernel {
    // `multiversion` checks what the CPU has and then calls the version compiled for it.
    #![allow(unsafe_code)]

    use multiversion::multiversion;
    use multiversion::target::match_target;

    #[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
    pub fn add_quadratic(first: [&[f64]; 2], second: [&[f64]; 2], scale: f64, sums: &mut [f64]) {
        add(first, second, scale, sums, super::quadratic_share);
    }

    #[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
    pub fn add_cubic(first: [&[f64]; 2], second: [&[f64]; 2], scale: f64, sums: &mut [f64]) {
        add(first, second, scale, sums, super::cubic_share);
    }

    #[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
    pub fn add_many_quadratic(
        first: [&[f64]; 2],
        others: &[u32],
        at: [&[f64]; 2],
        scale: f64,
        sums: &mut [f64],
    ) {
        add_many(first, others, at, scale, sums, super::quadratic_share);
    }

    #[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
    pub fn add_many_cubic(
        first: [&[f64]; 2],
        others: &[u32],
        at: [&[f64]; 2],
        scale: f64,
        sums: &mut [f64],
    ) {
        add_many(first, others, at, scale, sums, super::cubic_share);
    }

    /// One call for all of a detection's pairs: with few draws the dispatch would cost more than they.
    #[inline(always)]
    fn add_many(
        first: [&[f64]; 2],
        others: &[u32],
        at: [&[f64]; 2],
        scale: f64,
        sums: &mut [f64],
        share: impl Fn(f64) -> f64 + Copy,
    ) {
        let n_draws = sums.len();
        for &row in others {
            let range = row as usize * n_draws..(row as usize + 1) * n_draws;
            let second = [&at[0][range.clone()], &at[1][range]];
            add(first, second, scale, sums, share);
        }
    }

    #[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
    pub fn add_whitened_quadratic(
        whiten: [f64; 3],
        first: [&[f64]; 2],
        second: [&[f64]; 2],
        sums: &mut [f64],
    ) {
        add_whitened(whiten, first, second, sums, super::quadratic_share);
    }

    #[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
    pub fn add_whitened_cubic(
        whiten: [f64; 3],
        first: [&[f64]; 2],
        second: [&[f64]; 2],
        sums: &mut [f64],
    ) {
        add_whitened(whiten, first, second, sums, super::cubic_share);
    }

    #[inline(always)]
    fn add_whitened(
        whiten: [f64; 3],
        first: [&[f64]; 2],
        second: [&[f64]; 2],
        sums: &mut [f64],
        share: impl Fn(f64) -> f64,
    ) {
        let n_draws = sums.len();
        let [x1, y1] = first.map(|slice| &slice[..n_draws]);
        let [x2, y2] = second.map(|slice| &slice[..n_draws]);
        for r in 0..n_draws {
            let (dx, dy) = (x1[r] - x2[r], y1[r] - y2[r]);
            let (u, v) = (whiten[0] * dx + whiten[1] * dy, whiten[2] * dy);
            sums[r] += share(u * u + v * v);
        }
    }

    #[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
    pub fn sum_quadratic(x: [f64; 2], set: f64, points: [&[f64]; 3], scale: f64) -> f64 {
        sum(x, set, points, scale, super::quadratic_share)
    }

    #[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
    pub fn sum_cubic(x: [f64; 2], set: f64, points: [&[f64]; 3], scale: f64) -> f64 {
        sum(x, set, points, scale, super::cubic_share)
    }

    /// One sum for each lane, put together in one order.
    #[inline(always)]
    pub fn sum(
        x: [f64; 2],
        set: f64,
        points: [&[f64]; 3],
        scale: f64,
        share: impl Fn(f64) -> f64,
    ) -> f64 {
        use super::LANES;
        let [xs, ys, sets] = points.map(|slice| slice.as_chunks::<LANES>().0);
        let n = xs.len().min(ys.len()).min(sets.len());
        let (xs, ys, sets) = (&xs[..n], &ys[..n], &sets[..n]);
        let mut sums = [0.0; LANES];
        for k in 0..n {
            for lane in 0..LANES {
                let (dx, dy) = (xs[k][lane] - x[0], ys[k][lane] - x[1]);
                let value = share((dx * dx + dy * dy) * scale);
                sums[lane] += if sets[k][lane] == set { 0.0 } else { value };
            }
        }
        let [a, b, c, d, e, f, g, h] = sums;
        ((a + e) + (c + g)) + ((b + f) + (d + h))
    }

    #[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
    pub fn path() -> &'static str {
        match_target! {
            "x86_64+avx512f+avx512dq+avx512vl" => "AVX-512",
            "x86_64+avx2" => "AVX2",
            "aarch64+neon" => "NEON",
            _ => "baseline",
        }
    }

    #[inline(always)]
    pub fn add(
        first: [&[f64]; 2],
        second: [&[f64]; 2],
        scale: f64,
        sums: &mut [f64],
        share: impl Fn(f64) -> f64,
    ) {
        // Slices of one length, so that the loop is free of bounds checks.
        let n_draws = sums.len();
        let [x1, y1] = first.map(|slice| &slice[..n_draws]);
        let [x2, y2] = second.map(|slice| &slice[..n_draws]);
        for r in 0..n_draws {
            let (dx, dy) = (x1[r] - x2[r], y1[r] - y2[r]);
            sums[r] += share((dx * dx + dy * dy) * scale);
        }
    }
}

impl fmt::Display for PenaltyShape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Quadratic => "quadratic",
            Self::Cubic => "cubic",
        })
    }
}

impl FromStr for PenaltyShape {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "quadratic" => Ok(Self::Quadratic),
            "cubic" => Ok(Self::Cubic),
            _ => Err("quadratic or cubic".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn height_at_zero_and_nothing_from_the_radius_on() {
        for shape in [PenaltyShape::Quadratic, PenaltyShape::Cubic] {
            assert_eq!(Penalty::share(shape, 0.0), 1.0);
            for u2 in [1.0, 1.0 + 1e-15, 4.0, 1e308, f64::INFINITY] {
                assert_eq!(Penalty::share(shape, u2), 0.0, "{shape} {u2}");
            }
        }
        assert_eq!(Penalty::share(PenaltyShape::Quadratic, 0.25), 0.75);
        assert_eq!(Penalty::share(PenaltyShape::Cubic, 0.25), 0.5);
    }

    #[test]
    fn the_sum_over_other_sets_is_the_same_bits_and_right() {
        let value = |k: usize| ((k * 7919) % 1009) as f64 / 300.0;
        let n = 40;
        let mut columns: [Vec<f64>; 3] = [0, 1, 2].map(|column| {
            let at = |k| {
                if column == 2 {
                    (k % 3) as f64
                } else {
                    value(3 * k + column)
                }
            };
            (0..n).map(at).collect()
        });
        for (column, padding) in columns.iter_mut().zip([PADDING, PADDING, -2.0]) {
            column[n - 3..].fill(padding);
        }
        let points = [0, 1, 2].map(|column| columns[column].as_slice());
        for shape in [PenaltyShape::Quadratic, PenaltyShape::Cubic] {
            let penalty = Penalty {
                shape,
                radius_m: 2.0,
                height: 1.0,
            };
            for set in [-1.0, 1.0] {
                let x = [1.3, 1.1];
                let got = penalty.sum_over_others(x, set, points);
                let plain = kernel::sum(x, set, points, 0.25, |u2| Penalty::share(shape, u2));
                assert_eq!(got, plain, "{shape} on {}", cpu_path());
                let mut expected = 0.0;
                let [xs, ys, sets] = points.map(<[f64]>::iter);
                for ((px, py), other) in xs.zip(ys).zip(sets) {
                    if *other != set {
                        let d2 = (px - x[0]).powi(2) + (py - x[1]).powi(2);
                        expected += Penalty::share(shape, d2 / 4.0);
                    }
                }
                assert!(
                    expected > 1.0 && (got - expected).abs() < 1e-12,
                    "{got} {expected}"
                );
            }
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let value = |k: usize| ((k * 7919) % 1009) as f64 / 173.0;
        let n_draws = 37;
        let x: Vec<Vec<f64>> = (0..4)
            .map(|s| (0..n_draws).map(|r| value(s * n_draws + r)).collect())
            .collect();
        for shape in [PenaltyShape::Quadratic, PenaltyShape::Cubic] {
            let penalty = Penalty {
                shape,
                radius_m: 3.0,
                height: 1.0,
            };
            let mut dispatched = vec![0.125; n_draws];
            penalty.add_pair([&x[0], &x[1]], [&x[2], &x[3]], &mut dispatched);
            let mut plain = vec![0.125; n_draws];
            kernel::add(
                [&x[0], &x[1]],
                [&x[2], &x[3]],
                penalty.inverse_square_radius(),
                &mut plain,
                |u2| Penalty::share(shape, u2),
            );
            assert!(dispatched.iter().any(|&sum| sum > 0.125));
            assert_eq!(dispatched, plain, "{shape} on {}", cpu_path());
        }
    }
}
