//! Rounds of draws until the table is good enough.
//!
//! Draws go to the groups by √(∂TV/∂s_g² · s_g² n_g / cost), the allocation of least cost.

use rayon::prelude::*;

use super::ExactSettings;
use super::error::TableError;
use super::group::Group;
use super::table::{LN_LEVELS, Row, Table};
use super::weights::WeightSums;
use crate::diagnostics::pareto::pareto_k;
use crate::model::{Draws, SetLaw};

/// Draws per call of the kernels; a multiple of every vector width, small enough for the cache.
const BLOCK: usize = 256;
/// Draws of one task at most: what one core does in a few milliseconds.
const CHUNK: usize = 256 * BLOCK;
/// Rows whose weights' tails are fitted, and with how many draws.
const N_FITTED: usize = 20;
const N_FIT_DRAWS: usize = 4096;
/// Share of the tolerance left to cuts, and to what draws cannot show.
const CUT_SHARE: f64 = 0.02;
const UNSEEN_SHARE: f64 = 0.2;

impl Table<'_> {
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
}
