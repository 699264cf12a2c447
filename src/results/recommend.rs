//! The cell to use: one that succeeds, amid others that do.
//!
//! A cell's own worlds are few, and among hundreds of cells some succeed on all of them by luck. So
//! cells that did equally well by themselves are told apart by the cells around them:
//!
//! 1. by the mean share of good worlds of its **siblings**, the cells that differ from it only in
//!    settings of the sampler and so have the same posterior: what only one start or one number of
//!    draws finds is fragile;
//! 2. by its **neighbourhood**: its siblings, and the cells one level of one ordered setting away,
//!    with theirs (in a sampled design the 2k nearest points of its k settings). With g good worlds
//!    of n there, its score is the 5 % bound of Clopper & Pearson for g of n. A cell at an edge of
//!    the design has fewer neighbours, so the same share of good worlds supports it less: no
//!    neighbour is made up, and cells inside a good region still come first.
//!
//! Settings without an order, as starts or moves, have no neighbours: a bad start says nothing
//! against settings that are used with another one. If a sweep varies settings of the sampler
//! alone, all cells would be siblings; then each is by itself.

use std::collections::{BTreeSet, HashMap};

use super::{CellResult, Verdict};
use crate::diagnostics::interval::at_least;
use crate::settings::{Section, Value};
use crate::sweep::{Cell, Design, SampledDesign, Sampling, Sweep};

/// The level of the bound that neighbourhoods are compared by.
const LEVEL: f64 = 0.05;

/// The cells next to one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Neighbourhood {
    /// Siblings and neighbours that have an outcome, by their index.
    pub neighbours: Vec<usize>,
    /// Mean share of good worlds of the cell and its siblings.
    pub siblings_good: f64,
    /// Mean share of their worlds on which converged chains found the truth (or converged, where
    /// no truth is known); `None` without neighbours.
    pub good: Option<f64>,
    /// The score: what share of good worlds the cell and its neighbours support at least.
    pub at_least: f64,
}

/// The cell to use.
#[derive(Clone, Debug, PartialEq)]
pub struct Recommended {
    /// The cell, by its index.
    pub cell: usize,
    /// Other cells that did equally well by themselves; their neighbourhoods decided.
    pub n_equal: usize,
    /// Of them, those whose neighbourhoods are as good too; their order decided.
    pub n_tied: usize,
}

/// Good worlds of a cell and worlds that were judged.
fn good(cell: &CellResult) -> (usize, usize) {
    let worlds = &cell.worlds;
    let n_good = worlds.n(Verdict::Recovered) + worlds.n(Verdict::ConvergedTruthUnknown);
    (n_good, worlds.n_judged())
}

/// What a cell did by itself: cells are equal that agree in all of it.
fn own_success(cell: &CellResult) -> [f64; 3] {
    let (n_good, n) = good(cell);
    [
        (n > 0).then(|| n_good as f64 / cell.worlds.n_all().max(1) as f64),
        cell.recovery.map(|rate| rate.rate),
        cell.converged_share(),
    ]
    .map(|value| value.unwrap_or(-1.0))
}

/// The neighbourhood of every cell; empty for designs whose cells have no neighbours.
pub(super) fn neighbourhoods(sweep: &Sweep, cells: &[CellResult]) -> Vec<Neighbourhood> {
    let siblings = siblings(sweep);
    let beside = match &sweep.design {
        Design::Grid(_) | Design::OneAtATime(_) => by_level(sweep),
        Design::Sampled(design) => by_distance(design),
        Design::List(_) => vec![Vec::new(); cells.len()],
    };
    let is_judged = |cell: &usize| good(&cells[*cell]).1 > 0;
    let share = |cell: usize| {
        let (n_good, n) = good(&cells[cell]);
        n_good as f64 / n.max(1) as f64
    };
    let mean = |of: &[usize]| {
        let sum: f64 = of.iter().map(|&cell| share(cell)).sum();
        (!of.is_empty()).then(|| sum / of.len() as f64)
    };
    let of_cell = |cell: usize| {
        let centres = std::iter::once(&cell).chain(&beside[cell]);
        let all: BTreeSet<usize> = centres
            .flat_map(|&at| siblings[at].iter().copied())
            .collect();
        let all: Vec<usize> = all.into_iter().filter(is_judged).collect();
        let own = all.iter().map(|&at| good(&cells[at]));
        let (n_good, n) = own.fold((0, 0), |(g, n), (more_g, more)| (g + more_g, n + more));
        let neighbours: Vec<usize> = all.into_iter().filter(|at| *at != cell).collect();
        let of_siblings = siblings[cell].iter().copied().filter(is_judged);
        Neighbourhood {
            good: mean(&neighbours),
            siblings_good: mean(&of_siblings.collect::<Vec<_>>()).unwrap_or(0.0),
            at_least: if n > 0 {
                at_least(n_good as f64, n as f64, LEVEL)
            } else {
                0.0
            },
            neighbours,
        }
    };
    (0..cells.len()).map(of_cell).collect()
}

/// The cells with the same posterior, each itself included.
fn siblings(sweep: &Sweep) -> Vec<Vec<usize>> {
    let mut by_model: HashMap<String, Vec<usize>> = HashMap::new();
    let model = |cell: &Cell| {
        let settings = &cell.settings;
        settings.canonical_text(|key| key.section != Section::Sampler && key.name != "detections")
    };
    let models: Vec<String> = sweep.cells.iter().map(model).collect();
    for (cell, model) in models.iter().enumerate() {
        by_model.entry(model.clone()).or_default().push(cell);
    }
    if by_model.len() == 1 {
        return (0..models.len()).map(|cell| vec![cell]).collect();
    }
    models.iter().map(|model| by_model[model].clone()).collect()
}

/// One level away in one ordered setting.
fn by_level(sweep: &Sweep) -> Vec<Vec<usize>> {
    let level = |cell: usize, factor: usize| {
        let factor = &sweep.factors[factor];
        let value = sweep.cells[cell].settings.get(factor.key.name);
        let place = factor.levels.iter().position(|level| level == value);
        place.unwrap_or(0)
    };
    let n_factors = sweep.factors.len();
    let is_ordered = |factor: &usize| {
        let mut levels = sweep.factors[*factor].levels.iter();
        !levels.any(|level| matches!(level, Value::Text(_)))
    };
    let is_of_sampler = |factor: usize| sweep.factors[factor].key.section == Section::Sampler;
    let only_sampler = (0..n_factors).all(is_of_sampler);
    let counts = |factor: &usize| is_ordered(factor) && (only_sampler || !is_of_sampler(*factor));
    let ordered: Vec<usize> = (0..n_factors).filter(counts).collect();
    let levels: Vec<Vec<usize>> = (0..sweep.cells.len())
        .map(|cell| (0..n_factors).map(|factor| level(cell, factor)).collect())
        .collect();
    let cells = levels.iter().enumerate();
    let cell_at: HashMap<&[usize], usize> = cells.map(|(cell, at)| (at.as_slice(), cell)).collect();
    let of_cell = |at: &Vec<usize>| {
        let beside = |factor: &usize| {
            let own = at[*factor];
            [own.wrapping_sub(1), own + 1].map(|level| {
                let mut place = at.clone();
                place[*factor] = level;
                cell_at.get(place.as_slice()).copied()
            })
        };
        ordered.iter().flat_map(beside).flatten().collect()
    };
    levels.iter().map(of_cell).collect()
}

/// The nearest points of the unit cube, two for each setting. Designs that vary one setting at a
/// time have their own answers, and no cell to use.
fn by_distance(design: &SampledDesign) -> Vec<Vec<usize>> {
    let points = design.points();
    if !matches!(design.sampling, Sampling::LatinHypercube | Sampling::Sobol) {
        return vec![Vec::new(); points.len()];
    }
    let n = 2 * design.axes.len();
    let of_point = |own: &Vec<f64>| {
        let distance = |other: &Vec<f64>| -> f64 {
            let sides = own.iter().zip(other);
            sides.map(|(a, b)| (a - b) * (a - b)).sum()
        };
        let mut order: Vec<(f64, usize)> = points.iter().map(distance).zip(0..).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        // The nearest of all is the point itself.
        order
            .into_iter()
            .skip(1)
            .take(n)
            .map(|(_, at)| at)
            .collect()
    };
    points.iter().map(of_point).collect()
}

/// Cells from the most to the least successful.
pub(super) fn rank(cells: &[CellResult], around: &[Neighbourhood]) -> Vec<usize> {
    let score = |cell: usize| {
        let [good, recovery, converged] = own_success(&cells[cell]);
        let Neighbourhood {
            siblings_good,
            at_least,
            ..
        } = around[cell];
        let mass = cells[cell].truth_mass.unwrap_or(-1.0);
        [good, recovery, converged, siblings_good, at_least, mass]
    };
    let mut order: Vec<usize> = (0..cells.len()).collect();
    order.sort_by(|&a, &b| {
        let by_score = score(b).partial_cmp(&score(a));
        let by_score = by_score.unwrap_or(std::cmp::Ordering::Equal);
        by_score.then(a.cmp(&b))
    });
    order
}

/// The first of the ranking that is computed correctly and has an outcome.
pub(super) fn recommended(
    sweep: &Sweep,
    cells: &[CellResult],
    around: &[Neighbourhood],
    ranking: &[usize],
) -> Option<Recommended> {
    let is_correct = |cell: &usize| sweep.cells[*cell].settings.faults().is_empty();
    let candidates = || ranking.iter().copied().filter(is_correct);
    let cell = candidates()
        .next()
        .filter(|&cell| good(&cells[cell]).1 > 0)?;
    let equal: Vec<usize> = candidates()
        .filter(|&other| other != cell && own_success(&cells[other]) == own_success(&cells[cell]))
        .collect();
    let score = |cell: usize| [around[cell].siblings_good, around[cell].at_least];
    let is_tied = |other: &&usize| score(**other) == score(cell);
    Some(Recommended {
        cell,
        n_equal: equal.len(),
        n_tied: equal.iter().filter(is_tied).count(),
    })
}
