//! What a data set's moves ask: closed forms, prior, scores, neighbours. Nothing of it changes in a
//! chain.

use crate::model::appearance::Tally;
use crate::model::conditional::Conditionals;
use crate::model::leaving::{LeavingScores, MOST_SCORED, SCORE_IN_LARGE};
use crate::model::moments::Moments;
use crate::model::neighbours::Neighbours;
use crate::model::prior::PriorTable;
use crate::model::{MetricModel, Model, Penalty, Prior};

use super::placement::SetSums;

/// The laws of one data set.
pub(super) struct Laws<'a> {
    pub(super) model: &'a MetricModel,
    pub(super) conditionals: Conditionals,
    pub(super) prior: PriorTable,
    pub(super) neighbours: Neighbours,
    scores: LeavingScores,
    /// What M does to a leaving detection, where that does not depend on M.
    ln_one_set_more: f64,
}

impl<'a> Laws<'a> {
    /// Of the metric model; panics on another, for which the settings do not allow this sampler.
    pub(super) fn new(model: &'a Model, prior: Prior) -> Self {
        let Model::Metric(metric) = model else {
            panic!("the settings allow explicit locations for the metric model only");
        };
        Self {
            model: metric,
            conditionals: Conditionals::new(metric),
            prior: prior.table(metric.n_detections()),
            neighbours: Neighbours::of(model),
            scores: LeavingScores::new(metric),
            ln_one_set_more: match prior {
                Prior::DirichletProcess { concentration } => libm::log(concentration),
                Prior::Uniform | Prior::Poisson { .. } => 0.0,
            },
        }
    }

    pub(super) fn penalty(&self) -> &Penalty {
        self.model.penalty()
    }

    pub(super) fn z_m(&self, i: u32) -> [f64; 2] {
        self.model.positions_m()[i as usize]
    }

    /// ln of the factor of π that a set has by itself: I₀ and its appearance.
    pub(super) fn ln_bound(&self, z: &Moments, tally: Tally) -> f64 {
        let ln_gaussian = if z.n > 1 {
            self.model.ln_gaussian_of(z.n, z.scatter_m2)
        } else {
            0.0
        };
        ln_gaussian + self.model.appearance().ln_likelihood_of(tally)
    }

    /// ln of the prior's ratio when a detection joins a set of n.
    pub(super) fn ln_joins(&self, n: usize) -> f64 {
        self.prior.ln_size(n + 1) - self.prior.ln_size(n)
    }

    /// The same when it opens a set beside so many.
    pub(super) fn ln_opens(&self, n_sets: usize) -> f64 {
        let prior = &self.prior;
        prior.ln_n_sets(n_sets + 1) - prior.ln_n_sets(n_sets) + prior.ln_size(1)
    }

    /// The score of each member's leaving ([`leaving`](crate::model::leaving)), handed to `keep`;
    /// returns their sum.
    pub(super) fn leaving(
        &self,
        members: impl Iterator<Item = u32>,
        sums: &SetSums,
        mut keep: impl FnMut(u32, f64),
    ) -> f64 {
        let n = sums.z.n;
        if n - 1 > MOST_SCORED {
            return SCORE_IN_LARGE * n as f64;
        }
        let mut total = 0.0;
        let prior = &self.prior;
        let ln_prior = prior.ln_size(n - 1) + prior.ln_size(1) - prior.ln_size(n);
        let ln_together = self.ln_bound(&sums.z, sums.tally);
        for i in members {
            let score = if n == 1 {
                1.0
            } else {
                let z = self.z_m(i);
                let left = sums.z.without(z);
                let one = self.model.appearance().tally(&[i]);
                let ln_apart = self.ln_bound(&left, sums.tally.without(one))
                    + self.model.appearance().ln_likelihood_of(one);
                let ln_odds = ln_apart - ln_together + (ln_prior + self.ln_one_set_more);
                let d2 = crate::model::moments::square_distance(z, left.mean_m);
                self.scores.score(ln_odds, n - 1, d2.sqrt())
            };
            keep(i, score);
            total += score;
        }
        total
    }
}
