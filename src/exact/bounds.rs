//! Bounds on the penalty's part of an integral: which sets can meet, and how much it is at most.
//!
//! **Meeting.** Let M whiten the pair (C̄⁻¹ = MᵀM; the identity in the metric model), μ the whitened
//! difference of two means and V its covariance. |d| < D needs u·d < D in the direction u of μ, so
//!
//! P(|x_i − x_j| < D) ≤ e^{k_i + k_j} · ½ exp(−(|μ| − D)² / (2 uᵀVu))   for |μ| > D.
//!
//! **At most.** Both shapes lie above a parabola, f(d) ≥ θH(1 − κd²/D²) for every θ in [0, 1], with
//! κ = 1 (quadratic) and 3 (cubic, whose term 2u³ is dropped). With L the sum over the n_p pairs in
//! different sets of their squared distance as a matrix, s = θHκ/D² and P' = P − sL positive definite,
//!
//! E[exp(−Pen)] ≤ exp(Σ k − θ H n_p + ½ ln(det P / det P') + s mᵀLm + s² (Lm)ᵀ P'⁻¹ (Lm)),
//!
//! a Gaussian integral. It certifies that a topology is negligible where no draw escapes the penalty.

use nalgebra::{DMatrix, DVector};

use crate::model::{Model, PenaltyShape, SetLaw};

/// A set with its members in rising order and the law of their locations.
#[derive(Clone, Debug)]
pub struct SetPart {
    /// The members.
    pub members: Vec<u32>,
    /// Their law.
    pub law: SetLaw,
}

/// ln of a bound on the probability that any member of one set comes within D of any of the other.
pub fn ln_meeting(model: &Model, first: &SetPart, second: &SetPart) -> f64 {
    let mut total = 0.0;
    for (a, &i) in first.members.iter().enumerate() {
        for (b, &j) in second.members.iter().enumerate() {
            total += libm::exp(ln_pair_meeting(model, (first, a, i), (second, b, j)));
        }
    }
    libm::log(total).min(0.0)
}

fn ln_pair_meeting(
    model: &Model,
    (first, a, i): (&SetPart, usize, u32),
    (second, b, j): (&SetPart, usize, u32),
) -> f64 {
    let whiten = model.pair_whitening(i, j);
    let (m1, m2) = (first.law.mean_m[a], second.law.mean_m[b]);
    let mean = apply(whiten, [m1[0] - m2[0], m1[1] - m2[1]]);
    let distance = mean[0].hypot(mean[1]);
    let gap = distance - model.penalty().radius_m;
    if gap <= 0.0 {
        return 0.0;
    }
    // Variance along u: (Mᵀu)ᵀ V (Mᵀu).
    let u = [mean[0] / distance, mean[1] / distance];
    let back = [whiten[0] * u[0], whiten[1] * u[0] + whiten[2] * u[1]];
    let (v1, v2) = (first.law.covariance_m2[a], second.law.covariance_m2[b]);
    let v = [v1[0] + v2[0], v1[1] + v2[1], v1[2] + v2[2]];
    let variance =
        v[0] * back[0] * back[0] + 2.0 * v[1] * back[0] * back[1] + v[2] * back[1] * back[1];
    let envelope = first.law.ln_envelope[a] + second.law.ln_envelope[b];
    (envelope - std::f64::consts::LN_2 - gap * gap / (2.0 * variance)).min(0.0)
}

/// (u, v) = M (dx, dy) with the upper triangle M = [[m₀, m₁], [0, m₂]].
fn apply(whiten: [f64; 3], d: [f64; 2]) -> [f64; 2] {
    [whiten[0] * d[0] + whiten[1] * d[1], whiten[2] * d[1]]
}

/// θ is tried at this many values, each 1/√2 of the one before.
const N_TILTS: i32 = 24;

/// ln of an upper bound on E[exp(−Pen)] of the pairs among these sets; at most 0.
pub fn ln_at_most(model: &Model, sets: &[&SetPart]) -> f64 {
    let penalty = model.penalty();
    let members: Vec<(usize, u32)> = sets
        .iter()
        .enumerate()
        .flat_map(|(set_ix, part)| part.members.iter().map(move |&i| (set_ix, i)))
        .collect();
    let n = 2 * members.len();
    let (mut precision, mut mean) = (DMatrix::zeros(n, n), DVector::zeros(n));
    let (mut start, mut envelope) = (0, 0.0);
    for part in sets {
        let size = 2 * part.members.len();
        precision
            .view_mut((start, start), (size, size))
            .copy_from(&part.law.precision);
        for (k, value) in part.law.mean_m.iter().flatten().enumerate() {
            mean[start + k] = *value;
        }
        envelope += part.law.ln_envelope.iter().sum::<f64>();
        start += size;
    }
    let (mut squares, mut n_pairs) = (DMatrix::<f64>::zeros(n, n), 0.0);
    for (a, &(set_a, i)) in members.iter().enumerate() {
        for (b, &(set_b, j)) in members.iter().enumerate().skip(a + 1) {
            if set_a == set_b {
                continue;
            }
            n_pairs += 1.0;
            let m = model.pair_whitening(i, j);
            let block = [
                [m[0] * m[0], m[0] * m[1]],
                [m[0] * m[1], m[1] * m[1] + m[2] * m[2]],
            ];
            for (k, row) in block.iter().enumerate() {
                for (l, &value) in row.iter().enumerate() {
                    squares[(2 * a + k, 2 * a + l)] += value;
                    squares[(2 * b + k, 2 * b + l)] += value;
                    squares[(2 * a + k, 2 * b + l)] -= value;
                    squares[(2 * b + k, 2 * a + l)] -= value;
                }
            }
        }
    }
    let kappa = match penalty.shape {
        PenaltyShape::Quadratic => 1.0,
        PenaltyShape::Cubic => 3.0,
    };
    let Some(ln_det) = ln_root_determinant(&precision) else {
        return 0.0;
    };
    let pushed = &squares * &mean;
    let spread = mean.dot(&pushed);
    // From the largest tilt that could matter: sL may not exceed P, and ‖L‖ ≤ trace.
    let steepest = penalty.inverse_square_radius() * kappa;
    let most =
        (penalty.height * steepest).min(2.0 * precision.trace() / squares.trace() * n as f64);
    let mut best = 0.0_f64;
    for k in 0..N_TILTS {
        let s = most * libm::exp2(-0.5 * f64::from(k));
        let Some(tilted) = (&precision - &squares * s).cholesky() else {
            continue;
        };
        let ln_det_tilted: f64 = tilted
            .l_dirty()
            .diagonal()
            .iter()
            .map(|d| libm::log(*d))
            .sum();
        let quadratic = s * spread + s * s * pushed.dot(&tilted.solve(&pushed));
        let bound = envelope - s / steepest * n_pairs + (ln_det - ln_det_tilted) + quadratic;
        if bound.is_finite() {
            best = best.min(bound);
        }
    }
    best
}

/// ½ ln det of a positive definite matrix.
fn ln_root_determinant(matrix: &DMatrix<f64>) -> Option<f64> {
    let factor = matrix.clone().cholesky()?;
    Some(
        factor
            .l_dirty()
            .diagonal()
            .iter()
            .map(|d| libm::log(*d))
            .sum(),
    )
}
