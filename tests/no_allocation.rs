//! A step allocates nothing, but for buffers that once in a while meet a set larger than any before.
//!
//! Alone in its binary: the allocator counts for the whole process.
#![allow(missing_docs, unsafe_code, reason = "an allocator is unsafe to write")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

use topometric::detections::Covariance;
use topometric::model::{CovarianceModel, MetricModel, Model, Penalty, PenaltyShape, Prior};
use topometric::partition::Partition;
use topometric::rng::{Purpose, StepGenerators};
use topometric::sampler::mix::{DEFAULT_EXPLICIT_MOVES, DEFAULT_MOVES};
use topometric::sampler::{Arithmetic, Estimator, Kernel, Outcome, SamplerSettings, SplitRule};

struct Counting;
static N_ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

// SAFETY: every call is handed on to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        N_ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        N_ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Every move, every estimator, both models; the covariance model on eight detections, because `common` and `fresh` allocate for a set
/// that they meet for the first time, which they then remember, and there are 255 sets. The running sums are not rebuilt in the steps that are counted.
#[test]
fn a_step_allocates_nothing() {
    let positions_m: Vec<[f64; 2]> = (0..24_i32)
        .map(|i| [f64::from(i % 6) * 2.5, f64::from(i / 6) * 0.4])
        .collect();
    let penalty = Penalty {
        shape: PenaltyShape::Quadratic,
        radius_m: 3.0,
        height: 6.0,
    };
    // Ellipses of several forms and directions.
    let few = &positions_m[..8];
    let covariances_m2: Vec<Covariance> = (0..8_i32)
        .map(|i| Covariance {
            xx: 0.5 + f64::from(i % 3) * 0.3,
            xy: f64::from(i % 5 - 2) * 0.1,
            yy: 0.8,
        })
        .collect();
    let covariance = CovarianceModel::new(few, &covariances_m2, 1.0, 1.0, penalty);
    let models: [(&str, Model); 2] = [
        (
            "metric",
            MetricModel::new(&positions_m, 1.0, 1.0, penalty).into(),
        ),
        ("covariance", covariance.expect("good covariances").into()),
    ];
    let estimators = [Estimator::Common, Estimator::Fresh, Estimator::Explicit];
    for (name, model) in &models {
        for estimator in estimators {
            steps_of(name, model, estimator);
        }
    }
}

fn steps_of(name: &str, model: &Model, estimator: Estimator) {
    let all = match estimator {
        Estimator::Explicit => DEFAULT_EXPLICIT_MOVES.to_owned(),
        _ => format!("{DEFAULT_MOVES},sequential-allocation=0.1,restricted-gibbs=0.1"),
    };
    let settings = SamplerSettings {
        moves: all.parse().expect("a good mix"),
        estimator,
        split: SplitRule::Uniform,
        arithmetic: Arithmetic::Log,
        importance_samples: 8,
        candidates: 8,
        early_rejection: true,
        tempering: None,
        tiles: false,
    };
    let purpose = Purpose::new("allocation test", 1);
    let generators = StepGenerators::new(&purpose);
    let mut kernel = Kernel::new(model, Prior::Uniform, &settings, generators);
    let mut state = kernel.init(Partition::singletons(model.n_detections()));
    let mut rng = purpose.generator();
    // Working space grows to what the largest move so far needs; sums are rebuilt at multiples of 65,536.
    let (warm, counted) = (6 * 65_536, 60_000);
    for step in 0..warm {
        kernel.step(&mut state, step, &mut rng);
    }
    let before = N_ALLOCATIONS.load(Ordering::Relaxed);
    let mut n_accepted = 0;
    for step in warm..warm + counted {
        let info = kernel.step(&mut state, step, &mut rng);
        n_accepted += u64::from(info.outcome == Outcome::Accepted);
    }
    let n_allocations = N_ALLOCATIONS.load(Ordering::Relaxed) - before;
    // Lists of members are kept and used again; one that held a small set may have to grow for a large one. `fresh`
    // sticks to lucky estimates at this R.
    let (fewest_accepted, most) = match estimator {
        Estimator::Common => (500, 0),
        Estimator::Fresh => (20, counted / 1000),
        // A cell that never held so many locations, a list that never was so long.
        Estimator::Explicit => (500, counted / 1000),
    };
    assert!(
        n_accepted > fewest_accepted,
        "{name}, {estimator}: {n_accepted}"
    );
    assert!(
        n_allocations <= most,
        "{name}, {estimator}: {n_allocations}"
    );
}
