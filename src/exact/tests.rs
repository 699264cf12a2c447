use super::bounds::{COARSE, SetPart, ln_meeting, tilt};
use super::*;
use crate::detections::Covariance;
use crate::model::{CovarianceModel, MetricModel, Penalty, PenaltyShape, SetLaw};

fn model(positions_m: &[[f64; 2]], shape: PenaltyShape, height: f64) -> Model {
    let penalty = Penalty {
        shape,
        radius_m: 1.5,
        height,
    };
    MetricModel::new(positions_m, 0.5, 0.6, penalty).into()
}

fn purpose(seed: u64) -> Purpose {
    Purpose::new("exact test", seed)
}

fn part(model: &Model, members: &[u32]) -> SetPart {
    SetPart {
        members: members.to_vec(),
        law: model.set_law(members),
    }
}

const NEAR_M: [[f64; 2]; 5] = [[0.0, 0.0], [0.4, 0.3], [1.4, -0.2], [1.6, 0.5], [0.7, 1.1]];
/// Three clusters 5 m apart: at radius 1.5 m they hardly ever meet.
const APART_M: [[f64; 2]; 6] = [
    [0.0, 0.0],
    [0.6, 0.3],
    [5.0, 0.0],
    [5.4, 0.9],
    [0.0, 5.0],
    [0.7, 5.2],
];

#[test]
fn bounds_lie_above_what_draws_show() {
    for shape in [PenaltyShape::Quadratic, PenaltyShape::Cubic] {
        for (positions_m, height) in [(&APART_M[..], 3.0), (&NEAR_M[..], 8.0), (&NEAR_M[..], 1e6)] {
            let model = model(positions_m, shape, height);
            let parts = [
                part(&model, &[0, 1]),
                part(&model, &[2]),
                part(&model, &[3, 4]),
            ];
            let sets: Vec<(&[u32], &SetLaw)> = parts
                .iter()
                .map(|p| (p.members.as_slice(), &p.law))
                .collect();
            let n_draws = 20_000;
            let mut draws = Draws::new(positions_m.len(), n_draws);
            let mut rng = purpose(1).generator();
            let met = draws
                .ln_weights_among(&model, &sets[..2], &mut rng)
                .iter()
                .filter(|l| **l < 0.0)
                .count() as f64;
            let bound = n_draws as f64 * ln_meeting(&model, &parts[0], &parts[1]).exp();
            // Five standard deviations of a Poisson count at the bound.
            assert!(met <= bound + 5.0 * bound.sqrt(), "{met} {bound}");
            let mut sums = WeightSums::default();
            sums.add(draws.ln_weights_among(&model, &sets, &mut rng));
            let at_most = tilt(&model, &sets, COARSE).expect("a law").ln_at_most;
            assert!(sums.ln_mean() <= at_most + 5.0 * sums.variance().sqrt());
            if height == 1e6 {
                assert!(at_most.is_finite(), "{at_most}");
            }
        }
    }
}

/// Where everything is well within the radius the Gaussian bound is near the truth.
#[test]
fn the_gaussian_bound_is_of_use() {
    let near: Vec<[f64; 2]> = NEAR_M.iter().map(|z| z.map(|v| 0.1 * v)).collect();
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 4.0,
        height: 5.0,
    };
    let model = Model::from(MetricModel::new(&near, 0.5, 0.6, penalty));
    let parts: Vec<SetPart> = (0..5).map(|i| part(&model, &[i])).collect();
    let sets: Vec<(&[u32], &SetLaw)> = parts
        .iter()
        .map(|p| (p.members.as_slice(), &p.law))
        .collect();
    let mut sums = WeightSums::default();
    sums.add(Draws::new(5, 50_000).ln_weights_among(&model, &sets, &mut purpose(1).generator()));
    let at_most = tilt(&model, &sets, COARSE).expect("a law").ln_at_most;
    // Ten pairs of height 5: about e^-46.
    assert!(sums.ln_mean() < -30.0);
    assert!(
        at_most < sums.ln_mean() + 8.0,
        "{at_most} {}",
        sums.ln_mean()
    );
}

/// Sets integrated apart against all sets together: rows within five joint standard errors (203
/// rows), and groups are in fact fewer than partitions.
#[test]
fn integrating_apart_changes_nothing_that_counts() {
    let model = model(&APART_M, PenaltyShape::Quadratic, 4.0);
    let posterior = posterior(
        &model,
        Prior::Uniform,
        &ExactSettings::default(),
        &purpose(2),
    );
    assert!(posterior.error.total() <= 0.002, "{:?}", posterior.error);
    assert!(posterior.error.cuts < 1e-4);
    let plain = enumerate(&model, Prior::Uniform, 40_000, &mut purpose(3).generator());
    let mut distance = 0.0;
    for row in &plain {
        let other = posterior
            .topologies
            .iter()
            .find(|t| t.topology == row.topology);
        let other = other.expect("every partition has a row");
        distance += 0.5 * (row.probability - other.probability).abs();
        if row.probability > 1e-4 {
            let joint = (row.se.powi(2) + other.se.powi(2)).sqrt() + 1e-6;
            assert!((row.ln_unnormalised - other.ln_unnormalised).abs() < 5.0 * joint);
        }
    }
    assert!(distance < 0.01, "{distance}");
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let model = model(&NEAR_M, PenaltyShape::Cubic, 4.0);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads").install(|| {
            let settings = ExactSettings {
                tolerance: 0.01,
                ..ExactSettings::default()
            };
            posterior(&model, Prior::Uniform, &settings, &purpose(4))
        })
    };
    let (one, three) = (with(1), with(3));
    for (a, b) in one.topologies.iter().zip(&three.topologies) {
        assert_eq!(a.topology, b.topology);
        assert_eq!(a.ln_unnormalised.to_bits(), b.ln_unnormalised.to_bits());
        assert_eq!(a.se.to_bits(), b.se.to_bits());
    }
}

/// A height that no draw survives: singletons are certified as negligible by the Gaussian bound, and
/// where nothing is certified the table says that it is not known. Never a NaN.
#[test]
fn heavy_weights_are_said_not_hidden() {
    let settings = ExactSettings {
        tolerance: 0.002,
        max_draws: 2e5,
    };
    for height in [0.0, 100.0, 1e6] {
        for positions_m in [&NEAR_M[..], &[[1.0, 2.0]; 4], &[[3.0, 4.0]]] {
            let model = model(positions_m, PenaltyShape::Quadratic, height);
            let posterior = posterior(&model, Prior::Uniform, &settings, &purpose(5));
            let total: f64 = posterior.topologies.iter().map(|row| row.probability).sum();
            assert!((total - 1.0).abs() < 1e-9);
            for row in &posterior.topologies {
                assert!(row.ln_unnormalised.is_finite() && row.se.is_finite());
                let few = row.effective_draws.is_some_and(|n| n < TRUSTED);
                assert_eq!(row.is_reliable(), !few);
            }
            if height == 0.0 || positions_m.len() == 1 {
                assert_eq!(posterior.n_draws, 0.0);
                assert_eq!(posterior.error.total(), 0.0);
            }
        }
    }
    // Two coincident detections at an enormous height: the pair is the answer, and known.
    let model = model(&[[0.0, 0.0], [0.0, 0.0]], PenaltyShape::Quadratic, 1e6);
    let settings = ExactSettings {
        max_draws: 1e8,
        ..settings
    };
    let posterior = posterior(&model, Prior::Uniform, &settings, &purpose(6));
    // I₀ of the pair is 1/(1 + 2σ_o²/σ_t²); that of the singletons times P(|x_0 − x_1| > D), a Rayleigh
    // law of scale σ_o (each coordinate differs by N(0, 2·σ_o²/2)), up to O(1/H).
    let pair = 1.0 / (1.0 + 2.0 * 0.25 / 0.36);
    let apart = (-1.5_f64 * 1.5 / (2.0 * 0.25)).exp();
    let expected = pair / (pair + apart);
    assert!((posterior.topologies[0].probability - expected).abs() < 0.002);
}

/// Annealed draws estimate what plain draws do, in both models, and without a ladder too; where plain
/// draws can see anything. Five joint standard errors.
#[test]
fn annealed_and_plain_draws_agree() {
    let covariance = |k: usize| Covariance {
        xx: 0.4 + 0.1 * k as f64,
        xy: 0.1,
        yy: 0.7,
    };
    let covariances_m2: Vec<Covariance> = (0..5).map(covariance).collect();
    for shape in [PenaltyShape::Quadratic, PenaltyShape::Cubic] {
        let penalty = Penalty {
            shape,
            radius_m: 1.5,
            height: 6.0,
        };
        let covariance = CovarianceModel::new(&NEAR_M, &covariances_m2, 0.7, 0.8, penalty);
        for model in [
            model(&NEAR_M, shape, 6.0),
            covariance.expect("good covariances").into(),
        ] {
            let parts = [
                part(&model, &[0, 1]),
                part(&model, &[2]),
                part(&model, &[3, 4]),
            ];
            let sets: Vec<(&[u32], &SetLaw)> = parts
                .iter()
                .map(|p| (p.members.as_slice(), &p.law))
                .collect();
            let mut rng = purpose(7).generator();
            let mut plain = WeightSums::default();
            plain.add(Draws::new(5, 400_000).ln_weights_among(&model, &sets, &mut rng));
            let mut walkers = anneal::Walkers::new(&model, &sets, 128).expect("a law");
            let ladder = walkers.ladder(&mut rng);
            assert!(ladder.len() > 2, "{} rungs", ladder.len());
            for ladder in [&ladder[..], &ladder[ladder.len() - 1..]] {
                let mut annealed = WeightSums::default();
                for _ in 0..300 {
                    annealed.add(&[walkers.ln_estimate(ladder, &mut rng)]);
                }
                let joint = (plain.variance() + annealed.variance()).sqrt();
                let apart = annealed.ln_mean() - plain.ln_mean();
                assert!(joint < 0.1, "{joint} {shape} {}", ladder.len());
                assert!(apart.abs() < 5.0 * joint, "{apart} {joint}");
            }
        }
    }
}

/// Two coincident detections, σ_o = 1 m, D = 10 m, H = 100: with r = d²/2 ~ Exp(1) the singletons have
/// E[exp(−Pen)] = ∫₀⁵⁰ e^{−r−100+2r} dr + e^{−50} = 2e^{−50} to within e^{−100}, which no plain draw sees. A
/// prior that favours them by e^{48.5} makes them matter. I₀ of the pair is 1/3.
#[test]
fn what_plain_draws_cannot_integrate_is_annealed() {
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 10.0,
        height: 100.0,
    };
    let model = Model::from(MetricModel::new(&[[1.0, 2.0]; 2], 1.0, 1.0, penalty));
    let concentration = 48.5_f64.exp();
    let prior = Prior::DirichletProcess { concentration };
    for seed in 8..16 {
        let posterior = posterior(&model, prior, &ExactSettings::default(), &purpose(seed));
        assert!(posterior.error.total() <= 0.002, "{:?}", posterior.error);
        assert!(posterior.n_draws < 1e8, "{}", posterior.n_draws);
        let by = |n| {
            let mut rows = posterior.topologies.iter();
            rows.find(|row| row.topology.n_sets() == n).expect("a row")
        };
        let ratio = by(2).ln_unnormalised - by(1).ln_unnormalised;
        let expected = 48.5 + 2.0_f64.ln() - 50.0 + 3.0_f64.ln();
        assert!(by(2).is_reliable() && by(2).se > 0.0);
        let apart = (ratio - expected).abs();
        assert!(apart < 5.0 * by(2).se, "{apart} {}", by(2).se);
    }
}

/// Seven detections within the penalty radius of one another but for one: no Gaussian bound holds, and
/// plain draws see nothing of the topologies that matter.
const CROWDED_M: [[f64; 2]; 7] = [
    [0.049, 0.558],
    [2.447, 0.423],
    [1.111, 0.494],
    [4.874, -1.062],
    [0.081, -0.846],
    [2.060, -0.220],
    [0.266, 0.503],
];

fn crowded() -> Model {
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 3.0,
        height: 10.0,
    };
    MetricModel::new(&CROWDED_M, 1.0, 1.0, penalty).into()
}

/// Two seeds, each to a total variation of 0.03: within 0.06 of one another.
#[test]
fn crowded_detections_are_solved() {
    let table = |seed| {
        let settings = ExactSettings {
            tolerance: 0.03,
            max_draws: 4e8,
        };
        let found = posterior(&crowded(), Prior::Uniform, &settings, &purpose(seed));
        assert_eq!(found.ended, Ended::Reached, "{:?}", found.error);
        found
    };
    let (first, second) = (table(20), table(21));
    let mut distance = 0.0;
    for row in &first.topologies {
        let mut others = second.topologies.iter();
        let other = others.find(|other| other.topology == row.topology);
        distance += 0.5 * (row.probability - other.expect("all partitions").probability).abs();
    }
    assert!(distance < 0.06, "{distance}");
}

/// The forecast stops long before the draws are spent, and a caller is told what it would take.
#[test]
fn what_cannot_be_had_is_given_up_early() {
    let settings = ExactSettings {
        tolerance: 1e-5,
        max_draws: 2e7,
    };
    let found = posterior(&crowded(), Prior::Uniform, &settings, &purpose(22));
    let Ended::OutOfReach { n_draws_needed } = found.ended else {
        panic!("{:?}", found.ended);
    };
    assert!(n_draws_needed > 1.5 * settings.max_draws && found.n_draws < 0.5 * settings.max_draws);
    let budget = Budget {
        tolerance: 1e-5,
        ..Budget::default()
    };
    let refused = affordable(&crowded(), Prior::Uniform, &budget, &purpose(22));
    assert!(matches!(refused, Err(TooExpensive::Draws { .. })));
    let few = Budget {
        max_detections: 6,
        ..budget
    };
    let refused = affordable(&crowded(), Prior::Uniform, &few, &purpose(22));
    assert_eq!(
        refused.err(),
        Some(TooExpensive::Detections { n: 7, most: 6 })
    );
}

/// Easy data are within the default budget, to its tolerance.
#[test]
fn easy_detections_are_affordable() {
    let model = model(&APART_M, PenaltyShape::Quadratic, 4.0);
    let budget = Budget::default();
    let found = affordable(&model, Prior::Uniform, &budget, &purpose(23)).expect("cheap");
    assert!(found.error.total() <= budget.tolerance && found.n_draws <= budget.max_draws);
}
