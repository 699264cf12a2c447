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

/// θ is tried at so many values per halving, over twelve halvings: few for a bound, as every group wants
/// one, many for the Gaussian that draws come from.
pub const COARSE: u32 = 2;
pub const FINE: u32 = 8;

/// The Gaussian above exp(−Pen) times the law of some sets: of the tightest θ.
pub struct Tilt {
    /// ln of the bound on E[exp(−Pen)]; at most 0.
    pub ln_at_most: f64,
    /// ln of what this Gaussian integrates to, over the law: the bound before it is cut at 0.
    pub ln_scale: f64,
    /// s = θHκ/D²: a squared distance is worth so much.
    pub push: f64,
    /// θ H n_p.
    pub level: f64,
    /// Its mean, m; coordinates as in [`SetLaw::precision`].
    pub mean_m: DVector<f64>,
    /// The lower Cholesky factor of P'.
    pub factor: DMatrix<f64>,
}

/// The tightest of them for the pairs among these sets; `None` if the law itself is singular to rounding.
pub fn tilt(model: &Model, sets: &[(&[u32], &SetLaw)], per_halving: u32) -> Option<Tilt> {
    let penalty = model.penalty();
    let members: Vec<(usize, u32)> = sets
        .iter()
        .enumerate()
        .flat_map(|(set_ix, (members, _))| members.iter().map(move |&i| (set_ix, i)))
        .collect();
    let n = 2 * members.len();
    let (mut precision, mut mean) = (DMatrix::zeros(n, n), DVector::zeros(n));
    let (mut start, mut envelope) = (0, 0.0);
    for (members, law) in sets {
        let size = 2 * members.len();
        precision
            .view_mut((start, start), (size, size))
            .copy_from(&law.precision);
        for (k, value) in law.mean_m.iter().flatten().enumerate() {
            mean[start + k] = *value;
        }
        envelope += law.ln_envelope.iter().sum::<f64>();
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
    let factor = precision.clone().cholesky()?.l();
    let ln_det = ln_diagonal(&factor);
    let pushed = &squares * &mean;
    let spread = mean.dot(&pushed);
    let mut best = Tilt {
        ln_at_most: 0.0,
        ln_scale: envelope,
        push: 0.0,
        level: 0.0,
        mean_m: mean.clone(),
        factor,
    };
    // From the largest tilt that could matter: sL may not exceed P, and ‖L‖ ≤ trace.
    let steepest = penalty.inverse_square_radius() * kappa;
    let most =
        (penalty.height * steepest).min(2.0 * precision.trace() / squares.trace() * n as f64);
    for k in 0..12 * per_halving {
        let push = most * libm::exp2(-f64::from(k) / f64::from(per_halving));
        let Some(tilted) = (&precision - &squares * push).cholesky() else {
            continue;
        };
        let ln_det_tilted = ln_diagonal(tilted.l_dirty());
        let quadratic = push * spread + push * push * pushed.dot(&tilted.solve(&pushed));
        let level = push / steepest * n_pairs;
        let bound = envelope - level + (ln_det - ln_det_tilted) + quadratic;
        if bound.is_finite() && bound < best.ln_scale {
            best = Tilt {
                ln_at_most: bound.min(0.0),
                ln_scale: bound,
                push,
                level,
                mean_m: tilted.solve(&(&precision * &mean)),
                factor: tilted.l(),
            };
        }
    }
    Some(best)
}

/// Σ ln of the diagonal: ½ ln det of what it is the Cholesky factor of.
fn ln_diagonal(factor: &DMatrix<f64>) -> f64 {
    factor.diagonal().iter().map(|d| libm::log(*d)).sum()
}
