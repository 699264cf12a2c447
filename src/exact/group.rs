//! Sets that may meet, with what draws have shown of their E[exp(−Pen)].

use super::anneal::{Rung, STEPS_PER_RUNG};
use super::weights::WeightSums;

/// Below this effective number of draws a standard error is not trusted.
pub const TRUSTED: f64 = 50.0;

/// Sets that may meet, with what is known of their E[exp(−Pen)].
pub(super) struct Group {
    /// Bit i of a set is detection i.
    pub(super) sets: Vec<u16>,
    /// N members in all.
    pub(super) size: usize,
    pub(super) sums: WeightSums,
    /// Chunks drawn so far: numbers the generators.
    pub(super) n_chunks: u64,
    /// The ladder of its annealed draws; `None` while plain draws will do.
    pub(super) ladder: Option<Vec<Rung>>,
    /// ln of the Gaussian bound, once it was needed.
    pub(super) ln_at_most: Option<f64>,
}

impl Group {
    pub(super) fn is_closed_form(&self) -> bool {
        self.sets.len() == 1
    }

    /// Evaluations of the penalty that a draw costs.
    pub(super) fn n_evaluations(&self) -> usize {
        (self.ladder.as_ref()).map_or(1, |ladder| 1 + STEPS_PER_RUNG * (ladder.len() - 1))
    }

    /// What a draw costs, in locations.
    pub(super) fn cost(&self) -> f64 {
        (self.size * self.n_evaluations()) as f64
    }

    pub(super) fn is_trusted(&self) -> bool {
        self.is_closed_form() || self.sums.effective() >= TRUSTED
    }

    pub(super) fn ln_mean(&self) -> f64 {
        if self.is_closed_form() {
            0.0
        } else {
            self.sums.ln_mean()
        }
    }

    pub(super) fn variance(&self) -> f64 {
        if self.is_closed_form() {
            0.0
        } else {
            self.sums.variance()
        }
    }

    /// ln of what E[exp(−Pen)] may be.
    pub(super) fn ln_upper(&self) -> f64 {
        if self.is_trusted() {
            return self.ln_mean();
        }
        // No weight is above 1, and none of the annealed ones above the Gaussian bound.
        let at_most = self.ln_at_most.unwrap_or(0.0);
        let largest = if self.ladder.is_some() { at_most } else { 0.0 };
        let unseen = largest + libm::log(3.0 / self.sums.n());
        let (low, high) = (self.ln_mean().min(unseen), self.ln_mean().max(unseen));
        (high + libm::log1p(libm::exp(low - high)))
            .min(at_most)
            .max(self.ln_mean())
    }
}
