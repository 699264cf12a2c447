//! How far the table may be from the posterior.
//!
//! Let ζ_g be the relative error of group g, of variance s_g², independent
//! over groups, and W_g = Σ_{T∋g} p_T. The error of p_T is p_T Σ_g (1[g∈T] − W_g) ζ_g, of variance
//! p_T² V_T with V_T = Σ_g W_g² s_g² + Σ_{g∈T} (1 − 2W_g) s_g², so that E\[TV\] ≤ ½ Σ_T p_T √V_T. Added
//! to it are
//!
//! - what the cuts neglect, Σ_T p_T min(1, bound_T / Ê_T);
//! - what draws cannot show: where a group's effective number of draws is below 50, nothing says that
//!   its draws have seen the weights that matter. An unseen event has at 95 % a probability of at most
//!   3/n, so such a group may be as large as min(Ê + 3w/n, the Gaussian bound), w the largest weight that
//!   there is (1, and the bound for annealed draws), and a partition of such groups may be larger than
//!   its estimate by that.

use rayon::prelude::*;

use super::bounds::{COARSE, tilt};
use super::group::Group;
use super::table::{Row, Table};

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

impl Table<'_> {
    /// Brings every row up to date; the error of the table, and each group's shares in it: of the
    /// Monte Carlo error (∂/∂s² · s²) and of what draws cannot show.
    pub(super) fn evaluate(&mut self) -> (TableError, Vec<[f64; 2]>) {
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
            row.effective_draws = effective.map(Group::effective).reduce(f64::min);
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
                let bound = tilt(self.model, &self.sets_of(&self.groups[g]), COARSE);
                bound.map_or(0.0, |tilt| tilt.ln_at_most)
            })
            .collect();
        for (g, bound) in wanted.into_iter().zip(bounds) {
            self.groups[g].ln_at_most = Some(bound);
        }
    }
}
