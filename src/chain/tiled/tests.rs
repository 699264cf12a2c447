//! Tests of chains in tiles.

use std::collections::HashMap;

use super::*;
use crate::chain::{Start, TraceRecorder};
use crate::detections::{Corner, Covariance};
use crate::exact::{self, ExactTopology};
use crate::model::appearance::{Appearance, Confusion};
use crate::model::{CovarianceModel, MetricModel, Penalty, PenaltyShape};
use crate::partition::{Partition, Topology};
use crate::sampler::{Arithmetic, Estimator, Outcome, SplitRule, StepInfo};

const EVERY_MOVE: &str = "split-merge=0.1,site=0.3,flip=0.25,slice=0.15,group=0.1,cut=0.1";

fn settings() -> SamplerSettings {
    SamplerSettings {
        moves: EVERY_MOVE.parse().expect("a good mix"),
        estimator: Estimator::Explicit,
        split: SplitRule::Uniform,
        arithmetic: Arithmetic::Log,
        importance_samples: 1,
        candidates: 2,
        early_rejection: true,
        tempering: None,
        tiles: true,
    }
}

fn penalty(radius_m: f64, height: f64) -> Penalty {
    Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m,
        height,
    }
}

/// Six detections that crowd, of two kinds of corners; a tile of 2 m leaves their locations 0.8 m.
fn crowd() -> Model {
    let z = [
        [0.0, 0.0],
        [0.4, 0.3],
        [1.4, -0.2],
        [1.6, 0.5],
        [0.7, 1.1],
        [2.1, 1.3],
    ];
    let confusion = Confusion {
        open_as_closed: 0.1,
        closed_as_open: 0.3,
    };
    let [open, closed] = [Some(Corner::Open), Some(Corner::Closed)];
    let kinds = vec![open, closed, None, open, open, closed];
    let appearance = Appearance::default().with_corner_kinds(confusion, kinds);
    let model = MetricModel::new(&z, 0.5, 0.6, penalty(1.2, 3.0));
    model.with_appearance(appearance).into()
}

/// Ellipses in a row of two groups.
fn ellipses() -> Model {
    let z = [[0.0, 0.0], [0.5, 0.2], [1.6, 0.1], [2.1, -0.2], [2.5, 0.3]];
    let ellipse = |i: usize| Covariance {
        xx: 0.15 + 0.1 * (i % 3) as f64,
        xy: 0.05 * (i % 2) as f64,
        yy: 0.3 - 0.05 * (i % 3) as f64,
    };
    let covariances_m2: Vec<Covariance> = (0..z.len()).map(ellipse).collect();
    CovarianceModel::new(&z, &covariances_m2, 0.9, 2.0, penalty(1.5, 3.0))
        .expect("good covariances")
        .into()
}

/// Forty landmarks in a square, three detections each.
fn square() -> Model {
    let z: Vec<[f64; 2]> = (0..120)
        .map(|i| {
            let (landmark, copy) = (i / 3, f64::from(i % 3));
            let (column, row) = (f64::from(landmark % 7), f64::from(landmark / 7));
            [
                4.0 * column + 0.5 * copy,
                4.0 * row + 0.3 * copy * (copy - 1.5),
            ]
        })
        .collect();
    MetricModel::new(&z, 0.5, 0.6, penalty(1.5, 10.0)).into()
}

/// Hears of a chain that several threads run.
struct Threaded<'a, O> {
    hears: &'a mut O,
    n_threads: usize,
}

impl<O: Observer> Observer for Threaded<'_, O> {
    fn start(&mut self, state: &State) {
        self.hears.start(state);
    }
    fn step(&mut self, step: u64, state: &State, info: &StepInfo) {
        self.hears.step(step, state, info);
    }
    fn n_threads(&self) -> usize {
        self.n_threads
    }
}

/// A chain with tiles of this side, by so many threads, that is saved and read back after each of
/// these numbers of steps.
fn run(
    (model, prior, side_m): (&Model, Prior, f64),
    n_threads: usize,
    lengths: &[u64],
    hears: &mut impl Observer,
) {
    let settings = settings();
    let purpose = Purpose::new("tiles test", 3);
    let tiles = || Tiles::new(model, prior, &settings, &purpose).with_side(side_m);
    let mut threaded = Threaded { hears, n_threads };
    let mut saved: Option<SavedPosition> = None;
    for &n_steps in lengths {
        let origin = match saved.take() {
            None => Origin::Start(&Start::Singletons),
            Some(saved) => Origin::Saved(Box::new(saved)),
        };
        let (mut step, mut stands) = begin(
            &tiles(),
            (model, prior, &settings),
            origin,
            &purpose,
            &mut threaded,
        );
        lead(&tiles(), &mut stands, &mut step, n_steps, &mut threaded);
        let text = serde_json::to_string(&Position {
            step,
            chain: Standing::Tiled(&stands),
        });
        let read = serde_json::from_str(&text.expect("a position"));
        saved = Some(read.expect("the position"));
    }
}

/// How often a chain stands at each topology, and at one of them in a hundred batches.
struct Counts {
    n_steps: u64,
    counts: HashMap<u128, u64>,
    top: u128,
    batches: [u64; 100],
}

impl Observer for Counts {
    fn step(&mut self, step: u64, state: &State, _: &StepInfo) {
        let id = state.partition().hash();
        *self.counts.entry(id).or_default() += 1;
        self.batches[(100 * step / self.n_steps) as usize] += u64::from(id == self.top);
    }
}

impl Counts {
    /// Total variation from the exact posterior, and what that of a correct chain stays below: ½ Σ
    /// √(p(1−p)/ESS) for the mean, 2/√ESS for four standard deviations, with the ESS of one
    /// topology by the batches, and the error of the table.
    fn distance(&self, exact: &[ExactTopology]) -> [f64; 2] {
        let n = self.n_steps as f64;
        let shares = self.batches.map(|count| 100.0 * count as f64 / n);
        let mean = shares.iter().sum::<f64>() / 100.0;
        let of_shares = shares
            .iter()
            .map(|share| (share - mean).powi(2))
            .sum::<f64>();
        let ess = 100.0 * mean * (1.0 - mean) / (of_shares / 100.0);
        let spread = |row: &ExactTopology| (row.probability * (1.0 - row.probability) / ess).sqrt();
        let monte_carlo: f64 = exact.iter().map(|row| row.probability * row.se).sum();
        let bound = exact.iter().map(spread).sum::<f64>() + 4.0 / ess.sqrt() + monte_carlo;
        let apart = |row: &ExactTopology| {
            let count = self.counts.get(&id(&row.topology)).copied().unwrap_or(0);
            (count as f64 / n - row.probability).abs() / 2.0
        };
        [exact.iter().map(apart).sum(), bound / 2.0]
    }
}

fn id(topology: &Topology) -> u128 {
    Partition::from_labels(topology.labels()).hash()
}

const N_STEPS: u64 = 1_500_000;

#[test]
fn tiles_have_the_law_of_enumeration() {
    let priors = [
        Prior::Uniform,
        Prior::DirichletProcess { concentration: 3.0 },
    ];
    for (name, model, side_m) in [("crowd", crowd(), 2.0), ("ellipses", ellipses(), 1.6)] {
        for prior in priors {
            let mut rng = Purpose::new("tiles test", 4).generator();
            let exact = exact::enumerate(&model, prior, 100_000, &mut rng);
            let likelier =
                |a: &&ExactTopology, b: &&ExactTopology| a.probability.total_cmp(&b.probability);
            let top = exact.iter().max_by(likelier).expect("not empty");
            let mut counts = Counts {
                n_steps: N_STEPS,
                counts: HashMap::new(),
                top: id(&top.topology),
                batches: [0; 100],
            };
            run((&model, prior, side_m), 1, &[N_STEPS], &mut counts);
            let [apart, bound] = counts.distance(&exact);
            assert!(bound < 0.1, "{name} {prior}: too short to tell, {bound}");
            assert!(apart < bound, "{name} {prior}: {apart} {bound}");
        }
    }
}

#[test]
fn threads_and_saving_change_no_bit() {
    let model = square();
    let sample = |n_threads: usize, lengths: &[u64]| {
        let mut recorder = TraceRecorder::new(100_000);
        run(
            (&model, Prior::Uniform, 9.0),
            n_threads,
            lengths,
            &mut recorder,
        );
        let trace = recorder.finish();
        let runs = serde_json::to_string(&trace.runs).expect("runs");
        (trace.runs.len(), runs, trace.moves)
    };
    let whole = sample(1, &[10_000]);
    assert!(whole.0 > 200, "{}", whole.0);
    // Within an epoch (of 1,920 steps), at its end, and in the next but one.
    for (n_threads, lengths) in [
        (2, vec![10_000]),
        (5, vec![10_000]),
        (1, vec![700, 1920, 1921, 5000, 10_000]),
        (3, vec![1, 3840, 10_000]),
    ] {
        assert!(
            sample(n_threads, &lengths) == whole,
            "{n_threads} {lengths:?}"
        );
    }
}

/// What is told is one chain: M and ln target are those of the topology, whatever the tile.
#[test]
fn what_is_told_is_one_chain() {
    struct Told<'a> {
        model: &'a Model,
        prior: Prior,
        moved: u32,
    }
    impl Observer for Told<'_> {
        fn step(&mut self, _: u64, state: &State, info: &StepInfo) {
            if info.outcome != Outcome::Accepted || info.n_new_sets == 0 {
                return;
            }
            self.moved += 1;
            let partition = state.partition();
            let mut members: Vec<Vec<u32>> = partition.sets().to_vec();
            members.iter_mut().for_each(|set| set.sort_unstable());
            let bounds: f64 = members
                .iter()
                .map(|set| self.model.set_law(set).ln_integral)
                .sum();
            let sizes = members.iter().map(Vec::len);
            let ln_prior = self.prior.table(partition.n_detections()).ln_prior(sizes);
            let apart = state.ln_target() - (bounds + ln_prior);
            assert!(apart.abs() < 1e-6, "{apart}");
            let labels = partition.set_of();
            assert_eq!(Partition::from_labels(labels).hash(), partition.hash());
        }
    }
    let model = square();
    let prior = Prior::DirichletProcess { concentration: 2.0 };
    let (settings, purpose) = (settings(), Purpose::new("tiles test", 5));
    let tiles = Tiles::new(&model, prior, &settings, &purpose).with_side(9.0);
    let mut told = Told {
        model: &model,
        prior,
        moved: 0,
    };
    let origin = Origin::Start(&Start::Random);
    let (mut step, mut stands) = begin(
        &tiles,
        (&model, prior, &settings),
        origin,
        &purpose,
        &mut told,
    );
    lead(&tiles, &mut stands, &mut step, 9000, &mut told);
    assert!(told.moved > 100, "{}", told.moved);
}
