//! The covariance model, "covPTM" (source report, eq. 6).
//!
//! E(X;T) = Σ_i m(x_i; z_i, C_i)²/σ_o² + Σ_{S∈T} Σ_{i∈S} Σ_{j∈S, j≠i} (m(x_i; z_j, C_j) + b_ij)²/σ_t²
//!
//! over **ordered** pairs, with the Mahalanobis distance m(x; z, C) = √((x−z)ᵀC⁻¹(x−z)) and, with
//! C̄ = (C_i + C_j)/2, the Bhattacharyya distance
//!
//! b_ij = ⅛ (z_i−z_j)ᵀ C̄⁻¹ (z_i−z_j) + ½ ln(det C̄ / √(det C_i det C_j)).
//!
//! The term j = i of the report would only rescale σ_o and is left out. The penalty sees the distance
//! d² = (x_i−x_j)ᵀ C̄⁻¹ (x_i−x_j): radius and distance are in Mahalanobis units, σ_o and σ_t without unit.
//! Given T, E splits into one problem per detection ([`site`](super::site)), which depends on the
//! detection's *set* alone and is remembered by it. Nothing is left out of ∫exp(−E).

use std::collections::HashMap;
use std::sync::Arc;

use nalgebra::{DMatrix, Matrix2, Vector2};

use super::exact_site::ExactSite;
use super::location_law::whitening;
use super::site::Site;
use super::sum_of_norms::{Norm, SumOfNorms};
use super::{Appearance, Penalty, SetLaw};
use crate::detections::Covariance;

/// det C / (C_xx C_yy) below which a covariance is singular for all that a double can tell.
const LEAST_RELATIVE_DETERMINANT: f64 = 1e-12;

/// Covariances that this model cannot use: one line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "detection {number}: got a covariance of {xx},{xy},{yy} m², expected one that is positive definite \
     beyond rounding for model covariance; correct it, or use model metric"
)]
pub struct CovarianceError {
    number: usize,
    xx: f64,
    xy: f64,
    yy: f64,
}

/// The covariance model of one data set.
#[derive(Clone, Debug)]
pub struct CovarianceModel {
    /// z, m, relative to their mean.
    positions_m: Vec<[f64; 2]>,
    covariances_m2: Vec<Covariance>,
    /// M_j of each detection, upper triangles, m⁻¹.
    whitening: Vec<[f64; 3]>,
    /// ½ ln det C of each, from M.
    ln_root_determinant: Vec<f64>,
    /// Largest eigenvalue of each C, m².
    widest_m2: Vec<f64>,
    /// The largest of them, m².
    widest_of_all_m2: f64,
    observation_weight: f64,
    topology_weight: f64,
    penalty: Penalty,
    appearance: Appearance,
}

/// The sites of a set, by its members in rising order.
#[derive(Clone, Debug)]
pub struct SetSites {
    /// The members.
    pub members: Vec<u32>,
    /// The site of each.
    pub sites: Vec<Site>,
    /// Σ_i [ln(π/√det A_i) − E_i\*].
    pub ln_bound: f64,
}

impl CovarianceModel {
    /// For N ≥ 1 positions (m) with covariances (m²), and σ_o, σ_t > 0.
    ///
    /// # Errors
    /// A covariance that is not positive definite, or singular to rounding.
    pub fn new(
        positions_m: &[[f64; 2]],
        covariances_m2: &[Covariance],
        sigma_o: f64,
        sigma_t: f64,
        penalty: Penalty,
    ) -> Result<Self, CovarianceError> {
        for (ix, c) in covariances_m2.iter().enumerate() {
            let relative = c.determinant() / (c.xx * c.yy);
            // Written so that a NaN is refused.
            let good = c.is_positive_definite() && relative >= LEAST_RELATIVE_DETERMINANT;
            if !good || !whiten(*c).iter().all(|m| m.is_finite()) {
                return Err(CovarianceError {
                    number: ix + 1,
                    xx: c.xx,
                    xy: c.xy,
                    yy: c.yy,
                });
            }
        }
        let n = positions_m.len() as f64;
        let centre = [0, 1].map(|axis| positions_m.iter().map(|z| z[axis] / n).sum::<f64>());
        let widest = |c: &Covariance| {
            let (half, difference) = (0.5 * (c.xx + c.yy), 0.5 * (c.xx - c.yy));
            half + difference.hypot(c.xy)
        };
        Ok(Self {
            positions_m: positions_m
                .iter()
                .map(|z| [z[0] - centre[0], z[1] - centre[1]])
                .collect(),
            covariances_m2: covariances_m2.to_vec(),
            whitening: covariances_m2.iter().map(|&c| whiten(c)).collect(),
            ln_root_determinant: covariances_m2.iter().map(|&c| ln_root(whiten(c))).collect(),
            widest_of_all_m2: covariances_m2.iter().map(widest).fold(0.0, f64::max),
            widest_m2: covariances_m2.iter().map(widest).collect(),
            observation_weight: 1.0 / (sigma_o * sigma_o),
            topology_weight: 1.0 / (sigma_t * sigma_t),
            penalty,
            appearance: Appearance::default(),
        })
    }

    /// The same model of some of its detections, in this order, where they are.
    #[must_use]
    pub(super) fn part(&self, chosen: &[u32]) -> Self {
        fn of<T: Copy>(all: &[T], chosen: &[u32]) -> Vec<T> {
            chosen.iter().map(|&i| all[i as usize]).collect()
        }
        Self {
            positions_m: of(&self.positions_m, chosen),
            covariances_m2: of(&self.covariances_m2, chosen),
            whitening: of(&self.whitening, chosen),
            ln_root_determinant: of(&self.ln_root_determinant, chosen),
            widest_m2: of(&self.widest_m2, chosen),
            appearance: self.appearance.part(chosen),
            ..*self
        }
    }

    /// The same model with evidence of what detections look like.
    #[must_use]
    pub fn with_appearance(mut self, appearance: Appearance) -> Self {
        self.appearance = appearance;
        self
    }

    /// What detections look like. The functions of this type are about locations alone.
    pub fn appearance(&self) -> &Appearance {
        &self.appearance
    }

    /// Number of detections N.
    pub fn n_detections(&self) -> usize {
        self.positions_m.len()
    }

    /// 1/σ_o² and 1/σ_t².
    pub fn precisions(&self) -> (f64, f64) {
        (self.observation_weight, self.topology_weight)
    }

    /// z relative to the mean of all, m.
    pub fn positions_m(&self) -> &[[f64; 2]] {
        &self.positions_m
    }

    /// M of detection i, an upper triangle with C⁻¹ = MᵀM, m⁻¹.
    pub fn whitening(&self, i: u32) -> [f64; 3] {
        self.whitening[i as usize]
    }

    /// ½ ln det C of detection i.
    pub fn ln_root_determinant(&self, i: u32) -> f64 {
        self.ln_root_determinant[i as usize]
    }

    /// C of detection i, m².
    pub fn covariance_m2(&self, i: u32) -> Covariance {
        self.covariances_m2[i as usize]
    }

    /// f of eq. 2, of Mahalanobis distances.
    pub fn penalty(&self) -> &Penalty {
        &self.penalty
    }

    pub(super) fn penalty_mut(&mut self) -> &mut Penalty {
        &mut self.penalty
    }

    /// M of C̄_ij: the penalty looks at |M(x_i − x_j)|.
    pub fn pair_whitening(&self, i: u32, j: u32) -> [f64; 3] {
        whiten(self.mean_covariance(i, j))
    }

    /// An upper bound of the largest eigenvalue of C̄_ij, m²: |x_i − x_j|² is at most that times d².
    pub fn pair_widest_m2(&self, i: usize, j: usize) -> f64 {
        0.5 * (self.widest_m2[i] + self.widest_m2[j])
    }

    /// The largest of all of these, m².
    pub fn widest_m2(&self) -> f64 {
        self.widest_of_all_m2
    }

    fn mean_covariance(&self, i: u32, j: u32) -> Covariance {
        let (a, b) = (
            self.covariances_m2[i as usize],
            self.covariances_m2[j as usize],
        );
        Covariance {
            xx: 0.5 * (a.xx + b.xx),
            xy: 0.5 * (a.xy + b.xy),
            yy: 0.5 * (a.yy + b.yy),
        }
    }

    /// b_ij ≥ 0, nats.
    pub fn bhattacharyya(&self, i: u32, j: u32) -> f64 {
        let (zi, zj) = (self.positions_m[i as usize], self.positions_m[j as usize]);
        let whitened = Vector2::from(apply(
            self.pair_whitening(i, j),
            [zi[0] - zj[0], zi[1] - zj[1]],
        ));
        let own = self.ln_root_determinant(i) + self.ln_root_determinant(j);
        let spread = ln_root(self.pair_whitening(i, j)) - 0.5 * own;
        (0.125 * whitened.norm_squared() + spread).max(0.0)
    }

    /// The sites of a set; `members` in rising order, so that a set has one result whatever the order
    /// in which a sampler stores it.
    pub fn sites(&self, members: &[u32]) -> SetSites {
        let sites: Vec<Site> = members.iter().map(|&i| self.site(i, members)).collect();
        SetSites {
            members: members.to_vec(),
            ln_bound: sites.iter().map(|site| site.ln_bound).sum(),
            sites,
        }
    }

    fn site(&self, i: u32, members: &[u32]) -> Site {
        let weight = |j: u32| {
            if j == i {
                self.observation_weight
            } else {
                self.topology_weight
            }
        };
        let matrix = |m: [f64; 3]| Matrix2::new(m[0], m[1], 0.0, m[2]);
        let own = self.positions_m[i as usize];
        let (mut precision, mut pull) = (Matrix2::zeros(), Vector2::zeros());
        for &j in members {
            let m = matrix(self.whitening[j as usize]);
            let inverse = m.transpose() * m * weight(j);
            let z = self.positions_m[j as usize];
            precision += inverse;
            pull += inverse * Vector2::new(z[0] - own[0], z[1] - own[1]);
        }
        let (axx, axy, ayy) = (precision[(0, 0)], precision[(0, 1)], precision[(1, 1)]);
        let det = axx * ayy - axy * axy;
        let l11 = (ayy / (2.0 * det)).sqrt();
        let factor = [l11, -axy / (2.0 * det) / l11, (0.5 / ayy).sqrt()];
        let lower = Matrix2::new(factor[0], 0.0, factor[1], factor[2]);
        // x_q − z_i = A⁻¹ pull = 2 L Lᵀ pull.
        let middle = lower * (lower.transpose() * pull) * 2.0;
        let mut norms = Vec::new();
        for &j in members.iter().filter(|&&j| j != i) {
            let b = self.bhattacharyya(i, j);
            if b > 0.0 {
                let m = matrix(self.whitening[j as usize]);
                let z = self.positions_m[j as usize];
                norms.push(Norm {
                    weight: 2.0 * b * self.topology_weight,
                    slope: m * lower,
                    offset: m * (middle - Vector2::new(z[0] - own[0], z[1] - own[1])),
                });
            }
        }
        let sum = SumOfNorms { norms };
        let epsilon = sum.minimise();
        let shift = middle + lower * epsilon;
        let optimum_m = [own[0] + shift.x, own[1] + shift.y];
        let energy: f64 = members
            .iter()
            .map(|&j| {
                let z = self.positions_m[j as usize];
                let m = apply(
                    self.whitening[j as usize],
                    [optimum_m[0] - z[0], optimum_m[1] - z[1]],
                );
                let b = if j == i {
                    0.0
                } else {
                    self.bhattacharyya(i, j)
                };
                weight(j) * (m[0].hypot(m[1]) + b).powi(2)
            })
            .sum();
        // π/√det A = 2π det L.
        let ln_peak = libm::log(std::f64::consts::TAU * factor[0]) + libm::log(factor[2]);
        Site::new(
            optimum_m,
            factor,
            [axx, axy, ayy],
            ln_peak - energy,
            &sum,
            &epsilon,
        )
    }

    /// The law of the locations of a set under exp(−E), by quadrature; `members` in rising order.
    pub fn set_law(&self, members: &[u32]) -> SetLaw {
        let exact = self.sites(members).sites.into_iter().map(ExactSite::new);
        let exact: Vec<ExactSite> = exact.collect();
        let n = members.len();
        let mut precision = DMatrix::zeros(2 * n, 2 * n);
        for (k, site) in exact.iter().enumerate() {
            let [axx, axy, ayy] = site.site.precision;
            precision[(2 * k, 2 * k)] = axx;
            precision[(2 * k, 2 * k + 1)] = axy;
            precision[(2 * k + 1, 2 * k)] = axy;
            precision[(2 * k + 1, 2 * k + 1)] = ayy;
        }
        let covariance = |site: &ExactSite| {
            let l = site.site.factor_m;
            [l[0] * l[0], l[0] * l[1], l[1] * l[1] + l[2] * l[2]]
        };
        SetLaw {
            ln_integral: exact
                .iter()
                .map(|site| site.site.ln_bound + site.ln_acceptance)
                .sum(),
            ln_envelope: exact.iter().map(|site| -site.ln_acceptance).collect(),
            mean_m: exact.iter().map(|site| site.site.optimum_m).collect(),
            covariance_m2: exact.iter().map(covariance).collect(),
            precision,
            sites: exact,
        }
    }
}

/// ½ ln det C of C⁻¹ = MᵀM.
fn ln_root(m: [f64; 3]) -> f64 {
    -libm::log(m[0]) - libm::log(m[2])
}

fn whiten(c: Covariance) -> [f64; 3] {
    whitening([c.xx, c.xy, c.yy])
}

fn apply(m: [f64; 3], d: [f64; 2]) -> [f64; 2] {
    [m[0] * d[0] + m[1] * d[1], m[2] * d[1]]
}

/// Most sets remembered at a time.
const MAX_SETS: usize = 50_000;

/// Sites of sets met before. What it gives is a function of the set alone, so forgetting everything
/// when it is full changes no result.
#[derive(Clone, Debug, Default)]
pub struct SiteMemory {
    sets: HashMap<Vec<u32>, Arc<SetSites>>,
    sorted: Vec<u32>,
}

impl SiteMemory {
    /// The sites of a set, members in any order.
    pub fn get(&mut self, model: &CovarianceModel, members: &[u32]) -> Arc<SetSites> {
        self.sorted.clear();
        self.sorted.extend_from_slice(members);
        self.sorted.sort_unstable();
        if let Some(sites) = self.sets.get(&self.sorted) {
            return Arc::clone(sites);
        }
        if self.sets.len() >= MAX_SETS {
            self.sets.clear();
        }
        let sites = Arc::new(model.sites(&self.sorted));
        self.sets.insert(self.sorted.clone(), Arc::clone(&sites));
        sites
    }
}
