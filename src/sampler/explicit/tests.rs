//! Tests of the moves with explicit locations.

mod balance;
mod cuts;
mod draws;
mod groups;
mod law;

use super::*;
use crate::detections::{Corner, Covariance};
use crate::model::appearance::{Appearance, Confusion};
use crate::model::moments::square_distance;
use crate::model::{CovarianceModel, MetricModel, Penalty, PenaltyShape};
use crate::rng::{Generator, Purpose};
use crate::sampler::{Arithmetic, Estimator, Kernel, SamplerSettings, SplitRule};

/// Six detections that crowd: every set has neighbours within the radius.
const CROWD_M: [[f64; 2]; 6] = [
    [0.0, 0.0],
    [0.4, 0.3],
    [1.4, -0.2],
    [1.6, 0.5],
    [0.7, 1.1],
    [2.1, 1.3],
];

fn penalty(shape: PenaltyShape, radius_m: f64, height: f64) -> Penalty {
    Penalty {
        shape,
        radius_m,
        height,
    }
}

fn crowd(shape: PenaltyShape) -> Model {
    MetricModel::new(&CROWD_M, 0.5, 0.6, penalty(shape, 1.2, 3.0)).into()
}

/// The same of ellipses of several forms and directions.
fn crowd_of_ellipses(shape: PenaltyShape) -> Model {
    ellipses(&CROWD_M, 0.6, penalty(shape, 3.0, 3.0)).into()
}

fn ellipses(positions_m: &[[f64; 2]], size_m2: f64, penalty: Penalty) -> CovarianceModel {
    let covariances_m2: Vec<Covariance> = (0..positions_m.len())
        .map(|i| Covariance {
            xx: size_m2 * (0.4 + 0.4 * (i % 3) as f64),
            xy: 0.15 * size_m2 * ((i % 5) as f64 - 2.0),
            yy: size_m2 * (1.2 - 0.4 * (i % 2) as f64),
        })
        .collect();
    CovarianceModel::new(positions_m, &covariances_m2, 0.9, 2.0, penalty).expect("good covariances")
}

/// Detections over many cells, with sets that lie apart.
fn wide_m() -> Vec<[f64; 2]> {
    (0..40)
        .map(|i| {
            let (landmark, copy) = (f64::from(i / 4), f64::from(i % 4));
            [
                2.0 * (landmark % 4.0) + 0.3 * copy,
                2.2 * (landmark / 4.0).floor() + 0.2 * copy * (copy - 2.0),
            ]
        })
        .collect()
}

/// Of two kinds.
fn kinds() -> Appearance {
    let kinds = (0..40).map(|i| match i % 5 {
        0 => None,
        1 | 2 => Some(Corner::Open),
        _ => Some(Corner::Closed),
    });
    let confusion = Confusion {
        open_as_closed: 0.1,
        closed_as_open: 0.3,
    };
    Appearance::default().with_corner_kinds(confusion, kinds.collect())
}

fn wide(shape: PenaltyShape) -> Model {
    let model = MetricModel::new(&wide_m(), 0.5, 0.6, penalty(shape, 1.1, 4.0));
    model.with_appearance(kinds()).into()
}

fn wide_of_ellipses(shape: PenaltyShape) -> Model {
    let model = ellipses(&wide_m(), 0.15, penalty(shape, 2.0, 4.0));
    model.with_appearance(kinds()).into()
}

fn priors() -> [Prior; 3] {
    [
        Prior::Uniform,
        Prior::Poisson { rate: 2.0 },
        Prior::DirichletProcess { concentration: 0.3 },
    ]
}

/// E of a location beside those of its set, from its definition.
fn energy(model: &Model, i: u32, others: &[u32], x_m: &[[f64; 2]]) -> f64 {
    let (a, g) = model.precisions();
    let (x, z) = (x_m[i as usize], |j: u32| model.positions_m()[j as usize]);
    match model {
        // Each pair counts once.
        Model::Metric(_) => {
            let pairs = others.iter().map(|&j| square_distance(x, x_m[j as usize]));
            a * square_distance(x, z(i)) + 0.5 * g * pairs.sum::<f64>()
        }
        Model::Covariance(model) => {
            let m = |j: u32| {
                let [m0, m1, m2] = model.whitening(j);
                let (dx, dy) = (x[0] - z(j)[0], x[1] - z(j)[1]);
                (m0 * dx + m1 * dy).hypot(m2 * dy)
            };
            let pairs = others
                .iter()
                .map(|&j| (m(j) + model.bhattacharyya(i, j)).powi(2));
            a * m(i).powi(2) + g * pairs.sum::<f64>()
        }
    }
}

/// Pen of a pair in different sets.
fn pays(model: &Model, [i, j]: [u32; 2], x_m: &[[f64; 2]]) -> f64 {
    let Penalty {
        shape,
        radius_m,
        height,
    } = *model.penalty();
    let d = [0, 1].map(|axis| x_m[i as usize][axis] - x_m[j as usize][axis]);
    let [m0, m1, m2] = model.pair_whitening(i, j);
    let u = (m0 * d[0] + m1 * d[1]).hypot(m2 * d[1]) / radius_m;
    if u < 1.0 {
        height * Penalty::share(shape, u * u)
    } else {
        0.0
    }
}

/// ln π(T, X) from its definition, and ln P(O|T).
fn ln_joint(model: &Model, prior: Prior, state: &State) -> f64 {
    let (partition, x_m) = (state.partition(), state.placement().locations_m());
    let n = partition.n_detections();
    let mut sum = prior
        .table(n)
        .ln_prior(partition.sets().iter().map(Vec::len));
    for members in partition.sets() {
        sum += model.appearance().ln_likelihood(members);
        for &i in members {
            let others: Vec<u32> = members.iter().copied().filter(|&j| j != i).collect();
            sum -= energy(model, i, &others, x_m);
        }
    }
    for i in 0..n as u32 {
        for j in 0..i {
            if partition.set_of()[i as usize] != partition.set_of()[j as usize] {
                sum -= pays(model, [i, j], x_m);
            }
        }
    }
    sum
}

fn settings(n_candidates: usize) -> SamplerSettings {
    SamplerSettings {
        moves: MoveMix::default_of(Estimator::Explicit),
        estimator: Estimator::Explicit,
        split: SplitRule::Uniform,
        arithmetic: Arithmetic::Log,
        importance_samples: 1,
        candidates: n_candidates,
        early_rejection: true,
        tempering: None,
        tiles: false,
    }
}

fn start(model: &Model, prior: Prior, labels: &[u32]) -> State {
    let (settings, purpose) = (settings(2), Purpose::new("explicit test", 3));
    let generators = crate::rng::StepGenerators::new(&purpose);
    Kernel::new(model, prior, &settings, generators).init(Partition::from_labels(labels))
}

fn rng(seed: u64) -> Generator {
    Purpose::new("explicit test", seed).generator()
}

/// States as a chain meets them, one for each call.
fn wander(explicit: &mut Explicit, state: &mut State, rng: &mut Generator) {
    let mix = "split-merge=0.1,site=0.4,flip=0.1,slice=0.2,group=0.1,cut=0.1";
    let mix: MoveMix = mix.parse().expect("a good mix");
    for _ in 0..7 {
        explicit.step(&mix, state, rng);
    }
}

/// What is kept of the state is what it would be from scratch.
#[test]
fn what_is_kept_does_not_drift() {
    let models = [
        wide(PenaltyShape::Quadratic),
        wide(PenaltyShape::Cubic),
        wide(PenaltyShape::Cubic),
        wide_of_ellipses(PenaltyShape::Quadratic),
        wide_of_ellipses(PenaltyShape::Cubic),
    ];
    for (model, prior) in models.iter().zip(priors().into_iter().cycle()) {
        let mut explicit = Explicit::new(model, prior, 2);
        let mut state = start(model, prior, &[0; 40]);
        let (mut rng, mix) = (rng(1), MoveMix::default_of(Estimator::Explicit));
        let mut n_moves = 0;
        for step in 0..30_000 {
            let before = state.partition.hash();
            let ln_target = state.ln_target();
            let info = explicit.step(&mix, &mut state, &mut rng);
            let changed = state.partition.hash() != before;
            assert_eq!(changed, info.n_new_sets > 0, "{info:?}");
            assert!(changed || state.ln_target().to_bits() == ln_target.to_bits());
            n_moves += u64::from(changed);
            if step % 101 == 0 {
                check(&mut explicit, model, prior, &state);
            }
        }
        assert!(n_moves > 1000, "{n_moves}");
    }
}

fn check(explicit: &mut Explicit, model: &Model, prior: Prior, state: &State) {
    let (partition, placement) = (&state.partition, state.placement());
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9 * (1.0 + a.abs()), "{a} {b}");
    let bounds = partition
        .sets()
        .iter()
        .map(|members| explicit.ln_bound(members));
    near(bounds.sum(), state.ln_bound);
    let ln_prior = prior.table(partition.n_detections());
    near(
        ln_prior.ln_prior(partition.sets().iter().map(Vec::len)),
        state.ln_prior,
    );
    let mut total = 0.0;
    for (set_ix, members) in partition.sets().iter().enumerate() {
        let sums = &placement.sums[set_ix];
        let z = crate::model::moments::Moments::of(members.iter().map(|&i| explicit.laws.z_m(i)));
        let at = members.iter().map(|&i| placement.x_m[i as usize]);
        let x = crate::model::moments::Moments::of(at);
        near(sums.x.scatter_m2, x.scatter_m2);
        near(sums.x.mean_m[0], x.mean_m[0]);
        assert_eq!(sums.z, z);
        assert_eq!(sums.tally, model.appearance().tally(members));
        let scores = explicit
            .laws
            .leaving(members.iter().copied(), sums, |i, score| {
                near(score, placement.leaving_of(i, members.len()));
            });
        near(scores, placement.leaving_of_set(set_ix as u32));
        total += scores;
        for (roster, size) in [(&placement.pairs, 2), (&placement.triples, 3)] {
            let listed = roster.list().contains(&(set_ix as u32));
            assert_eq!(listed, members.len() == size);
        }
    }
    near(total, placement.total_leaving());
    // The penalty by cells against all pairs.
    let n = partition.n_detections() as u32;
    for i in 0..n {
        let set_of = partition.set_of();
        let got = explicit.penalty_outside(state, i, placement.x_m[i as usize]);
        let others = (0..n).filter(|&j| set_of[j as usize] != set_of[i as usize]);
        let pairs = others.map(|j| pays(model, [i, j], &placement.x_m));
        near(got, pairs.sum());
    }
}
