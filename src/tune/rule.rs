//! From noise and revisits to σ_o, σ_t, D and H: which pairs the model shall merge.
//!
//! The model merges detection and set where that costs less than keeping them apart. For a detection at
//! distance d from the mean of n − 1 others, in closed form (`docs/model.md`; r = σ_o²/σ_t²):
//!
//! - together: k = ((n−1)/n)·d²/(σ_t²/n + σ_o²) + Δ, Δ = (n−1)·ln(1+n·r) − (n−2)·ln(1+(n−1)·r)
//! - apart: the cheaper of paying (n−1)·f(d), and of moving out of the radius, ((n−1)/n)·(D−d)²/σ_o²
//!
//! So the rule: σ_o = 0.4·s and σ_t = 0.8·s. The distance d of a pair up to which it is to be merged lies
//! between two bounds: 4.3·s, within which 99 % of pairs of one landmark lie (|z_i−z_j|² ~ 4s²·Exp(1)), and 0.7 times
//! the distance a that 99 % of the detections seen at once exceed. If 0.7·a is the larger, d is the geometric mean of
//! the two; if not, landmarks are too near for their noise, and d is 0.7·a but no less than 3·s (90 % of pairs), with
//! the lower quartile of s; s itself is then taken to be d/3 at most. Without a, d = 4.3·s. For a mean of n − 1 it is
//! √(n/(2(n−1))) times that; D is where moving out costs as much as merging; H is such that paying costs four times as
//! much: then the radius decides, and chains still mix.
//!
//! The factors 0.4, 0.8, 0.7 and 4 were chosen on 60 simulated worlds of the square ring at noise 1 and 2 and on the
//! Freiburg simulation; 99 % and 90 % are round numbers.

/// σ_o in units of s.
pub const SIGMA_O: f64 = 0.4;
/// σ_t in units of s.
pub const SIGMA_T: f64 = 0.8;
/// The pair distance within which 99 % of pairs of one landmark lie, in units of s: √(4·ln 100).
pub const FARTHEST: f64 = 4.291_932_052_578_88;
/// That of 90 %: √(4·ln 10).
pub const NEAREST: f64 = 3.034_854_258_770_293;
/// A pair seen at once is this much farther apart than what is still merged.
pub const MARGIN: f64 = 0.7;
/// Paying the penalty costs this many times merging, where the two are to balance.
const STEEPNESS: f64 = 4.0;

/// What the rule needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scene {
    /// s, m: standard deviation per axis of a detection about its landmark.
    pub noise_m: f64,
    /// What s exceeds in three draws of four, m.
    pub least_noise_m: f64,
    /// Detections of a landmark on average.
    pub visits: f64,
    /// The distance that 99 % of pairs seen at once exceed, m; `None` where times are not known.
    pub apart_m: Option<f64>,
}

/// Settings of the metric model.
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

/// Up to which distance a pair is to be merged, m.
pub fn merge_distance_m(scene: &Scene) -> f64 {
    let within_m = FARTHEST * scene.noise_m;
    match scene.apart_m.map(|apart_m| MARGIN * apart_m) {
        None => within_m,
        Some(between_m) if between_m >= within_m => (within_m * between_m).sqrt(),
        Some(between_m) => between_m.max(NEAREST * scene.least_noise_m.min(scene.noise_m)),
    }
}

/// The settings that merge pairs up to a distance, m, of noise s, m, with so many visits.
pub fn settings_for(pair_m: f64, noise_m: f64, visits: f64) -> Tuned {
    let (sigma_o, sigma_t) = (SIGMA_O * noise_m, SIGMA_T * noise_m);
    let n = visits.clamp(2.0, 1000.0);
    let r = (sigma_o / sigma_t).powi(2);
    let d = pair_m * (n / (2.0 * (n - 1.0))).sqrt();
    let ln_volume = (n - 1.0) * libm::log1p(n * r) - (n - 2.0) * libm::log1p((n - 1.0) * r);
    let share = (n - 1.0) / n;
    let together = share * d * d / (sigma_t * sigma_t / n + sigma_o * sigma_o) + ln_volume;
    let penalty_radius = d + sigma_o * (together / share).sqrt();
    let at_d = 1.0 - (d / penalty_radius).powi(2);
    Tuned {
        sigma_o,
        sigma_t,
        penalty_radius,
        penalty_height: STEEPNESS * together / ((n - 1.0) * at_d),
    }
}

/// The rule.
pub fn settings(scene: &Scene) -> Tuned {
    let pair_m = merge_distance_m(scene);
    settings_for(pair_m, scene.noise_m.min(pair_m / NEAREST), scene.visits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{MetricModel, Penalty, PenaltyShape};

    const SCENE: Scene = Scene {
        noise_m: 0.5,
        least_noise_m: 0.4,
        visits: 2.0,
        apart_m: None,
    };

    #[test]
    fn what_is_merged_follows_noise_and_separation() {
        let distance = |apart_m| merge_distance_m(&Scene { apart_m, ..SCENE });
        // 1 − exp(−d²/(4s²)) of pairs are nearer.
        let share = |d: f64| 1.0 - (-d * d / (4.0 * 0.25)).exp();
        assert!((share(distance(None)) - 0.99).abs() < 1e-9);
        // Landmarks nearer than their noise: 90 % of pairs at the least noise.
        assert!((distance(Some(0.1)) - NEAREST * 0.4).abs() < 1e-12);
        assert!((distance(Some(2.5)) - 0.7 * 2.5).abs() < 1e-12);
        let (far, near) = (distance(Some(100.0)), distance(None));
        assert!((far - (near * 70.0).sqrt()).abs() < 1e-9);
        let crowded = settings(&Scene {
            apart_m: Some(0.1),
            ..SCENE
        });
        assert!((crowded.sigma_o - SIGMA_O * 0.4).abs() < 1e-12);
    }

    #[test]
    fn at_the_distance_merging_costs_what_moving_apart_does() {
        for visits in [2.0, 3.0, 6.0] {
            let scene = Scene { visits, ..SCENE };
            let tuned = settings(&scene);
            let n = visits as usize;
            let d = merge_distance_m(&scene) * (visits / (2.0 * (visits - 1.0))).sqrt();
            // n − 1 detections at one place, one at the distance d.
            let mut z = vec![[0.0, 0.0]; n - 1];
            z.push([d, 0.0]);
            let penalty = Penalty {
                shape: PenaltyShape::Quadratic,
                radius_m: tuned.penalty_radius,
                height: tuned.penalty_height,
            };
            let model = MetricModel::new(&z, tuned.sigma_o, tuned.sigma_t, penalty);
            let all: Vec<u32> = (0..n as u32).collect();
            let together = model.ln_gaussian(&all[..n - 1]) - model.ln_gaussian(&all);
            // Springs: one of stiffness 1/σ_o² against n − 1 of them.
            let way = tuned.penalty_radius - d;
            let apart = way * way / (tuned.sigma_o.powi(2) * (1.0 + 1.0 / (visits - 1.0)));
            assert!(
                (together - apart).abs() < 1e-9 * together,
                "{together} {apart}"
            );
            let u2 = (d / tuned.penalty_radius).powi(2);
            let paid = (visits - 1.0) * tuned.penalty_height * Penalty::share(penalty.shape, u2);
            assert!((paid / together - STEEPNESS).abs() < 1e-9);
        }
    }

    #[test]
    fn all_lengths_scale() {
        let scaled = Scene {
            noise_m: 5.0,
            least_noise_m: 4.0,
            ..SCENE
        };
        let (a, b) = (settings(&SCENE), settings(&scaled));
        assert!((b.penalty_radius / a.penalty_radius - 10.0).abs() < 1e-9);
        assert!((b.sigma_t / a.sigma_t - 10.0).abs() < 1e-9);
        assert!((b.penalty_height - a.penalty_height).abs() < 1e-9);
    }
}
