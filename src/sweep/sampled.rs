//! Designs whose cells are points of the unit cube, one side for each factor.
//!
//! - `latin-hypercube` (McKay, Beckman & Conover, Technometrics 21, 1979): of n points every factor has one in
//!   each nth of its range, in an order of its own.
//! - `sobol`: the first n = 2^k points of Sobol's sequence, each factor's bits turned over by a random mask (a
//!   digital shift), which keeps them even and makes their mean unbiased.
//! - `morris` (Morris, Technometrics 33, 1991): trajectories through a grid of four levels, one factor after
//!   the other moved by two thirds of its range, in random order. k + 1 cells each.
//! - `sobol-indices` (Saltelli et al., Computer Physics Communications 181, 2010): for each of n = 2^k base points
//!   the point A, the point B of the sequence's other dimensions, and A with each factor taken from B.
//!   k + 2 cells each.
//!
//! Each factor's random numbers come from the sweep's seed and its name, so another factor changes none
//! of them, and neither does the order of the file.

use rand::RngExt;
use rand::seq::SliceRandom;

use super::sobol::{MAX_DIMENSIONS, Sobol};
use super::space::Axis;
use crate::rng::{Generator, Purpose};

/// Raised when a release changes which cells a design gives.
const DESIGN_SEMANTICS: &str = "design-1";
/// Levels of Morris' grid, and the steps between them that a factor is moved by: p/2 of p − 1.
const MORRIS_LEVELS: u32 = 4;
const MORRIS_STEPS: u32 = MORRIS_LEVELS / 2;

/// How points are laid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// Latin hypercube.
    LatinHypercube,
    /// Sobol's sequence.
    Sobol,
    /// Morris' trajectories.
    Morris,
    /// Saltelli's design for Sobol's indices.
    SobolIndices,
}

impl Sampling {
    /// All of them.
    pub const ALL: [Self; 4] = [
        Self::LatinHypercube,
        Self::Sobol,
        Self::Morris,
        Self::SobolIndices,
    ];

    /// Its name in a sweep file.
    pub fn name(self) -> &'static str {
        match self {
            Self::LatinHypercube => "latin-hypercube",
            Self::Sobol => "sobol",
            Self::Morris => "morris",
            Self::SobolIndices => "sobol-indices",
        }
    }

    /// The key that says how many: `trajectories` or `points`.
    pub fn amount_name(self) -> &'static str {
        if self == Self::Morris {
            "trajectories"
        } else {
            "points"
        }
    }

    /// Cells for each trajectory or point.
    fn n_each(self, n_factors: usize) -> usize {
        match self {
            Self::LatinHypercube | Self::Sobol => 1,
            Self::Morris => n_factors + 1,
            Self::SobolIndices => n_factors + 2,
        }
    }
}

/// A design of sampled points.
#[derive(Clone, Debug)]
pub struct SampledDesign {
    /// How they are laid.
    pub sampling: Sampling,
    /// The factors, in the order of the table of settings.
    pub axes: Vec<Axis>,
    /// Points, base points or trajectories.
    pub amount: u64,
    /// Seed of the sweep.
    pub seed: u64,
}

impl SampledDesign {
    /// What speaks against it, in one line; nothing if it can be laid.
    pub(super) fn refusal(&self) -> Option<String> {
        let (name, what) = (self.sampling.name(), self.sampling.amount_name());
        let k = self.axes.len();
        if k == 0 {
            return Some(format!(
                "factors: a {name} design got none, expected at least one; name it in [design.factors]"
            ));
        }
        let most = match self.sampling {
            Sampling::LatinHypercube | Sampling::Morris => return None,
            Sampling::Sobol => MAX_DIMENSIONS,
            Sampling::SobolIndices => MAX_DIMENSIONS / 2,
        };
        if k > most {
            return Some(format!(
                "factors: a {name} design got {k}, expected at most {most}; leave some out"
            ));
        }
        (!self.amount.is_power_of_two()).then(|| {
            let above = self.amount.next_power_of_two();
            format!(
                "{what}: got {}, expected a power of two, at which Sobol's points are even; use {} or {above}",
                self.amount,
                above / 2
            )
        })
    }

    /// Number of cells.
    pub(super) fn n_cells(&self) -> u128 {
        u128::from(self.amount) * self.sampling.n_each(self.axes.len()) as u128
    }

    /// Cells for each trajectory or base point, one after another.
    pub fn n_each(&self) -> usize {
        self.sampling.n_each(self.axes.len())
    }

    /// The points, one for each cell, from 0 to 1 along each factor.
    pub fn points(&self) -> Vec<Vec<f64>> {
        match self.sampling {
            Sampling::LatinHypercube => transposed(&self.latin()),
            Sampling::Sobol => transposed(&self.sobol(0, "shift")),
            Sampling::Morris => self.morris(),
            Sampling::SobolIndices => self.saltelli(),
        }
    }

    /// The name of a cell among those of its trajectory or base point; nothing for plain points.
    pub(super) fn label(&self, cell: usize) -> String {
        let (block, place) = (cell / self.n_each() + 1, cell % self.n_each());
        match self.sampling {
            Sampling::LatinHypercube | Sampling::Sobol => String::new(),
            Sampling::Morris => format!("trajectory {block}, point {}", place + 1),
            Sampling::SobolIndices => match place {
                0 => format!("A{block}"),
                1 => format!("B{block}"),
                _ => format!(
                    "A{block} with {} of B{block}",
                    self.axes[place - 2].key.label()
                ),
            },
        }
    }

    fn generator(&self, axis: &Axis, use_of: &str) -> Generator {
        Purpose::new(DESIGN_SEMANTICS, self.seed)
            .text("use", use_of)
            .text("factor", axis.key.name)
            .generator()
    }

    /// By factor, then by point.
    fn latin(&self) -> Vec<Vec<f64>> {
        let n = self.amount as usize;
        let of_axis = |axis: &Axis| {
            let mut rng = self.generator(axis, "latin hypercube");
            let mut strata: Vec<usize> = (0..n).collect();
            strata.shuffle(&mut rng);
            let place = |stratum: usize| (stratum as f64 + rng.random::<f64>()) / n as f64;
            strata.into_iter().map(place).collect()
        };
        self.axes.iter().map(of_axis).collect()
    }

    /// By factor, then by point; the factors take the sequence's dimensions from `first` on.
    fn sobol(&self, first: usize, use_of: &str) -> Vec<Vec<f64>> {
        let of_axis = |(place, axis): (usize, &Axis)| {
            let mask: u32 = self.generator(axis, use_of).random();
            let sequence = Sobol::new(first + place);
            let bits = (0..self.amount as u32).map(|n| sequence.bits(n) ^ mask);
            // The middle of the interval that 32 bits leave open.
            bits.map(|bits| (f64::from(bits) + 0.5) / 4_294_967_296.0)
                .collect()
        };
        self.axes.iter().enumerate().map(of_axis).collect()
    }

    fn saltelli(&self) -> Vec<Vec<f64>> {
        let a = transposed(&self.sobol(0, "shift"));
        let b = transposed(&self.sobol(self.axes.len(), "shift of B"));
        let mut points = Vec::new();
        for (a, b) in a.iter().zip(&b) {
            points.extend([a.clone(), b.clone()]);
            for factor in 0..self.axes.len() {
                let mut mixed = a.clone();
                mixed[factor] = b[factor];
                points.push(mixed);
            }
        }
        points
    }

    fn morris(&self) -> Vec<Vec<f64>> {
        let at = |level: u32| f64::from(level) / f64::from(MORRIS_LEVELS - 1);
        // Where each factor starts, and thereby which way it moves: up from the lower half, down from the upper.
        let starts: Vec<Vec<u32>> = (self.axes.iter())
            .map(|axis| {
                let mut rng = self.generator(axis, "trajectory");
                (0..self.amount)
                    .map(|_| rng.random_range(0..MORRIS_LEVELS))
                    .collect()
            })
            .collect();
        let mut rng = Purpose::new(DESIGN_SEMANTICS, self.seed)
            .text("use", "order of factors")
            .generator();
        let mut points = Vec::new();
        for trajectory in 0..self.amount as usize {
            let mut levels: Vec<u32> = starts.iter().map(|of_axis| of_axis[trajectory]).collect();
            let mut order: Vec<usize> = (0..levels.len()).collect();
            order.shuffle(&mut rng);
            points.push(levels.iter().map(|&level| at(level)).collect());
            for factor in order {
                let level = &mut levels[factor];
                *level = (*level + MORRIS_STEPS) % MORRIS_LEVELS;
                points.push(levels.iter().map(|&level| at(level)).collect());
            }
        }
        points
    }
}

/// By point, then by factor.
fn transposed(by_factor: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = by_factor.first().map_or(0, Vec::len);
    let point = |n: usize| by_factor.iter().map(|of_factor| of_factor[n]).collect();
    (0..n).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::super::space::Spread;
    use super::*;
    use crate::settings::KEYS;

    fn design(sampling: Sampling, amount: u64, names: &[&str]) -> SampledDesign {
        let axis = |name: &&str| Axis {
            key: KEYS.iter().find(|key| key.name == *name).expect("a key"),
            spread: Spread::Range {
                low: 1.0,
                high: 10.0,
                log: false,
            },
        };
        SampledDesign {
            sampling,
            axes: names.iter().map(axis).collect(),
            amount,
            seed: 7,
        }
    }

    const THREE: [&str; 3] = ["sigma_o", "sigma_t", "penalty_radius"];

    #[test]
    fn every_factor_has_one_point_in_each_stratum() {
        for sampling in [Sampling::LatinHypercube, Sampling::Sobol] {
            let points = design(sampling, 32, &THREE).points();
            for factor in 0..3 {
                let mut strata: Vec<usize> =
                    points.iter().map(|p| (p[factor] * 32.0) as usize).collect();
                assert!(
                    strata.windows(2).any(|pair| pair[1] < pair[0]),
                    "in an order of its own"
                );
                strata.sort_unstable();
                assert_eq!(strata, (0..32).collect::<Vec<_>>(), "{sampling:?}");
            }
        }
    }

    #[test]
    fn another_factor_moves_no_point_of_the_others() {
        let two = design(Sampling::LatinHypercube, 16, &THREE[..2]).points();
        let three = design(Sampling::LatinHypercube, 16, &THREE).points();
        assert!(two.iter().zip(&three).all(|(a, b)| a[..] == b[..2]));
    }

    #[test]
    fn a_trajectory_moves_each_factor_once_by_two_thirds() {
        let design = design(Sampling::Morris, 10, &THREE);
        let points = design.points();
        assert_eq!(points.len() as u128, design.n_cells());
        let mut orders = std::collections::HashSet::new();
        for trajectory in points.chunks(4) {
            let moved: Vec<usize> = trajectory
                .windows(2)
                .map(|pair| {
                    let moved: Vec<usize> = (0..3).filter(|&f| pair[0][f] != pair[1][f]).collect();
                    assert_eq!(moved.len(), 1);
                    let step = (pair[0][moved[0]] - pair[1][moved[0]]).abs();
                    assert!((step - 2.0 / 3.0).abs() < 1e-12);
                    moved[0]
                })
                .collect();
            let mut all = moved.clone();
            all.sort_unstable();
            assert_eq!(all, [0, 1, 2]);
            orders.insert(moved);
        }
        assert!(orders.len() > 1, "in random order");
    }

    #[test]
    fn a_base_point_is_mixed_with_its_partner_factor_by_factor() {
        let design = design(Sampling::SobolIndices, 8, &THREE);
        let points = design.points();
        assert_eq!((points.len(), design.n_each()), (40, 5));
        for block in points.chunks(5) {
            let (a, b) = (&block[0], &block[1]);
            for factor in 0..3 {
                for other in 0..3 {
                    let from = if other == factor { b } else { a };
                    assert_eq!(block[2 + factor][other], from[other]);
                    assert_ne!(a[other], b[other]);
                }
            }
        }
        assert_eq!(design.label(7), "A2 with σₒ of B2");
    }

    #[test]
    fn what_cannot_be_laid_is_refused_with_what_would_do() {
        let refusal = |sampling, amount, names: &[&str]| {
            let refusal = design(sampling, amount, names).refusal();
            refusal.unwrap_or_default()
        };
        assert_eq!(
            refusal(Sampling::Sobol, 100, &THREE),
            "points: got 100, expected a power of two, at which Sobol's points are even; use 64 or 128"
        );
        assert_eq!(refusal(Sampling::LatinHypercube, 100, &THREE), "");
        assert!(refusal(Sampling::Morris, 10, &[]).contains("got none"));
    }
}
