//! Rounds of draws until the table is good enough.
//!
//! Draws go to the groups by √(∂TV/∂s_g² · s_g² n_g / cost), the allocation of least cost.

use std::sync::atomic::Ordering;

use rand::Rng;
use rayon::prelude::*;

use super::anneal::{LEAST_RUNS, N_WALKERS, Walkers, n_evaluations};
use super::error::TableError;
use super::group::{Group, TRUSTED};
use super::table::{LN_LEVELS, Row, Table};
use super::weights::{LogNormal, WeightSums};
use super::{Ended, ExactSettings, Round};
use crate::diagnostics::pareto::pareto_k;
use crate::model::{Draws, SetLaw};
use crate::rng::Generator;

/// Draws per call of the kernels; a multiple of every vector width, small enough for the cache.
const BLOCK: usize = 256;
/// Draws of one task at most: what one core does in a few milliseconds.
const CHUNK: usize = 256 * BLOCK;
/// Rows whose weights' tails are fitted, and with how many draws.
const N_FITTED: usize = 20;
const N_FIT_DRAWS: usize = 4096;
/// Plain draws that are worth less than this share of their number are annealed instead …
const LEAST_EFFECTIVE_SHARE: f64 = 0.005;
/// … once there are so many of them.
const LEAST_PLAIN: f64 = 1024.0;
/// Groups that get more draws in a round because theirs have shown nothing.
const N_UNSEEN_AT_ONCE: usize = 256;
/// What a ladder has at least, for a forecast of what ladders cost.
const FEW_RUNGS: usize = 5;
/// A forecast is believed once this share of the draws is spent …
const EARLY_SHARE: f64 = 0.1;
/// … and if it says that so many times as many as there may be are needed.
const CERTAIN: f64 = 1.5;
/// Share of the tolerance left to cuts, and to what draws cannot show.
const CUT_SHARE: f64 = 0.02;
const UNSEEN_SHARE: f64 = 0.2;

impl Table<'_> {
    /// Draws until the table's error is below the tolerance, the draws are spent, or it is clear that they
    /// will not do; says where it stands then. `None` if it was stopped.
    pub fn integrate(
        &mut self,
        settings: &ExactSettings,
        watch: &mut dyn FnMut(&Round),
    ) -> Option<(TableError, Ended)> {
        for number in 1.. {
            self.pilot();
            if self.is_stopped() {
                return None;
            }
            let (error, shares) = self.evaluate();
            if self.lower_levels(settings.tolerance) {
                continue;
            }
            let n_draws = self.n_draws;
            let n_more = self.n_more(&error, &shares, settings);
            watch(&Round {
                number,
                error,
                n_draws,
                n_draws_needed: n_draws + n_more,
            });
            if error.total() <= settings.tolerance {
                return Some((error, Ended::Reached));
            }
            let n_draws_needed = n_draws + n_more;
            if n_draws >= EARLY_SHARE * settings.max_draws
                && n_draws_needed > CERTAIN * settings.max_draws
            {
                return Some((error, Ended::OutOfReach { n_draws_needed }));
            }
            let wanted = if n_draws < settings.max_draws {
                self.allocate(&error, &shares, settings)
            } else {
                Vec::new()
            };
            if wanted.is_empty() {
                return Some((error, Ended::OutOfDraws { n_draws_needed }));
            }
            let room = CERTAIN * settings.max_draws - n_draws;
            let Some(climbing) = self.fit_ladders(&wanted, room) else {
                return Some((error, Ended::OutOfReach { n_draws_needed }));
            };
            let flat = wanted.into_iter().filter(|(g, _)| !climbing.contains(g));
            let wanted: Vec<(usize, usize)> = flat
                .chain(climbing.iter().map(|&g| (g, LEAST_RUNS)))
                .collect();
            self.draw(&wanted);
        }
        unreachable!("rounds do not end")
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Draws that the table still needs, if errors fall with the square root of each group's draws: what
    /// the least costly allocation takes, and what it takes to trust the groups that matter.
    fn n_more(&self, error: &TableError, shares: &[[f64; 2]], settings: &ExactSettings) -> f64 {
        let goal = settings.tolerance * (0.97 - UNSEEN_SHARE);
        let targets = self.targets(error, shares, goal);
        let more = |g: usize, target: f64| {
            let group = &self.groups[g];
            (target - group.sums.n()).max(0.0) * group.n_evaluations() as f64
        };
        let of_error: f64 = (0..targets.len()).map(|g| more(g, targets[g])).sum();
        let unseen = self.unseen_that_matter(shares, settings.tolerance);
        let of_trust = unseen.into_iter().map(|g| {
            let group = &self.groups[g];
            let share = (TRUSTED / group.effective()).max(1.0);
            // A group that plain draws serve badly is annealed before it needs more of them.
            let share = if group.ladder.is_some() {
                share
            } else {
                share.min(16.0)
            };
            more(g, share * group.sums.n())
        });
        of_error + of_trust.sum::<f64>()
    }

    /// √(share · n / cost) is the number of draws of each group, up to a common factor: so many that the
    /// Monte Carlo error comes down to the goal; zeros if it is there.
    fn targets(&self, error: &TableError, shares: &[[f64; 2]], goal: f64) -> Vec<f64> {
        if error.monte_carlo <= goal {
            return vec![0.0; self.groups.len()];
        }
        let rate = |g: usize| {
            let group = &self.groups[g];
            (shares[g][0] * group.sums.n() / group.cost()).sqrt()
        };
        // With n_g = κ rate_g the shares sum to Σ rate_g · cost_g / κ; now they sum to ½ TV.
        let now: f64 = shares.iter().map(|share| share[0]).sum();
        let wanted = 1.1 * now * (goal / error.monte_carlo).powi(2);
        let cost: f64 = (0..self.groups.len())
            .map(|g| rate(g) * self.groups[g].cost())
            .sum();
        (0..self.groups.len())
            .map(|g| rate(g) * cost / wanted)
            .collect()
    }

    /// The groups whose draws have shown nothing, the worst first, until what is left is within its share
    /// of the tolerance.
    fn unseen_that_matter(&self, shares: &[[f64; 2]], tolerance: f64) -> Vec<usize> {
        let mut unseen: Vec<usize> = (0..shares.len()).filter(|&g| shares[g][1] > 0.0).collect();
        unseen.sort_by(|&a, &b| shares[b][1].total_cmp(&shares[a][1]).then(a.cmp(&b)));
        let mut left: f64 = unseen.iter().map(|&g| shares[g][1]).sum();
        let matters = |&g: &usize| {
            let matters = left > 0.5 * UNSEEN_SHARE * tolerance;
            left -= shares[g][1];
            matters
        };
        unseen.into_iter().take_while(matters).collect()
    }

    /// Turns those of the groups that plain draws serve badly over to annealed ones; which they are.
    /// Their plain draws are forgotten: what decides about a group is no part of its estimate. `None` if
    /// there is no room for the draws that a first look down their ladders takes.
    fn fit_ladders(&mut self, wanted: &[(usize, usize)], room: f64) -> Option<Vec<usize>> {
        let served_badly = |&g: &usize| {
            let group = &self.groups[g];
            group.ladder.is_none()
                && group.sums.n() >= LEAST_PLAIN
                && group.sums.effective() < LEAST_EFFECTIVE_SHARE * group.sums.n()
        };
        let mut climbing: Vec<usize> = (wanted.iter().map(|&(g, _)| g))
            .filter(served_badly)
            .collect();
        let of_a_look = (1 + LEAST_RUNS) * n_evaluations(FEW_RUNGS);
        if (climbing.len() * of_a_look) as f64 > room {
            return None;
        }
        let ladders: Vec<Option<Vec<f64>>> = climbing
            .par_iter()
            .map(|&g| {
                let group = &self.groups[g];
                let mut rng = self.generator(group, "ladder", 0);
                let sets = self.sets_of(group);
                let walkers = Walkers::new(self.model, &sets, N_WALKERS);
                walkers.map(|mut walkers| walkers.ladder(&mut rng))
            })
            .collect();
        for (&g, ladder) in climbing.iter().zip(ladders) {
            let group = &mut self.groups[g];
            let Some(ladder) = ladder else { continue };
            self.n_draws += n_evaluations(ladder.len()) as f64;
            group.ln_plain_upper = group.ln_upper_of_plain();
            group.ladder = Some(ladder);
            group.sums = WeightSums::default();
        }
        climbing.retain(|&g| self.groups[g].ladder.is_some());
        let of_looks = climbing
            .iter()
            .map(|&g| LEAST_RUNS * self.groups[g].n_evaluations());
        (of_looks.sum::<usize>() as f64 <= room).then_some(climbing)
    }

    /// A first block for every group that has none.
    fn pilot(&mut self) {
        let new = self.groups.iter().enumerate();
        let new = new.filter(|(_, group)| group.sums.n() == 0.0 && !group.is_closed_form());
        let wanted: Vec<(usize, usize)> = new.map(|(index, _)| (index, BLOCK)).collect();
        self.draw(&wanted);
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
        let goal = (settings.tolerance * (0.97 - UNSEEN_SHARE)).max(0.25 * error.monte_carlo);
        let mut targets = self.targets(error, shares, goal);
        // Where draws have shown nothing, four times as many; some groups at a time, as what the worst
        // turn out to be decides which of the others matter.
        let unseen = self.unseen_that_matter(shares, settings.tolerance);
        for g in unseen.into_iter().take(N_UNSEEN_AT_ONCE) {
            targets[g] = targets[g].max(4.0 * self.groups[g].sums.n());
        }
        let room = settings.max_draws - self.n_draws;
        let more = |g: usize| (targets[g] - self.groups[g].sums.n()).max(0.0);
        let cost = |g: usize| more(g) * self.groups[g].n_evaluations() as f64;
        let total: f64 = (0..targets.len()).map(cost).sum();
        let scale = (room / total.max(1.0)).min(1.0);
        (0..targets.len())
            .map(|g| (g, (more(g) * scale) as usize))
            .filter(|&(_, n)| n > 0)
            .collect()
    }

    /// Draws so many locations of each of these groups, in parallel. Each chunk has a generator of
    /// its own, named by group and chunk, and the sums are merged in order: the number of threads
    /// changes nothing.
    fn draw(&mut self, wanted: &[(usize, usize)]) {
        let mut tasks = Vec::new();
        for &(index, n_draws) in wanted {
            let group = &mut self.groups[index];
            let unit = if group.ladder.is_some() { 1 } else { BLOCK };
            let chunk = (CHUNK / group.n_evaluations()).div_ceil(unit) * unit;
            let mut left = n_draws.div_ceil(unit) * unit;
            while left > 0 {
                let size = left.min(chunk);
                tasks.push((index, group.n_chunks, size));
                group.n_chunks += 1;
                left -= size;
                self.n_draws += (size * group.n_evaluations()) as f64;
            }
        }
        let n = self.model.n_detections();
        let done: Vec<(usize, WeightSums, LogNormal)> = tasks
            .into_par_iter()
            .map_init(
                || Draws::new(n, BLOCK),
                |draws, (index, chunk, size)| {
                    let group = &self.groups[index];
                    let (mut sums, mut runs) = (WeightSums::default(), LogNormal::default());
                    if self.is_stopped() {
                        return (index, sums, runs);
                    }
                    let mut rng = self.generator(group, "group", chunk);
                    self.each_block(group, draws, size, &mut rng, |weights| {
                        sums.add(weights);
                        if group.ladder.is_some() {
                            weights.iter().for_each(|l| runs.add(*l));
                        }
                    });
                    (index, sums, runs)
                },
            )
            .collect();
        for (index, sums, runs) in done {
            self.groups[index].sums.merge(&sums);
            self.groups[index].runs.merge(&runs);
        }
    }

    /// Draws so many blocks of a group's weights.
    fn each_block(
        &self,
        group: &Group,
        draws: &mut Draws,
        n_weights: usize,
        rng: &mut impl Rng,
        mut each: impl FnMut(&[f64]),
    ) {
        let sets = self.sets_of(group);
        if let Some(ladder) = &group.ladder {
            let walkers = Walkers::new(self.model, &sets, N_WALKERS);
            let mut walkers = walkers.expect("its ladder was fitted");
            for _ in 0..n_weights {
                each(&[walkers.ln_estimate(ladder, rng)]);
            }
            return;
        }
        for _ in 0..n_weights / BLOCK {
            each(draws.ln_weights_among(self.model, &sets, rng));
        }
    }

    fn generator(&self, group: &Group, use_: &str, chunk: u64) -> Generator {
        let purpose = self.purpose.clone();
        let purpose = purpose.text(use_, &format!("{:?}", group.sets));
        purpose.number("chunk", chunk).generator()
    }

    pub(super) fn sets_of(&self, group: &Group) -> Vec<(&[u32], &SetLaw)> {
        let parts = group.sets.iter().map(|&mask| self.part(mask));
        parts
            .map(|part| (part.members.as_slice(), &part.law))
            .collect()
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
            let groups = groups.filter(|group| !group.is_closed_form() && group.ladder.is_none());
            let fits = groups.filter_map(|group| {
                let mut draws = Draws::new(self.model.n_detections(), BLOCK);
                let mut rng = self.generator(group, "tail", 0);
                let mut weights = Vec::with_capacity(N_FIT_DRAWS);
                self.each_block(group, &mut draws, N_FIT_DRAWS, &mut rng, |block| {
                    weights.extend_from_slice(block);
                });
                pareto_k(&weights)
            });
            self.rows[row].pareto_k = fits.reduce(f64::max);
        }
    }
}
