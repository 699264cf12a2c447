//! The table of all partitions while it is being integrated: groups of sets, rounds of draws.
//!
//! Two sets that cannot meet contribute factors to E[exp(−Pen)]. Every partition is therefore cut
//! into *groups*, the components of the graph whose edges are pairs of sets whose bound on meeting
//! ([`bounds`](super::bounds)) exceeds a level; a group's expectation is estimated once and shared by
//! every partition that holds it. What a cut neglects is bounded and counted.
//!
//! **Error of the table.** Let ζ_g be the relative error of group g, of variance s_g², independent
//! over groups, and W_g = Σ_{T∋g} p_T. The error of p_T is p_T Σ_g (1[g∈T] − W_g) ζ_g, of variance
//! p_T² V_T with V_T = Σ_g W_g² s_g² + Σ_{g∈T} (1 − 2W_g) s_g², so that E[TV] ≤ ½ Σ_T p_T √V_T. Added
//! to it are
//!
//! - what the cuts neglect, Σ_T p_T min(1, bound_T / Ê_T);
//! - what draws cannot show: where a group's effective number of draws is below 50, nothing says that
//!   its draws have seen the weights that matter. An unseen event has at 95 % a probability of at most
//!   3/n, so such a group may be as large as min(Ê + 3/n, the Gaussian bound), and a partition of such
//!   groups may be larger than its estimate by that.
//!
//! Draws go to the groups by √(∂TV/∂s_g² · s_g² n_g / cost), the allocation of least cost.

use std::collections::HashMap;

use rayon::prelude::*;

use super::ExactSettings;
use super::bounds::{SetPart, ln_at_most, ln_meeting};
use super::weights::WeightSums;
use crate::diagnostics::pareto::pareto_k;
use crate::model::prior::PriorTable;
use crate::model::{Draws, Model, SetLaw};
use crate::partition::Topology;
use crate::rng::Purpose;

/// Draws per call of the kernels; a multiple of every vector width, small enough for the cache.
const BLOCK: usize = 256;
/// Draws of one task at most: what one core does in a few milliseconds.
const CHUNK: usize = 256 * BLOCK;
/// Below this effective number of draws a standard error is not trusted.
pub const TRUSTED: f64 = 50.0;
/// ln of the levels from which two sets may meet. A row that the cuts could matter to goes down the
/// list; at the last level nothing is cut.
const LN_LEVELS: [f64; 5] = [-22.0, -45.0, -100.0, -250.0, f64::NEG_INFINITY];
/// Rows whose weights' tails are fitted, and with how many draws.
const N_FITTED: usize = 20;
const N_FIT_DRAWS: usize = 4096;
/// Share of the tolerance left to cuts, and to what draws cannot show.
const CUT_SHARE: f64 = 0.02;
const UNSEEN_SHARE: f64 = 0.2;

/// Sets that may meet, with what is known of their E[exp(−Pen)].
struct Group {
    /// Bit i of a set is detection i.
    sets: Vec<u16>,
    /// N members in all.
    size: usize,
    sums: WeightSums,
    /// Chunks drawn so far: numbers the generators.
    n_chunks: u64,
    /// ln of the Gaussian bound, once it was needed.
    ln_at_most: Option<f64>,
}

impl Group {
    fn is_closed_form(&self) -> bool {
        self.sets.len() == 1
    }

    fn is_trusted(&self) -> bool {
        self.is_closed_form() || self.sums.effective() >= TRUSTED
    }

    fn ln_mean(&self) -> f64 {
        if self.is_closed_form() {
            0.0
        } else {
            self.sums.ln_mean()
        }
    }

    fn variance(&self) -> f64 {
        if self.is_closed_form() {
            0.0
        } else {
            self.sums.variance()
        }
    }

    /// ln of what E[exp(−Pen)] may be.
    fn ln_upper(&self) -> f64 {
        if self.is_trusted() {
            return self.ln_mean();
        }
        let unseen = libm::log(libm::exp(self.ln_mean()) + 3.0 / self.sums.n());
        unseen
            .min(self.ln_at_most.unwrap_or(0.0))
            .min(0.0)
            .max(self.ln_mean())
    }
}

/// One partition.
pub struct Row {
    /// Its topology.
    pub topology: Topology,
    /// ln P(T) + Σ ln ∫exp(−E).
    ln_closed: f64,
    /// Indices of its groups.
    groups: Vec<u32>,
    /// Which of [`LN_LEVELS`] its groups were made at.
    level: usize,
    /// Bound on the probability that sets of different groups meet.
    cut: f64,
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

/// Where the table stands.
#[derive(Clone, Copy, Debug, Default)]
pub struct TableError {
    /// ½ Σ p √V.
    pub monte_carlo: f64,
    /// What the cuts neglect.
    pub cuts: f64,
    /// What draws cannot show.
    pub unseen: f64,
}

impl TableError {
    /// Estimated total variation between the table and the posterior.
    pub fn total(&self) -> f64 {
        (self.monte_carlo + self.cuts + self.unseen).min(1.0)
    }
}

/// Everything that is being integrated.
pub struct Table<'a> {
    model: &'a Model,
    parts: Vec<Option<SetPart>>,
    pub rows: Vec<Row>,
    groups: Vec<Group>,
    group_of: HashMap<Vec<u16>, u32>,
    purpose: &'a Purpose,
    /// Draws of locations so far, over all groups.
    pub n_draws: f64,
}

impl<'a> Table<'a> {
    /// All partitions, cut at the first level, with no draw yet.
    pub fn new(model: &'a Model, prior: &PriorTable, purpose: &'a Purpose) -> Self {
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

    fn part(&self, mask: u16) -> &SetPart {
        self.parts[mask as usize]
            .as_ref()
            .expect("every set but the empty one has a part")
    }

    /// Cuts these rows into groups at a level.
    fn cut_at(&mut self, rows: &[usize], level: usize) {
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

    /// Draws until the table's error is below the tolerance or the draws are spent; says where it
    /// stands then.
    pub fn integrate(&mut self, settings: &ExactSettings) -> TableError {
        loop {
            self.pilot();
            let (error, shares) = self.evaluate();
            if self.lower_levels(settings.tolerance) {
                continue;
            }
            if error.total() <= settings.tolerance || self.n_draws >= settings.max_draws {
                return error;
            }
            let wanted = self.allocate(&error, &shares, settings);
            if wanted.is_empty() {
                return error;
            }
            self.draw(&wanted);
        }
    }

    /// A first block for every group that has none.
    fn pilot(&mut self) {
        let new = self.groups.iter().enumerate();
        let new = new.filter(|(_, group)| group.sums.n() == 0.0 && !group.is_closed_form());
        let wanted: Vec<(usize, usize)> = new.map(|(index, _)| (index, BLOCK)).collect();
        self.draw(&wanted);
    }

    /// The tails of the weights behind the likeliest rows, from draws of their own.
    pub fn fit_tails(&mut self) {
        let mut likeliest: Vec<usize> = (0..self.rows.len()).collect();
        likeliest.sort_by(|&a, &b| {
            self.rows[b]
                .probability
                .total_cmp(&self.rows[a].probability)
        });
        likeliest.truncate(N_FITTED);
        for row in likeliest {
            let groups = self.rows[row]
                .groups
                .iter()
                .map(|&g| &self.groups[g as usize]);
            let groups = groups.filter(|group| !group.is_closed_form());
            let fits = groups.filter_map(|group| {
                let mut draws = Draws::new(self.model.n_detections(), N_FIT_DRAWS);
                let weights = self.weights_of(group, "tail", 0, &mut draws, 1, |_| ());
                pareto_k(&weights)
            });
            self.rows[row].pareto_k = fits.reduce(f64::max);
        }
    }

    /// Draws so many blocks of a group's weights; gives the last of them.
    fn weights_of(
        &self,
        group: &Group,
        use_: &str,
        chunk: u64,
        draws: &mut Draws,
        n_blocks: usize,
        mut each: impl FnMut(&[f64]),
    ) -> Vec<f64> {
        let purpose = self
            .purpose
            .clone()
            .text(use_, &format!("{:?}", group.sets));
        let mut rng = purpose.number("chunk", chunk).generator();
        let parts = group.sets.iter().map(|&mask| self.part(mask));
        let sets: Vec<(&[u32], &SetLaw)> = parts
            .map(|part| (part.members.as_slice(), &part.law))
            .collect();
        for _ in 0..n_blocks {
            each(draws.ln_weights_among(self.model, &sets, &mut rng));
        }
        draws.ln_weights().to_vec()
    }

    /// Draws so many locations of each of these groups, in parallel. Each chunk has a generator of
    /// its own, named by group and chunk, and the sums are merged in order: the number of threads
    /// changes nothing.
    fn draw(&mut self, wanted: &[(usize, usize)]) {
        let mut tasks = Vec::new();
        for &(index, n_draws) in wanted {
            let mut left = n_draws.div_ceil(BLOCK) * BLOCK;
            while left > 0 {
                let size = left.min(CHUNK);
                tasks.push((index, self.groups[index].n_chunks, size));
                self.groups[index].n_chunks += 1;
                left -= size;
                self.n_draws += size as f64;
            }
        }
        let n = self.model.n_detections();
        let done: Vec<(usize, WeightSums)> = tasks
            .into_par_iter()
            .map_init(
                || Draws::new(n, BLOCK),
                |draws, (index, chunk, size)| {
                    let mut sums = WeightSums::default();
                    let group = &self.groups[index];
                    self.weights_of(group, "group", chunk, draws, size / BLOCK, |weights| {
                        sums.add(weights);
                    });
                    (index, sums)
                },
            )
            .collect();
        for (index, sums) in done {
            self.groups[index].sums.merge(&sums);
        }
    }

    /// Brings every row up to date; the error of the table, and each group's shares in it: of the
    /// Monte Carlo error (∂/∂s² · s²) and of what draws cannot show.
    fn evaluate(&mut self) -> (TableError, Vec<[f64; 2]>) {
        self.bound_untrusted();
        let Self { rows, groups, .. } = self;
        let of = |row: &Row, value: fn(&Group) -> f64| -> f64 {
            row.groups.iter().map(|&g| value(&groups[g as usize])).sum()
        };
        let mut largest = f64::NEG_INFINITY;
        for row in rows.iter_mut() {
            row.ln_unnormalised = row.ln_closed + of(row, Group::ln_mean);
            row.se = of(row, Group::variance).sqrt();
            let effective = row.groups.iter().map(|&g| &groups[g as usize]);
            let effective = effective.filter(|group| !group.is_closed_form());
            row.effective_draws = effective
                .map(|group| group.sums.effective())
                .reduce(f64::min);
            largest = largest.max(row.ln_unnormalised);
        }
        let total: f64 = rows
            .iter()
            .map(|row| libm::exp(row.ln_unnormalised - largest))
            .sum();
        for row in rows.iter_mut() {
            row.probability = libm::exp(row.ln_unnormalised - largest) / total;
        }

        let mut held = vec![0.0; groups.len()];
        for row in rows.iter() {
            for &g in &row.groups {
                held[g as usize] += row.probability;
            }
        }
        let variances: Vec<f64> = groups.iter().map(Group::variance).collect();
        let common: f64 = held.iter().zip(&variances).map(|(w, v)| w * w * v).sum();
        let mut error = TableError::default();
        let mut shares = vec![[0.0; 2]; groups.len()];
        let mut everywhere = 0.0;
        for row in rows.iter() {
            let own = row.groups.iter().map(|&g| g as usize);
            let own: f64 = own.map(|g| (1.0 - 2.0 * held[g]) * variances[g]).sum();
            let sd = (common + own).max(0.0).sqrt();
            error.monte_carlo += 0.5 * row.probability * sd;
            if sd > 0.0 {
                let slope = 0.25 * row.probability / sd;
                everywhere += slope;
                for &g in &row.groups {
                    let g = g as usize;
                    shares[g][0] += slope * (1.0 - 2.0 * held[g]) * variances[g];
                }
            }
            let neglected = row.cut * libm::exp(row.ln_closed - row.ln_unnormalised);
            error.cuts += row.probability * neglected.min(1.0);
            let more = of(row, Group::ln_upper) + row.ln_closed - row.ln_unnormalised;
            if more > 0.0 {
                let ln_more = row.ln_unnormalised - largest + more;
                let unseen = (libm::exp(ln_more) / total - row.probability).max(0.0);
                error.unseen += unseen;
                for &g in &row.groups {
                    if !groups[g as usize].is_trusted() {
                        shares[g as usize][1] += unseen;
                    }
                }
            }
        }
        for (share, (w, v)) in shares.iter_mut().zip(held.iter().zip(&variances)) {
            share[0] = (share[0] + everywhere * w * w * v).max(0.0);
        }
        (error, shares)
    }

    /// The Gaussian bound for groups whose draws cannot be trusted.
    fn bound_untrusted(&mut self) {
        let wanted: Vec<usize> = (0..self.groups.len())
            .filter(|&g| !self.groups[g].is_trusted() && self.groups[g].ln_at_most.is_none())
            .collect();
        let bounds: Vec<f64> = wanted
            .par_iter()
            .map(|&g| {
                let sets = self.groups[g].sets.iter();
                let parts: Vec<&SetPart> = sets.map(|&mask| self.part(mask)).collect();
                ln_at_most(self.model, &parts)
            })
            .collect();
        for (g, bound) in wanted.into_iter().zip(bounds) {
            self.groups[g].ln_at_most = Some(bound);
        }
    }

    /// Cuts those rows at the next level whose cuts could matter; whether there are any.
    fn lower_levels(&mut self, tolerance: f64) -> bool {
        let mut again = false;
        for level in 1..LN_LEVELS.len() {
            let matters = |row: &Row| {
                let neglected = row.cut * libm::exp(row.ln_closed - row.ln_unnormalised);
                row.level + 1 == level
                    && row.probability > 1e-9
                    && neglected > CUT_SHARE * tolerance
            };
            let rows: Vec<usize> = (0..self.rows.len())
                .filter(|&row| matters(&self.rows[row]))
                .collect();
            if !rows.is_empty() {
                self.cut_at(&rows, level);
                again = true;
                break;
            }
        }
        again
    }

    /// How many more draws each group gets in the next round.
    fn allocate(
        &self,
        error: &TableError,
        shares: &[[f64; 2]],
        settings: &ExactSettings,
    ) -> Vec<(usize, usize)> {
        let mut targets = vec![0.0; self.groups.len()];
        // √(share · n / cost) is the number of draws of each group, up to a common factor.
        let goal = (settings.tolerance * (0.97 - UNSEEN_SHARE)).max(0.25 * error.monte_carlo);
        if error.monte_carlo > goal {
            let rate = |g: usize| {
                let group = &self.groups[g];
                (shares[g][0] * group.sums.n() / group.size as f64).sqrt()
            };
            // With n_g = κ rate_g the shares sum to Σ rate_g · size_g / κ; now they sum to ½ TV.
            let now: f64 = shares.iter().map(|share| share[0]).sum();
            let wanted = 1.1 * now * (goal / error.monte_carlo).powi(2);
            let cost: f64 = (0..self.groups.len())
                .map(|g| rate(g) * self.groups[g].size as f64)
                .sum();
            for (g, target) in targets.iter_mut().enumerate() {
                *target = rate(g) * cost / wanted;
            }
        }
        // Where draws have shown nothing, four times as many, the worst first, until what is left
        // is within its share of the tolerance.
        let mut unseen: Vec<usize> = (0..shares.len()).filter(|&g| shares[g][1] > 0.0).collect();
        unseen.sort_by(|&a, &b| shares[b][1].total_cmp(&shares[a][1]).then(a.cmp(&b)));
        let mut left: f64 = unseen.iter().map(|&g| shares[g][1]).sum();
        for g in unseen {
            if left <= 0.5 * UNSEEN_SHARE * settings.tolerance {
                break;
            }
            left -= shares[g][1];
            targets[g] = targets[g].max(4.0 * self.groups[g].sums.n());
        }
        let room = settings.max_draws - self.n_draws;
        let more = |g: usize| (targets[g] - self.groups[g].sums.n()).max(0.0);
        let total: f64 = (0..targets.len()).map(more).sum();
        let scale = (room / total.max(1.0)).min(1.0);
        (0..targets.len())
            .map(|g| (g, (more(g) * scale) as usize))
            .filter(|&(_, n)| n > 0)
            .collect()
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
