//! The table of all partitions, cut into groups of sets.
//!
//! Two sets that cannot meet contribute factors to E[exp(−Pen)]. Every partition is therefore cut
//! into *groups*, the components of the graph whose edges are pairs of sets whose bound on meeting
//! ([`bounds`](super::bounds)) exceeds a level; a group's expectation is estimated once and shared by
//! every partition that holds it. What a cut neglects is bounded and counted.
//!
//! Where the table stands is said by [`error`](super::error), what is drawn next by
//! [`rounds`](super::rounds).

use std::collections::HashMap;
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;

use super::bounds::{SetPart, ln_meeting};
use super::group::Group;
use super::weights::{LogNormal, WeightSums};
use crate::model::Model;
use crate::model::prior::PriorTable;
use crate::partition::Topology;
use crate::rng::Purpose;

/// ln of the levels from which two sets may meet. A row that the cuts could matter to goes down the
/// list; at the last level nothing is cut.
pub(super) const LN_LEVELS: [f64; 5] = [-22.0, -45.0, -100.0, -250.0, f64::NEG_INFINITY];

/// One partition.
pub struct Row {
    /// Its topology.
    pub topology: Topology,
    /// ln P(T) + Σ ln ∫exp(−E).
    pub(super) ln_closed: f64,
    /// Indices of its groups.
    pub(super) groups: Vec<u32>,
    /// Which of [`LN_LEVELS`] its groups were made at.
    pub(super) level: usize,
    /// Bound on the probability that sets of different groups meet.
    pub(super) cut: f64,
    /// Posterior probability.
    pub probability: f64,
    /// ln P(T) + ln ∫exp(−E−Pen).
    pub ln_unnormalised: f64,
    /// Its standard error.
    pub se: f64,
    /// Least effective number of draws of its groups; `None` if all is closed form.
    pub effective_draws: Option<f64>,
    /// Largest Pareto k̂ of its groups' weights, for the likeliest rows.
    pub pareto_k: Option<f64>,
}

/// Everything that is being integrated.
pub struct Table<'a> {
    pub(super) model: &'a Model,
    pub(super) parts: Vec<Option<SetPart>>,
    pub rows: Vec<Row>,
    pub(super) groups: Vec<Group>,
    pub(super) group_of: HashMap<Vec<u16>, u32>,
    pub(super) purpose: &'a Purpose,
    /// Ends the draws once it is set; the table is of no use then.
    pub(super) stop: &'a AtomicBool,
    /// Draws of locations so far, over all groups.
    pub n_draws: f64,
}

impl<'a> Table<'a> {
    /// All partitions, cut at the first level, with no draw yet.
    pub fn new(
        model: &'a Model,
        prior: &PriorTable,
        (purpose, stop): (&'a Purpose, &'a AtomicBool),
    ) -> Self {
        let n = model.n_detections();
        let parts: Vec<Option<SetPart>> = (0..1_u32 << n)
            .into_par_iter()
            .map(|mask| {
                let members: Vec<u32> = (0..n as u32).filter(|i| mask >> i & 1 == 1).collect();
                (mask > 0).then(|| SetPart {
                    law: model.set_law(&members),
                    members,
                })
            })
            .collect();
        let mut table = Self {
            model,
            parts,
            rows: Vec::new(),
            groups: Vec::new(),
            group_of: HashMap::new(),
            purpose,
            stop,
            n_draws: 0.0,
        };
        for topology in crate::partition::Partitions::of(n) {
            let sets = masks(&topology);
            let sizes = sets.iter().map(|mask| mask.count_ones() as usize);
            let ln_integral: f64 = sets
                .iter()
                .map(|&mask| table.part(mask).law.ln_integral)
                .sum();
            table.rows.push(Row {
                ln_closed: prior.ln_prior(sizes) + ln_integral,
                topology,
                groups: Vec::new(),
                level: 0,
                cut: 0.0,
                probability: 0.0,
                ln_unnormalised: f64::NEG_INFINITY,
                se: 0.0,
                effective_draws: None,
                pareto_k: None,
            });
        }
        let all: Vec<usize> = (0..table.rows.len()).collect();
        table.cut_at(&all, 0);
        table
    }

    pub(super) fn part(&self, mask: u16) -> &SetPart {
        self.parts[mask as usize]
            .as_ref()
            .expect("every set but the empty one has a part")
    }

    /// Cuts these rows into groups at a level.
    pub(super) fn cut_at(&mut self, rows: &[usize], level: usize) {
        let cuts: Vec<(Vec<Vec<u16>>, f64)> = rows
            .par_iter()
            .map(|&row| self.components(&masks(&self.rows[row].topology), LN_LEVELS[level]))
            .collect();
        for (&row_ix, (components, cut)) in rows.iter().zip(cuts) {
            let mut groups = Vec::with_capacity(components.len());
            for sets in components {
                let next = self.groups.len() as u32;
                let index = *self.group_of.entry(sets.clone()).or_insert(next);
                if index == next {
                    self.groups.push(Group {
                        size: sets.iter().map(|mask| mask.count_ones() as usize).sum(),
                        sets,
                        sums: WeightSums::default(),
                        n_chunks: 0,
                        ladder: None,
                        runs: LogNormal::default(),
                        ln_plain_upper: 0.0,
                        ln_at_most: None,
                    });
                }
                groups.push(index);
            }
            let row = &mut self.rows[row_ix];
            (row.groups, row.level, row.cut) = (groups, level, cut);
        }
    }

    /// Components of the sets under "may meet", each in rising order, and the bound on what is cut.
    fn components(&self, sets: &[u16], ln_level: f64) -> (Vec<Vec<u16>>, f64) {
        let mut component_of: Vec<usize> = (0..sets.len()).collect();
        let mut bounds = Vec::new();
        if self.model.penalty().height > 0.0 {
            for a in 0..sets.len() {
                for b in a + 1..sets.len() {
                    let bound = ln_meeting(self.model, self.part(sets[a]), self.part(sets[b]));
                    bounds.push((a, b, bound));
                    if bound > ln_level {
                        let (from, to) = (component_of[b], component_of[a]);
                        for component in &mut component_of {
                            if *component == from {
                                *component = to;
                            }
                        }
                    }
                }
            }
        }
        let apart = bounds
            .iter()
            .filter(|(a, b, _)| component_of[*a] != component_of[*b]);
        let cut: f64 = apart.map(|(_, _, bound)| libm::exp(*bound)).sum();
        let components = (0..sets.len())
            .map(|c| {
                let inside = (0..sets.len()).filter(|&a| component_of[a] == c);
                let mut group: Vec<u16> = inside.map(|a| sets[a]).collect();
                group.sort_unstable();
                group
            })
            .filter(|group| !group.is_empty())
            .collect();
        (components, cut)
    }
}

/// The sets of a topology as bits, in the order of their labels.
fn masks(topology: &Topology) -> Vec<u16> {
    let mut sets = vec![0_u16; topology.n_sets()];
    for (i, &label) in topology.labels().iter().enumerate() {
        sets[label as usize] |= 1 << i;
    }
    sets
}
