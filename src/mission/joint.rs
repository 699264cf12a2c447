//! The joint Gaussian of the landmarks' places: mean, and dense covariance (m²).
//!
//! To say that landmarks a and b are one is to condition on x_b − x_a = 0, which has the density
//! N(d; 0, S) with d = x_b − x_a and S = C_aa + C_bb − C_ab − C_ba: O(1) to score, and a change of
//! rank two to apply.

use std::f64::consts::TAU;

use super::kernels::{invert, subtract_rank_two};

/// Determinants of covariances are at least this, m⁴: landmarks whose difference is known without
/// error are an artefact of rounding.
const LEAST_DET: f64 = 1e-18;

/// A 2×2 matrix: xx, xy, yx, yy.
pub(super) type Block = [f64; 4];

/// Places of n landmarks.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    /// m.
    pub mean_m: Vec<[f64; 2]>,
    /// Rows of `stride` numbers, of which the first 2n count; m².
    covariance: Vec<f64>,
    stride: usize,
}

/// How well two landmarks agree to be one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Match {
    /// dᵀS⁻¹d.
    pub square_distance: f64,
    /// ln N(d; 0, S), 1/m².
    pub ln_density: f64,
}

/// The match of a difference d (m) of covariance S (xx, xy, yy; m²).
pub(super) fn match_of([dx, dy]: [f64; 2], [xx, xy, yy]: [f64; 3]) -> Match {
    let det = (xx * yy - xy * xy).max(LEAST_DET);
    let square_distance = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / det;
    Match {
        square_distance,
        ln_density: -0.5 * square_distance - 0.5 * libm::log(det) - libm::log(TAU),
    }
}

impl Joint {
    /// From the information (rows of `stride` numbers, 1/m²) and information vector (1/m) of n
    /// landmarks, with ln det of the information; `None` if it is not positive definite.
    pub fn of_information(
        mut information: Vec<f64>,
        stride: usize,
        vector: &[[f64; 2]],
    ) -> Option<(Self, f64)> {
        let n = vector.len();
        let ln_det = invert(&mut information, stride, 2 * n)?;
        let mut joint = Self {
            mean_m: vec![[0.0; 2]; n],
            covariance: information,
            stride,
        };
        joint.mean_m = (0..n).map(|a| joint.times(a, vector)).collect();
        Some((joint, ln_det))
    }

    /// C_a·v.
    fn times(&self, a: usize, vector: &[[f64; 2]]) -> [f64; 2] {
        [0, 1].map(|axis| {
            let row = &self.covariance[(2 * a + axis) * self.stride..];
            let pairs = row.chunks_exact(2).zip(vector);
            pairs.map(|(c, v)| c[0] * v[0] + c[1] * v[1]).sum()
        })
    }

    /// The number of landmarks.
    pub fn len(&self) -> usize {
        self.mean_m.len()
    }

    /// C_ab.
    pub fn block(&self, a: usize, b: usize) -> Block {
        let top = 2 * a * self.stride + 2 * b;
        let low = top + self.stride;
        let c = &self.covariance;
        [c[top], c[top + 1], c[low], c[low + 1]]
    }

    /// d and S of two landmarks.
    pub fn difference(&self, a: usize, b: usize) -> ([f64; 2], [f64; 3]) {
        let (aa, bb, ab) = (self.block(a, a), self.block(b, b), self.block(a, b));
        let ([ax, ay], [bx, by]) = (self.mean_m[a], self.mean_m[b]);
        (
            [bx - ax, by - ay],
            [
                aa[0] + bb[0] - 2.0 * ab[0],
                aa[1] + bb[1] - ab[1] - ab[2],
                aa[3] + bb[3] - 2.0 * ab[3],
            ],
        )
    }

    /// How well two landmarks agree to be one.
    pub fn match_of(&self, a: usize, b: usize) -> Match {
        let (d, s) = self.difference(a, b);
        match_of(d, s)
    }

    /// Conditions on two landmarks being one. Both stay.
    pub fn identify(&mut self, a: usize, b: usize) {
        let n = 2 * self.len();
        let ([dx, dy], [xx, xy, yy]) = self.difference(a, b);
        let det = (xx * yy - xy * xy).max(LEAST_DET);
        let (ixx, ixy, iyy) = (yy / det, -xy / det, xx / det);
        let row = |landmark: usize, axis: usize| {
            let start = (2 * landmark + axis) * self.stride;
            &self.covariance[start..start + n]
        };
        let minus = |axis: usize| -> Vec<f64> {
            let pairs = row(b, axis).iter().zip(row(a, axis));
            pairs.map(|(of_b, of_a)| of_b - of_a).collect()
        };
        let (g0, g1) = (minus(0), minus(1));
        let pairs = || g0.iter().zip(&g1);
        let k0: Vec<f64> = pairs().map(|(x, y)| x * ixx + y * ixy).collect();
        let k1: Vec<f64> = pairs().map(|(x, y)| x * ixy + y * iyy).collect();
        for (place, mean) in self.mean_m.iter_mut().enumerate() {
            for (axis, value) in mean.iter_mut().enumerate() {
                let i = 2 * place + axis;
                *value -= k0[i] * dx + k1[i] * dy;
            }
        }
        subtract_rank_two(&mut self.covariance, self.stride, [&k0, &k1], [&g0, &g1]);
    }

    /// Takes a landmark off the end of the list and puts it in the place of another, which is gone.
    pub fn swap_remove(&mut self, a: usize) {
        let last = self.len() - 1;
        let n = 2 * last + 2;
        if a != last {
            for axis in 0..2 {
                let (to, from) = (2 * a + axis, 2 * last + axis);
                self.covariance
                    .copy_within(from * self.stride..from * self.stride + n, to * self.stride);
            }
            for row in self.covariance.chunks_exact_mut(self.stride).take(n) {
                row[2 * a] = row[2 * last];
                row[2 * a + 1] = row[2 * last + 1];
            }
        }
        self.mean_m.swap_remove(a);
    }

    /// Frees a part of landmark a: the landmark moves by −Cr·δ, as `Freed` has it, and if `keep`
    /// the part becomes one more landmark, at the end.
    pub fn free(&mut self, a: usize, freed: &Freed) {
        let n = 2 * self.len();
        let [pxx, pxy, pyy] = freed.covariance;
        let [dx, dy] = freed.offset_m;
        let pairs = || freed.gain[0].iter().zip(&freed.gain[1]);
        let k0: Vec<f64> = pairs().map(|(x, y)| -(x * pxx + y * pxy)).collect();
        let k1: Vec<f64> = pairs().map(|(x, y)| -(x * pxy + y * pyy)).collect();
        for (place, mean) in self.mean_m.iter_mut().enumerate() {
            for (axis, value) in mean.iter_mut().enumerate() {
                let i = 2 * place + axis;
                *value -= freed.gain[0][i] * dx + freed.gain[1][i] * dy;
            }
        }
        let gain = [&freed.gain[0][..], &freed.gain[1][..]];
        subtract_rank_two(&mut self.covariance, self.stride, [&k0, &k1], gain);
        self.make_room();
        // cov(u, ·) = cov(l_a, ·) + cov(δ, ·), where cov(δ, l) = −P(Cr)ᵀ, which is k above.
        for (axis, k) in [&k0, &k1].into_iter().enumerate() {
            for (i, shared) in k.iter().enumerate() {
                let value = self.covariance[(2 * a + axis) * self.stride + i] + shared;
                self.covariance[(n + axis) * self.stride + i] = value;
                self.covariance[i * self.stride + n + axis] = value;
            }
        }
        let p = [[pxx, pxy], [pxy, pyy]];
        for (row, p_row) in p.iter().enumerate() {
            for (column, own) in p_row.iter().enumerate() {
                // var(l_a + δ) = var(l_a) + P + cov(δ, l_a) + cov(l_a, δ)
                let of_a = self.covariance[(2 * a + row) * self.stride + 2 * a + column];
                let k = [&k0, &k1];
                let cross = k[row][2 * a + column] + k[column][2 * a + row];
                self.covariance[(n + row) * self.stride + n + column] = of_a + own + cross;
            }
        }
        let [x, y] = self.mean_m[a];
        self.mean_m.push([x + dx, y + dy]);
    }

    /// Room for one more landmark.
    fn make_room(&mut self) {
        let n = 2 * self.len();
        if n + 2 <= self.stride {
            return;
        }
        let stride = (self.stride * 3 / 2).next_multiple_of(8).max(n + 8);
        let mut grown = vec![0.0; stride * stride];
        for i in 0..n {
            let row = &self.covariance[i * self.stride..i * self.stride + n];
            grown[i * stride..i * stride + n].copy_from_slice(row);
        }
        self.covariance = grown;
        self.stride = stride;
    }

    /// The joint of some landmarks.
    pub fn of_some(&self, landmarks: &[usize]) -> Self {
        let stride = 2 * landmarks.len();
        let mut covariance = Vec::with_capacity(stride * stride);
        for &a in landmarks {
            for axis in 0..2 {
                let row = &self.covariance[(2 * a + axis) * self.stride..];
                for &b in landmarks {
                    covariance.extend_from_slice(&row[2 * b..2 * b + 2]);
                }
            }
        }
        Self {
            mean_m: landmarks.iter().map(|&a| self.mean_m[a]).collect(),
            covariance,
            stride,
        }
    }

    /// Adds C·r for a matrix r of two columns, given as its non-zero blocks by landmark.
    pub fn times_sparse(&self, right: &[(usize, Block)]) -> [Vec<f64>; 2] {
        let n = 2 * self.len();
        let mut product = [vec![0.0; n], vec![0.0; n]];
        for &(b, [xx, xy, yx, yy]) in right {
            // By symmetry the rows of b are its columns.
            let rows = [0, 1].map(|axis| {
                let start = (2 * b + axis) * self.stride;
                &self.covariance[start..start + n]
            });
            let [first, second] = &mut product;
            let values = first.iter_mut().zip(second.iter_mut());
            for ((x, y), (c0, c1)) in values.zip(rows[0].iter().zip(rows[1])) {
                *x += c0 * xx + c1 * yx;
                *y += c0 * xy + c1 * yy;
            }
        }
        product
    }
}

/// What freeing some sightings of a landmark does: the place of the part is that of the landmark
/// plus δ.
#[derive(Clone, Debug)]
pub(super) struct Freed {
    /// Columns of C·r, r the information between landmarks and the part, m²·1/m².
    pub gain: [Vec<f64>; 2],
    /// Mean of δ, m.
    pub offset_m: [f64; 2],
    /// Covariance of δ: xx, xy, yy, m².
    pub covariance: [f64; 3],
}
