//! Whether all cores are used: a sweep against a loop that is nothing but arithmetic.

use std::hint::black_box;
use std::process::Command;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use topometric::results::sample::judgement;
use topometric::run::{Journal, Plan, RunOptions, Silent, execute};
use topometric::sweep::Sweep;

use crate::cost::median;

const SWEEP: &str = "\
[data]
noise = 0.8
replicates = 4
[run]
samples = 20000
chains = 2
[design]
kind = \"grid\"
[design.factors]
penalty_radius = [3, 6, 10, 15]
";

/// Seconds of the sweep on so many threads.
fn sweep_seconds(sweep: &Sweep, plan: &mut Plan, n_threads: usize) -> f64 {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let journal = Journal::open(folder.path()).expect("a new journal");
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(n_threads)
        .build()
        .expect("threads");
    let before = Instant::now();
    let stop = AtomicBool::new(false);
    let result = pool.install(|| {
        execute(
            sweep,
            plan,
            &journal,
            &RunOptions::default(),
            (&judgement, &Silent),
            &stop,
        )
    });
    assert_eq!(result.expect("a journal").n_done(), plan.tasks.len());
    before.elapsed().as_secs_f64()
}

/// Seconds of 32 equal tasks of arithmetic on so many threads.
fn loop_seconds(n_threads: usize) -> f64 {
    use rayon::prelude::*;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(n_threads)
        .build()
        .expect("threads");
    let task = |seed: u32| {
        let mut x = black_box(f64::from(seed));
        for _ in 0..20_000_000 {
            x = x * 0.999_999 + 1e-3;
        }
        x
    };
    let before = Instant::now();
    let sum: f64 = pool.install(|| (0..32).into_par_iter().with_max_len(1).map(task).sum());
    black_box(sum);
    before.elapsed().as_secs_f64()
}

/// Threads, then speed-up over threads of the sweep and of the loop, medians of pairs taken in turns.
pub fn efficiency() -> (usize, f64, f64, f64) {
    let n = std::thread::available_parallelism().map_or(1, usize::from);
    let sweep = Sweep::parse(SWEEP, "bench.toml", "bench", None).expect("a good sweep");
    let mut plan = Plan::new(&sweep).expect("a plan");
    let (mut of_sweep, mut of_loop, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..7 {
        let alone = sweep_seconds(&sweep, &mut plan, 1);
        let sweep = alone / sweep_seconds(&sweep, &mut plan, n) / n as f64;
        let arithmetic = loop_seconds(1) / loop_seconds(n) / n as f64;
        of_sweep.push(sweep);
        of_loop.push(arithmetic);
        ratios.push(sweep / arithmetic);
    }
    (
        n,
        median(&mut of_sweep),
        median(&mut of_loop),
        median(&mut ratios),
    )
}

/// Milliseconds of a whole `ptm sample` of one proposal: start-up, first chain, and the end.
pub fn startup_ms() -> f64 {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let csv = folder.path().join("two.csv");
    std::fs::write(&csv, "x,y\n0,0\n1,0\n").expect("a file");
    let mut times: Vec<f64> = (0..21)
        .map(|_| {
            let before = Instant::now();
            let output = Command::new(env!("CARGO_BIN_EXE_ptm"))
                .arg("sample")
                .arg(&csv)
                .args(["--samples", "1", "--chains", "1", "--json", "-"])
                .output()
                .expect("ptm runs");
            assert!(output.status.success());
            before.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    median(&mut times)
}
