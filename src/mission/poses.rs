//! The information of all poses, block tridiagonal, and its Cholesky factor.
//!
//! With diagonal blocks D_k and couplings U_k between k and k+1 (3×3 each) elimination in the order
//! of time gives D̃_k = D_k − U_{k−1}ᵀ D̃_{k−1}⁻¹ U_{k−1}. The gain G_k = D̃_k⁻¹ U_k is that of a
//! Rauch–Tung–Striebel smoother: Σ_{k,j} = −G_k Σ_{k+1,j} for j > k, and Σ_{k,k} = D̃_k⁻¹ + G_k
//! Σ_{k+1,k+1} G_kᵀ. Elimination costs O(n) for n poses.
//!
//! The first pose defines the frame: D̃₀⁻¹ = 0, and it is in no determinant.

use nalgebra::{Matrix3, Vector3};

/// The information of poses.
#[derive(Clone, Debug)]
pub(super) struct PoseInformation {
    /// D_k.
    pub diagonal: Vec<Matrix3<f64>>,
    /// U_k.
    pub coupling: Vec<Matrix3<f64>>,
}

/// The same, eliminated.
#[derive(Clone, Debug)]
pub(super) struct PoseFactor {
    /// D̃_k⁻¹.
    inverse: Vec<Matrix3<f64>>,
    /// G_k.
    gain: Vec<Matrix3<f64>>,
    /// ½ ln det of the information.
    pub half_ln_det: f64,
}

impl PoseInformation {
    /// Eliminates all poses but the first, which stays where it is; `None` if they are not positive
    /// definite.
    pub fn factor(&self) -> Option<PoseFactor> {
        let n = self.diagonal.len();
        let mut factor = PoseFactor {
            inverse: Vec::with_capacity(n),
            gain: Vec::with_capacity(n),
            half_ln_det: 0.0,
        };
        factor.inverse.push(Matrix3::zeros());
        for k in 1..n {
            let gain = factor.inverse[k - 1] * self.coupling[k - 1];
            let pivot = self.diagonal[k] - self.coupling[k - 1].transpose() * gain;
            let root = pivot.cholesky()?;
            let lower = root.l_dirty();
            let product = lower[(0, 0)] * lower[(1, 1)] * lower[(2, 2)];
            factor.half_ln_det += libm::log(product);
            factor.gain.push(gain);
            factor.inverse.push(root.inverse());
        }
        factor.half_ln_det.is_finite().then_some(factor)
    }
}

impl PoseFactor {
    /// Solves for one right-hand side, in its place.
    pub fn solve(&self, right: &mut [Vector3<f64>]) {
        for k in 1..right.len() {
            let earlier = right[k - 1];
            right[k] -= self.gain[k - 1].tr_mul(&earlier);
        }
        let last = right.len() - 1;
        right[last] = self.inverse[last] * right[last];
        for k in (0..last).rev() {
            right[k] = self.inverse[k] * right[k] - self.gain[k] * right[k + 1];
        }
    }

    /// Σ_{k,k} of all poses.
    pub fn covariances(&self) -> Vec<Matrix3<f64>> {
        let mut covariances = self.inverse.clone();
        for k in (0..self.gain.len()).rev() {
            let later = covariances[k + 1];
            covariances[k] += self.gain[k] * later * self.gain[k].transpose();
        }
        covariances
    }

    /// What takes Σ_{j,·} to Σ_{i,·} for an earlier pose i: the product of −G_k from i to j.
    pub fn step_back(&self, i: usize, j: usize) -> Matrix3<f64> {
        let gains = self.gain[i..j].iter();
        gains.fold(Matrix3::identity(), |product, gain| product * -gain)
    }
}
