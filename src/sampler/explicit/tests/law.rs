//! A wrong ratio in any move is seen: chains whose acceptance is bent, beside the same chains as
//! they are, against enumeration. (`tests/stationary_law` holds the chains as they are to
//! thresholds of their own.)

use std::collections::HashMap;

use super::*;
use crate::exact::{self, ExactTopology};
use crate::sampler::choices::Choices;

/// Numbers of a generator, with decisions bent: a ratio r counts as r^power, and a slice is
/// `height` times as high.
struct Bent<'a> {
    rng: &'a mut Generator,
    power: f64,
    height: f64,
}

impl Choices for Bent<'_> {
    fn below(&mut self, n: usize) -> usize {
        self.rng.below(n)
    }
    fn coins(&mut self, n: usize) -> u64 {
        self.rng.coins(n)
    }
    fn index(&mut self, probabilities: &[f64]) -> usize {
        self.rng.index(probabilities)
    }
}

impl Random for Bent<'_> {
    fn uniform(&mut self) -> f64 {
        self.rng.uniform()
    }
    fn normals(&mut self) -> [f64; 2] {
        self.rng.normals()
    }
    fn ln_threshold(&mut self) -> f64 {
        self.rng.ln_threshold() / self.power
    }
    fn accepts(&mut self, part: f64, whole: f64) -> bool {
        self.rng.uniform().ln() < self.power * (part / whole).ln()
    }
    fn slice_height(&mut self) -> f64 {
        self.height * self.rng.exponential()
    }
}

/// Total variation of a chain of one move (share 0.7) and `rest`, and what that of a correct one
/// stays below; the move is bent. The bound is that of `tests/stationary_law/statistic.rs`: ½ Σ
/// √(p(1−p)/ESS) for the mean, 2/√ESS for four standard deviations, with the ESS of the likeliest
/// topology by a hundred batch means, and the error of the table.
fn distance(
    model: &Model,
    exact: &[ExactTopology],
    (bent, power, height): (Move, f64, f64),
    rest: &str,
) -> [f64; 2] {
    let (bent, rest) = (
        MoveMix::only(bent),
        rest.parse::<MoveMix>().expect("a good mix"),
    );
    let mut explicit = Explicit::new(model, Prior::Uniform, 2);
    let mut state = start(model, Prior::Uniform, &[0, 1, 2, 3, 4, 5]);
    let (mut rng, n_steps) = (rng(21), 400_000);
    let id = |row: &ExactTopology| Partition::from_labels(row.topology.labels()).hash();
    let by_probability =
        |a: &&ExactTopology, b: &&ExactTopology| a.probability.total_cmp(&b.probability);
    let top = exact.iter().max_by(by_probability).expect("not empty");
    let (top, mut batches) = (id(top), [0.0; 100]);
    let mut counts: HashMap<u128, f64> = HashMap::new();
    for step in 0..n_steps {
        if rng.uniform() < 0.7 {
            let mut random = Bent {
                rng: &mut rng,
                power,
                height,
            };
            explicit.step(&bent, &mut state, &mut random);
        } else {
            explicit.step(&rest, &mut state, &mut rng);
        }
        *counts.entry(state.partition.hash()).or_default() += 1.0 / f64::from(n_steps);
        if state.partition.hash() == top {
            batches[(step / (n_steps / 100)) as usize] += 100.0 / f64::from(n_steps);
        }
    }
    let mean = batches.iter().sum::<f64>() / 100.0;
    let of_means = batches
        .iter()
        .map(|batch| (batch - mean) * (batch - mean))
        .sum::<f64>()
        / 100.0;
    let ess = mean * (1.0 - mean) / of_means * 100.0;
    let spread = |row: &ExactTopology| (row.probability * (1.0 - row.probability) / ess).sqrt();
    let monte_carlo: f64 = exact.iter().map(|row| row.probability * row.se).sum();
    let bound = (exact.iter().map(spread).sum::<f64>() + 4.0 / ess.sqrt() + monte_carlo) / 2.0;
    let apart = |row: &ExactTopology| {
        (counts.get(&id(row)).copied().unwrap_or(0.0) - row.probability).abs() / 2.0
    };
    [exact.iter().map(apart).sum(), bound]
}

#[test]
fn a_wrong_ratio_is_seen_in_every_move() {
    for model in [
        crowd(PenaltyShape::Quadratic),
        crowd_of_ellipses(PenaltyShape::Quadratic),
    ] {
        let exact = exact::enumerate(&model, Prior::Uniform, 100_000, &mut rng(22));
        for (bent, power, height, rest) in [
            (Move::Site, 0.0, 1.0, "site"),
            (Move::Flip, 0.5, 1.0, "site"),
            (Move::Group, 0.4, 1.0, "site=0.5,slice=0.5"),
            (Move::Cut, 0.4, 1.0, "site=0.5,slice=0.5"),
            (Move::SplitMerge, 0.4, 1.0, "site=0.5,slice=0.5"),
            (Move::Slice, 1.0, 3.0, "site"),
        ] {
            let [right, bound] = distance(&model, &exact, (bent, 1.0, 1.0), rest);
            assert!(right < bound && bound < 0.1, "{bent:?}: {right} {bound}");
            let [wrong, bound] = distance(&model, &exact, (bent, power, height), rest);
            assert!(wrong > bound, "{bent:?}: {wrong} {bound}");
        }
    }
}
