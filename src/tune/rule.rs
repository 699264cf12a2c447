//! From a distance to σ_o, σ_t, D and H: settings under which pairs up to that distance are merged.
//!
//! Both models merge detection and set where that costs less than keeping them apart. For a detection at
//! distance d from n − 1 others at one place, in closed form (`docs/model.md`; r = σ_o²/σ_t²):
//!
//! - together, metric model: k = ((n−1)/n)·d²/(σ_t²/n + σ_o²) + Δ, Δ = (n−1)·ln(1+n·r) − (n−2)·ln(1+(n−1)·r)
//! - together, covariance model, all covariances alike and d in their unit: every ordered pair pulls over d and
//!   its Bhattacharyya distance too, L = d + d²/8. A site held by a at one end and pulled by g at the other settles
//!   at u = min(d, L·g/(a+g)) and costs a·u² + g·(L−u)². The one has a = 1/σ_o², g = (n−1)/σ_t², each of the
//!   others a = 1/σ_o² + (n−2)/σ_t², g = 1/σ_t²; Δ = n·ln(1+(n−1)·r) − (n−1)·ln(1+(n−2)·r)
//! - apart, both: the cheaper of paying (n−1)·f(d), and of moving out of the radius, ((n−1)/n)·(D−d)²/σ_o²
//!
//! So the rule, s being the noise: σ_o = 0.4·s and σ_t = 0.8·s, and s is taken to be d/3 at most; for the mean of n − 1
//! the distance of a pair is √(n/(2(n−1))) times as large; D is where moving out costs as much as merging; H is such
//! that paying costs four times as much: then the radius decides, and chains still mix.
//!
//! The factors 0.4, 0.8 and 4 were chosen on 60 simulated worlds of the square ring at noise 1 and 2 and on the
//! Freiburg simulation, which is not looked at for the distance.
//!
//! Up to which distance a pair is to be merged is clear where landmarks are: [`clear_distance`]. Elsewhere it has to be
//! weighed: [`expected`](super::expected).

/// σ_o in units of s.
pub const SIGMA_O: f64 = 0.4;
/// σ_t in units of s.
pub const SIGMA_T: f64 = 0.8;
/// The distance within which 90 % of pairs of one landmark lie, in units of s: √(4·ln 10), as |z_i−z_j|² ~ 4s²·Exp(1).
/// Where less is to be merged, s is taken to be smaller, so that σ_o and σ_t stay small beside the radius.
pub const NEAREST: f64 = 3.034_854_258_770_293;
/// The distance within which 99 % of pairs of one landmark lie, in units of s: √(4·ln 100).
pub const FARTHEST: f64 = 4.291_932_052_578_88;
/// A pair seen at once is this much farther apart than what is still merged: chosen on the same worlds.
const MARGIN: f64 = 0.7;
/// Paying the penalty costs this many times merging, where the two are to balance.
const STEEPNESS: f64 = 4.0;

/// Which model the settings are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ModelKind {
    /// Distances in metres.
    Metric,
    /// Distances in standard deviations of the stated covariances.
    Covariance,
}

impl ModelKind {
    /// Its name in settings and flags.
    pub fn name(self) -> &'static str {
        match self {
            Self::Metric => "metric",
            Self::Covariance => "covariance",
        }
    }

    /// The unit of its distances.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Metric => "m",
            Self::Covariance => "sd",
        }
    }
}

/// Settings of a model. Metres are standard deviations in the covariance model.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Tuned {
    /// σ_o, m.
    pub sigma_o: f64,
    /// σ_t, m.
    pub sigma_t: f64,
    /// D, m.
    pub penalty_radius: f64,
    /// H, nats.
    pub penalty_height: f64,
}

impl Tuned {
    /// Each with the name of its setting.
    pub fn named(&self) -> [(&'static str, f64); 4] {
        [
            ("sigma_o", self.sigma_o),
            ("sigma_t", self.sigma_t),
            ("penalty_radius", self.penalty_radius),
            ("penalty_height", self.penalty_height),
        ]
    }
}

/// The distance up to which to merge where 0.7 times the distance a that 99 % of the pairs seen at once exceed lies beyond
/// 4.3·s, within which 99 % of pairs of one landmark lie: the geometric mean of the two. It lies farther out than
/// s alone would have it, as detections do not all err alike: a landmark seen badly is still the only one there. `None`
/// where landmarks are not so far apart.
pub fn clear_distance(noise: f64, apart: f64) -> Option<f64> {
    let (within, between) = (FARTHEST * noise, MARGIN * apart);
    (between >= within).then(|| (within * between).sqrt())
}

/// What merging a detection with n − 1 others at the distance d costs, nats.
fn together(model: ModelKind, n: f64, d: f64, sigma_o: f64, sigma_t: f64) -> f64 {
    let (precision_o, precision_t) = (1.0 / (sigma_o * sigma_o), 1.0 / (sigma_t * sigma_t));
    let r = precision_t / precision_o;
    match model {
        ModelKind::Metric => {
            let ln_volume = (n - 1.0) * libm::log1p(n * r) - (n - 2.0) * libm::log1p((n - 1.0) * r);
            (n - 1.0) / n * d * d / (sigma_t * sigma_t / n + sigma_o * sigma_o) + ln_volume
        }
        ModelKind::Covariance => {
            let length = d + d * d / 8.0;
            let site = |held: f64, pulled: f64| {
                let u = d.min(length * pulled / (held + pulled));
                held * u * u + pulled * (length - u).powi(2)
            };
            let one = site(precision_o, (n - 1.0) * precision_t);
            let other = site(precision_o + (n - 2.0) * precision_t, precision_t);
            let ln_volume = n * libm::log1p((n - 1.0) * r) - (n - 1.0) * libm::log1p((n - 2.0) * r);
            one + (n - 1.0) * other + ln_volume
        }
    }
}

/// The settings that merge pairs up to a distance, of noise s, with so many visits; distance and noise in the
/// unit of the model's distances.
pub fn settings_for(model: ModelKind, pair: f64, noise: f64, visits: f64) -> Tuned {
    let noise = noise.min(pair / NEAREST);
    let (sigma_o, sigma_t) = (SIGMA_O * noise, SIGMA_T * noise);
    let n = visits.clamp(2.0, 1000.0);
    let d = pair * (n / (2.0 * (n - 1.0))).sqrt();
    let together = together(model, n, d, sigma_o, sigma_t);
    let penalty_radius = d + sigma_o * (together * n / (n - 1.0)).sqrt();
    let at_d = 1.0 - (d / penalty_radius).powi(2);
    Tuned {
        sigma_o,
        sigma_t,
        penalty_radius,
        penalty_height: STEEPNESS * together / ((n - 1.0) * at_d),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detections::Covariance;
    use crate::model::{CovarianceModel, Draws, MetricModel, Model, Penalty, PenaltyShape};

    const BOTH: [ModelKind; 2] = [ModelKind::Metric, ModelKind::Covariance];

    /// The model with a covariance of 0.09 m² for all, and the length of its unit, m.
    fn model(kind: ModelKind, z: &[[f64; 2]], tuned: &Tuned, penalty: Penalty) -> Model {
        match kind {
            ModelKind::Metric => MetricModel::new(z, tuned.sigma_o, tuned.sigma_t, penalty).into(),
            ModelKind::Covariance => {
                let c = Covariance {
                    xx: 0.09,
                    xy: 0.0,
                    yy: 0.09,
                };
                let c = vec![c; z.len()];
                let model = CovarianceModel::new(z, &c, tuned.sigma_o, tuned.sigma_t, penalty);
                model.expect("good covariances").into()
            }
        }
    }

    #[test]
    fn at_the_distance_merging_costs_what_moving_apart_does() {
        for kind in BOTH {
            for (visits, pair) in [2.0, 3.0, 6.0]
                .into_iter()
                .flat_map(|v| [(v, 1.2), (v, 2.0), (v, 8.0)])
            {
                let tuned = settings_for(kind, pair, 0.5, visits);
                let n = visits as usize;
                let d = pair * (visits / (2.0 * (visits - 1.0))).sqrt();
                let unit_m = if kind == ModelKind::Metric { 1.0 } else { 0.3 };
                // n − 1 detections at one place, one at the distance d.
                let mut z = vec![[0.0, 0.0]; n - 1];
                z.push([d * unit_m, 0.0]);
                let penalty = Penalty {
                    shape: PenaltyShape::Quadratic,
                    radius_m: tuned.penalty_radius,
                    height: tuned.penalty_height,
                };
                let model = model(kind, &z, &tuned, penalty);
                let all: Vec<u32> = (0..n as u32).collect();
                let mut draws = Draws::new(n, 1);
                let mut ln_bound = |members: &[u32]| draws.ln_bound(&model, members);
                let (heap, lone) = all.split_at(n - 1);
                let together = ln_bound(heap) + ln_bound(lone) - ln_bound(&all);
                // Springs: one of stiffness 1/σ_o² against n − 1 of them.
                let way = tuned.penalty_radius - d;
                let apart = way * way / (tuned.sigma_o.powi(2) * (1.0 + 1.0 / (visits - 1.0)));
                assert!(
                    (together - apart).abs() < 1e-6 * together,
                    "{kind:?} {visits} {pair}: {together} {apart}"
                );
                let u2 = (d / tuned.penalty_radius).powi(2);
                let paid =
                    (visits - 1.0) * tuned.penalty_height * Penalty::share(penalty.shape, u2);
                assert!((paid / together - STEEPNESS).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn what_is_clear_is_merged_up_to_the_mean_of_both_bounds() {
        // 1 − exp(−d²/(4s²)) of pairs are nearer.
        assert!((1.0 - (-FARTHEST * FARTHEST / 4.0).exp() - 0.99).abs() < 1e-12);
        assert!((1.0 - (-NEAREST * NEAREST / 4.0).exp() - 0.9).abs() < 1e-12);
        let found = clear_distance(0.5, 100.0).expect("clear");
        assert!((found - (FARTHEST * 0.5 * 70.0).sqrt()).abs() < 1e-12);
        assert_eq!(clear_distance(0.5, 3.0), None);
        assert!(clear_distance(0.5, 3.1).is_some());
    }

    #[test]
    fn all_lengths_of_the_metric_model_scale() {
        let of = |scale: f64| settings_for(ModelKind::Metric, 2.0 * scale, 0.5 * scale, 2.0);
        let (a, b) = (of(1.0), of(10.0));
        assert!((b.penalty_radius / a.penalty_radius - 10.0).abs() < 1e-9);
        assert!((b.sigma_t / a.sigma_t - 10.0).abs() < 1e-9);
        assert!((b.penalty_height - a.penalty_height).abs() < 1e-9);
    }

    #[test]
    fn where_little_is_to_be_merged_the_noise_is_taken_to_be_small() {
        for kind in BOTH {
            let tuned = settings_for(kind, 0.3, 0.5, 2.0);
            assert!((tuned.sigma_o - SIGMA_O * 0.3 / NEAREST).abs() < 1e-12);
            assert_eq!(settings_for(kind, 3.0, 0.5, 2.0).sigma_o, SIGMA_O * 0.5);
        }
    }
}
