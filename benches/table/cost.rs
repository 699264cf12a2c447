//! What a proposal costs, and how much memory a chain takes.

use std::hint::black_box;
use std::process::Command;
use std::time::Instant;

use topometric::chain::{self, Start, TraceRecorder};
use topometric::model::{Model, Penalty, PenaltyShape, Prior};
use topometric::partition::{Partition, Topology};
use topometric::rng::{Generator, Purpose, StepGenerators};
use topometric::sampler::mix::DEFAULT_MOVES;
use topometric::sampler::{Arithmetic, Estimator, Kernel, SamplerSettings, SplitRule, State};

use crate::worlds::{self, World};

pub fn settings(estimator: Estimator, moves: &str, importance_samples: usize) -> SamplerSettings {
    SamplerSettings {
        moves: moves.parse().expect("a good mix"),
        estimator,
        split: SplitRule::Uniform,
        arithmetic: Arithmetic::Log,
        importance_samples,
        candidates: 2,
        early_rejection: true,
        tempering: None,
        tiles: false,
    }
}

/// A chain from the truth that is timed in turns with others.
struct Timed<'a> {
    kernel: Kernel<'a>,
    state: State,
    rng: Generator,
    step: u64,
    per_turn: u64,
    ns: Vec<f64>,
    n_evaluated: u64,
}

impl<'a> Timed<'a> {
    fn new(model: &'a Model, world: &World, settings: &'a SamplerSettings, per_turn: u64) -> Self {
        let purpose = Purpose::new("bench", 1);
        let generators = StepGenerators::new(&purpose);
        let mut kernel = Kernel::new(model, Prior::Uniform, settings, generators);
        let state = kernel.init(Partition::from_labels(&world.landmarks));
        let mut timed = Self {
            kernel,
            state,
            rng: purpose.generator(),
            step: 0,
            per_turn,
            ns: Vec::new(),
            n_evaluated: 0,
        };
        timed.turn();
        (timed.ns, timed.n_evaluated) = (Vec::new(), 0);
        timed
    }

    fn turn(&mut self) {
        let before = Instant::now();
        for _ in 0..self.per_turn {
            let info = self.kernel.step(&mut self.state, self.step, &mut self.rng);
            self.n_evaluated += u64::from(info.evaluated);
            self.step += 1;
        }
        self.ns
            .push(before.elapsed().as_secs_f64() * 1e9 / self.per_turn as f64);
    }

    /// Nanoseconds for each proposal, and the share of them that were evaluated.
    fn result(&mut self) -> (f64, f64) {
        let n = self.per_turn as f64 * self.ns.len() as f64;
        (median(&mut self.ns), self.n_evaluated as f64 / n)
    }
}

pub fn median(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

/// A row of the table: what, N, ns for a proposal, share evaluated.
pub struct Cost {
    pub name: String,
    pub n_detections: usize,
    pub ns: f64,
    pub evaluated: f64,
}

impl Cost {
    pub fn ns_of_evaluated(&self) -> f64 {
        self.ns / self.evaluated
    }
}

pub const SIZES: [usize; 6] = [16, 64, 256, 1024, 4096, 16_384];
/// `fresh` draws everything anew: beyond this it takes milliseconds a proposal.
const MOST_FRESH: usize = 1024;
const N_TURNS: usize = 9;

/// From the truth, two detections of each landmark, R = 8, the default mix.
pub fn by_size() -> Vec<Cost> {
    let worlds: Vec<World> = SIZES.iter().map(|n| worlds::grid(n / 2, 2, 1)).collect();
    let mut costs = Vec::new();
    for estimator in [Estimator::Common, Estimator::Fresh] {
        let settings = settings(estimator, DEFAULT_MOVES, 8);
        for (name, model) in [
            ("metric", worlds::metric as fn(&World) -> Model),
            ("covariance", worlds::covariance),
        ] {
            let models: Vec<Model> = worlds.iter().map(model).collect();
            let mut chains: Vec<(usize, Timed)> = models
                .iter()
                .zip(&worlds)
                .zip(SIZES)
                .filter(|(_, n)| estimator == Estimator::Common || *n <= MOST_FRESH)
                .map(|((model, world), n)| {
                    let per_turn = match estimator {
                        Estimator::Common | Estimator::Explicit => 16_384,
                        Estimator::Fresh => 65_536 / n as u64,
                    };
                    (n, Timed::new(model, world, &settings, per_turn))
                })
                .collect();
            for _ in 0..N_TURNS {
                chains.iter_mut().for_each(|(_, chain)| chain.turn());
            }
            costs.extend(chains.iter_mut().map(|(n, chain)| {
                let (ns, evaluated) = chain.result();
                Cost {
                    name: format!("{estimator}, {name}"),
                    n_detections: *n,
                    ns,
                    evaluated,
                }
            }));
        }
    }
    costs
}

/// The report's sampler against ours at N = 16, R = 30, with the early bounds on and off.
pub fn at_sixteen() -> Vec<(Cost, bool)> {
    let world = worlds::grid(8, 2, 1);
    let model = worlds::metric(&world);
    let variants: Vec<(String, SamplerSettings)> = [
        ("common, default mix", Estimator::Common, DEFAULT_MOVES),
        (
            "common, split-merge",
            Estimator::Common,
            "split-merge=0.8,refresh=0.2",
        ),
        ("fresh, default mix", Estimator::Fresh, DEFAULT_MOVES),
        ("fresh, split-merge", Estimator::Fresh, "split-merge"),
    ]
    .into_iter()
    .flat_map(|(name, estimator, moves)| {
        [true, false].map(|early_rejection| {
            let settings = SamplerSettings {
                early_rejection,
                ..settings(estimator, moves, 30)
            };
            (name.to_owned(), settings)
        })
    })
    .collect();
    let mut chains: Vec<Timed> = variants
        .iter()
        .map(|(_, settings)| Timed::new(&model, &world, settings, 20_000))
        .collect();
    for _ in 0..N_TURNS {
        chains.iter_mut().for_each(Timed::turn);
    }
    let rows = variants.iter().zip(&mut chains);
    rows.map(|((name, settings), chain)| {
        let (ns, evaluated) = chain.result();
        let cost = Cost {
            name: name.clone(),
            n_detections: 16,
            ns,
            evaluated,
        };
        (cost, settings.early_rejection)
    })
    .collect()
}

/// What a pair costs at one draw: two differences, three products and a sum for the scaled square of the distance,
/// 1 − u², its positive part, and the addition to the draw's sum.
pub const PAIR_OPERATIONS: f64 = 9.0;

/// Rows of rooms of the offices.
pub const OFFICES: [usize; 4] = [6, 9, 13, 18];

/// Offices from the truth, R = 8, the default mix, metric model.
pub fn offices() -> Vec<Cost> {
    let settings = settings(Estimator::Common, DEFAULT_MOVES, 8);
    let worlds: Vec<World> = OFFICES.map(worlds::office).into();
    let models: Vec<Model> = worlds.iter().map(worlds::metric).collect();
    let mut chains: Vec<Timed> = models
        .iter()
        .zip(&worlds)
        .map(|(model, world)| Timed::new(model, world, &settings, 16_384))
        .collect();
    for _ in 0..N_TURNS {
        chains.iter_mut().for_each(Timed::turn);
    }
    let rows = OFFICES.iter().zip(&worlds).zip(&mut chains);
    rows.map(|((n_rows, world), chain)| {
        let (ns, evaluated) = chain.result();
        Cost {
            name: format!("{n_rows} × {n_rows} rooms"),
            n_detections: world.landmarks.len(),
            ns,
            evaluated,
        }
    })
    .collect()
}

/// ns for each (pair, draw) of the penalty of 120 pairs at 64 draws.
pub fn pair_kernel_ns() -> f64 {
    const N_DRAWS: usize = 64;
    const N_POINTS: usize = 16;
    const N_ROUNDS: usize = 200;
    let value = |k: usize| ((k * 7919) % 1009) as f64 / 173.0;
    let [x, y] = [0, 1].map(|axis| -> Vec<f64> {
        (0..N_POINTS * N_DRAWS)
            .map(|k| value(2 * k + axis))
            .collect()
    });
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 3.0,
        height: 1.0,
    };
    let mut sums = vec![0.0; N_DRAWS];
    let others: Vec<Vec<u32>> = (0..N_POINTS as u32)
        .map(|i| (i + 1..N_POINTS as u32).collect())
        .collect();
    let n_pairs = N_POINTS * (N_POINTS - 1) / 2;
    let mut times: Vec<f64> = (0..31)
        .map(|_| {
            let before = Instant::now();
            for _ in 0..N_ROUNDS {
                let (x, y) = (black_box(&x), black_box(&y));
                for (i, others) in others.iter().enumerate() {
                    let row = i * N_DRAWS..(i + 1) * N_DRAWS;
                    let first = [&x[row.clone()], &y[row]];
                    penalty.add_pairs(first, others, [x, y], &mut sums);
                }
                black_box(&mut sums);
            }
            before.elapsed().as_secs_f64() * 1e9 / (N_ROUNDS * n_pairs * N_DRAWS) as f64
        })
        .collect();
    median(&mut times)
}

/// Peak memory of a process that runs one chain of a million steps in a world, MB; `None` where the
/// system does not tell.
pub fn peak_memory_mb(world: &str) -> Option<f64> {
    let this = std::env::current_exe().ok()?;
    let output = Command::new(this)
        .args(["--memory-of", world])
        .output()
        .ok()?;
    String::from_utf8(output.stdout).ok()?.trim().parse().ok()
}

/// What the process of [`peak_memory_mb`] does, for `N` detections on the grid or an office of `office:ROWS`; gives
/// megabytes as the system counts them.
pub fn run_for_memory(world: &str) -> Option<f64> {
    let world = match world.strip_prefix("office:") {
        Some(n_rows) => worlds::office(n_rows.parse().ok()?),
        None => worlds::grid(world.parse::<usize>().ok()? / 2, 2, 1),
    };
    let settings = settings(Estimator::Common, DEFAULT_MOVES, 8);
    let mut recorder = TraceRecorder::new(100_000);
    chain::run(
        &worlds::metric(&world),
        Prior::Uniform,
        &settings,
        &Start::At(Topology::canonical(&world.landmarks)),
        1_000_000,
        &Purpose::new("bench", 1),
        &mut recorder,
    );
    black_box(recorder.finish().sums(0));
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM"))?;
    let kb: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kb / 1024.0)
}
