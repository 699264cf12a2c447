//! Sets that may meet, with what draws have shown of their E[exp(−Pen)].

use super::anneal::{LEAST_RUNS, N_WALKERS, n_evaluations};
use super::weights::{LogNormal, WeightSums};

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
    pub(super) ladder: Option<Vec<f64>>,
    /// The logarithms of what runs down the ladder gave.
    pub(super) runs: LogNormal,
    /// ln of what plain draws had shown to be possible before annealed ones took over.
    pub(super) ln_plain_upper: f64,
    /// ln of the Gaussian bound, once it was needed.
    pub(super) ln_at_most: Option<f64>,
}

impl Group {
    pub(super) fn is_closed_form(&self) -> bool {
        self.sets.len() == 1
    }

    /// Evaluations of the penalty that one more weight costs.
    pub(super) fn n_evaluations(&self) -> usize {
        (self.ladder.as_ref()).map_or(1, |ladder| n_evaluations(ladder.len()))
    }

    /// Effective number of draws: 1/(relative variance of the mean) at most.
    pub(super) fn effective(&self) -> f64 {
        match &self.ladder {
            None => self.sums.effective(),
            Some(_) => (1.0 / self.sums.variance()).min(self.sums.n() * N_WALKERS as f64),
        }
    }

    /// What a draw costs, in locations.
    pub(super) fn cost(&self) -> f64 {
        (self.size * self.n_evaluations()) as f64
    }

    pub(super) fn is_trusted(&self) -> bool {
        let has_enough = self.ladder.is_none() || self.sums.n() >= LEAST_RUNS as f64;
        self.is_closed_form() || (has_enough && self.effective() >= TRUSTED)
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
        let at_most = self.ln_at_most.unwrap_or(0.0).min(self.ln_plain_upper);
        let upper = match self.ladder {
            Some(_) => self
                .runs
                .ln_upper()
                .map_or(at_most, |upper| upper.min(at_most)),
            None => self.ln_upper_of_plain().min(at_most),
        };
        upper.max(self.ln_mean())
    }

    /// ln of what E[exp(−Pen)] may be by plain draws: no weight is above 1.
    pub(super) fn ln_upper_of_plain(&self) -> f64 {
        let unseen = libm::log(3.0 / self.sums.n());
        let (low, high) = (self.ln_mean().min(unseen), self.ln_mean().max(unseen));
        high + libm::log1p(libm::exp(low - high))
    }
}
