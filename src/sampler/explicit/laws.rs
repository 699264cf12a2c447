//! What a data set's moves ask: closed forms, prior, scores, neighbours, and what of them depends
//! on the model. Nothing of it changes in a chain.
//!
//! The moves know no model. What they need of one is here, in [`Law`]'s two forms: the law of one
//! location in a set ([`Laws::joining`]) and of all locations of a set
//! ([`Joint`](super::joint::Joint)), the penalty of a pair ([`pairs`](super::pairs)), its reach, and
//! in which coordinates it is round.

use std::sync::Arc;

use super::area::Area;
use super::joint::{Joint, precision_seen};
use super::placement::SetSums;
use crate::model::appearance::Tally;
use crate::model::blocks::Blocks;
use crate::model::conditional::Conditionals;
use crate::model::leaving::{LeavingScores, MOST_SCORED, SCORE_IN_LARGE};
use crate::model::location_law::{Cone, LocationLaw, Normal, whitening};
use crate::model::moments::{Moments, square_distance};
use crate::model::neighbours::Neighbours;
use crate::model::prior::PriorTable;
use crate::model::ring::{Leaving, Ring};
use crate::model::tilt::Tilt;
use crate::model::{Appearance, CovarianceModel, MetricModel, Model, Penalty, Prior};

/// M of distances that are as they are.
const PLAIN: [f64; 3] = [1.0, 0.0, 1.0];

/// The laws of one data set, or of a tile of it.
pub(super) struct Laws<'a> {
    pub(super) law: Law<'a>,
    model: &'a Model,
    /// Detections that the partition holds: the first so many of the model. The others stand still.
    n_detections: usize,
    /// Where locations may be.
    pub(super) area: Area,
    pub(super) prior: PriorTable,
    pub(super) neighbours: Neighbours,
    scores: Arc<LeavingScores>,
    /// What M does to a leaving detection, where that does not depend on M.
    ln_one_set_more: f64,
}

/// What depends on the model.
pub(super) enum Law<'a> {
    Metric(MetricLaw<'a>),
    Covariance(CovarianceLaw<'a>),
}

/// Of the metric model.
pub(super) struct MetricLaw<'a> {
    pub(super) model: &'a MetricModel,
    conditionals: Conditionals,
}

/// Of the covariance model.
pub(super) struct CovarianceLaw<'a> {
    pub(super) model: &'a CovarianceModel,
    blocks: Blocks<'a>,
    pub(super) inverse_square_radius: f64,
}

impl<'a> Law<'a> {
    fn of(model: &'a Model) -> Self {
        match model {
            Model::Metric(metric) => Self::Metric(MetricLaw {
                model: metric,
                conditionals: Conditionals::new(metric),
            }),
            Model::Covariance(covariance) => Self::Covariance(CovarianceLaw {
                model: covariance,
                blocks: Blocks::of(model),
                inverse_square_radius: model.penalty().inverse_square_radius(),
            }),
        }
    }
}

impl<'a> Laws<'a> {
    /// Of a model.
    pub(super) fn new(model: &'a Model, prior: Prior) -> Self {
        Self {
            law: Law::of(model),
            model,
            n_detections: model.n_detections(),
            area: Area::EVERYWHERE,
            prior: prior.table(model.n_detections()),
            neighbours: Neighbours::of(model),
            scores: Arc::new(LeavingScores::new(model)),
            ln_one_set_more: match prior {
                Prior::DirichletProcess { concentration } => libm::log(concentration),
                Prior::Uniform | Prior::Poisson { .. } => 0.0,
            },
        }
    }

    /// Of the detections that are free in a tile, with their `neighbours`, and of those beside
    /// them that stand still: `model` is the part of this one with the free ones first. The prior
    /// must not look at M.
    pub(super) fn of_tile<'b>(
        &self,
        model: &'b Model,
        prior: Prior,
        neighbours: Neighbours,
        (n_free, area): (usize, Area),
    ) -> Laws<'b> {
        Laws {
            law: Law::of(model),
            model,
            n_detections: n_free,
            area,
            prior: prior.table(n_free),
            neighbours,
            scores: Arc::clone(&self.scores),
            ln_one_set_more: self.ln_one_set_more,
        }
    }

    pub(super) fn penalty(&self) -> &Penalty {
        self.model.penalty()
    }

    /// Pen of a place that has this Σ f/H, nats: infinite outside the area.
    #[inline]
    pub(super) fn penalty_of(&self, sum: f64) -> f64 {
        if sum < f64::INFINITY {
            self.penalty().height * sum
        } else {
            sum
        }
    }

    pub(super) fn appearance(&self) -> &Appearance {
        self.model.appearance()
    }

    pub(super) fn n_detections(&self) -> usize {
        self.n_detections
    }

    pub(super) fn positions_m(&self) -> &[[f64; 2]] {
        self.model.positions_m()
    }

    pub(super) fn z_m(&self, i: u32) -> [f64; 2] {
        self.model.positions_m()[i as usize]
    }

    /// σ_o: in m, or without unit.
    pub(super) fn sigma_o(&self) -> f64 {
        match &self.law {
            Law::Metric(metric) => metric.model.sigma_o_m(),
            Law::Covariance(covariance) => 1.0 / covariance.model.precisions().0.sqrt(),
        }
    }

    /// How far apart in the plane two locations can be that pay a penalty, m.
    pub(super) fn reach_m(&self) -> f64 {
        let radius_m = self.penalty().radius_m;
        match &self.law {
            Law::Metric(_) => radius_m,
            Law::Covariance(covariance) => radius_m * covariance.model.widest_m2().sqrt(),
        }
    }

    /// M of the mean covariance of some detections.
    pub(super) fn whitening(&self, members: impl Iterator<Item = u32>) -> [f64; 3] {
        match &self.law {
            Law::Metric(_) => PLAIN,
            Law::Covariance(covariance) => whitening(mean(covariance.model, members)),
        }
    }

    /// M of the mean of the mean covariances of two sets.
    pub(super) fn whitening_between(&self, first: &[u32], second: &[u32]) -> [f64; 3] {
        self.whitening_of_two(first.iter().copied(), second.iter().copied())
    }

    fn whitening_of_two(
        &self,
        first: impl Iterator<Item = u32>,
        second: impl Iterator<Item = u32>,
    ) -> [f64; 3] {
        let Law::Covariance(covariance) = &self.law else {
            return PLAIN;
        };
        let (a, b) = (
            mean(covariance.model, first),
            mean(covariance.model, second),
        );
        whitening([0, 1, 2].map(|k| 0.5 * (a[k] + b[k])))
    }

    /// ln of the factor of π that a set has by itself, but for its sizes' prior: B and its
    /// appearance. Fills its law.
    pub(super) fn ln_bound(&self, members: &[u32], tally: Tally, joint: &mut Joint) -> f64 {
        joint.fill(self, members);
        joint.ln_bound + self.appearance().ln_likelihood_of(tally)
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

    /// The law of a detection's location by itself.
    pub(super) fn alone(&self, i: u32) -> LocationLaw {
        match &self.law {
            Law::Metric(metric) => metric.conditionals.given(self.z_m(i), &Moments::default()),
            Law::Covariance(covariance) => {
                let none = std::iter::empty();
                covariance.model.joining(i, none, &mut Vec::new())
            }
        }
    }

    /// The same by its density.
    pub(super) fn density_alone(&self, i: u32) -> Normal {
        let whiten = match &self.law {
            Law::Metric(_) => PLAIN,
            Law::Covariance(covariance) => covariance.model.whitening(i),
        };
        Normal::new(self.z_m(i), whiten, self.model.precisions().0)
    }

    /// The law of the location of a detection in a set with others, and the costs that it has for
    /// their locations, over ∫exp(−E) of the detection alone. Cones are added to a list.
    pub(super) fn joining(
        &self,
        i: u32,
        others: &Moments,
        members: impl Iterator<Item = u32> + Clone,
        x_m: &[[f64; 2]],
        cones: &mut Vec<Cone>,
    ) -> LocationLaw {
        match &self.law {
            Law::Metric(metric) => metric.conditionals.given(self.z_m(i), others),
            Law::Covariance(covariance) => {
                let model = covariance.model;
                let mut law = model.joining(i, members.clone(), cones);
                law.ln_bound -= model.ln_alone(i);
                for j in members {
                    law.ln_bound -= model.cost_of(i, j, x_m[j as usize]);
                }
                law
            }
        }
    }

    /// The ring on which a detection leaves a set of n members with this mean of their locations,
    /// where `whiten` is that of the pair.
    pub(super) fn ring(&self, i: u32, whiten: [f64; 3], centre_m: [f64; 2], n: usize) -> Ring {
        let a = self.model.precisions().0;
        let precision = match &self.law {
            Law::Metric(_) => a,
            Law::Covariance(covariance) => {
                let c = covariance.model.covariance_m2(i);
                a * precision_seen(whiten, [c.xx, c.xy, c.yy])
            }
        };
        let leaving = Leaving {
            centre_m,
            from_m: self.z_m(i),
            whiten,
            precision,
            n_pairs: n,
        };
        Ring::new(self.penalty(), &leaving)
    }

    /// M between a detection and the mean of some others.
    pub(super) fn whitening_to(&self, i: u32, others: impl Iterator<Item = u32>) -> [f64; 3] {
        self.whitening_of_two(std::iter::once(i), others)
    }

    /// The tilt of two sets.
    pub(super) fn tilt(&self, joints: [&Joint; 2], members: [&[u32]; 2]) -> Option<Tilt> {
        Tilt::new(self.penalty(), &Joint::apart(self, joints, members))
    }

    /// The score of each member's leaving ([`leaving`](crate::model::leaving)), handed to `keep`;
    /// returns their sum.
    pub(super) fn leaving(
        &self,
        members: impl Iterator<Item = u32> + Clone,
        sums: &SetSums,
        mut keep: impl FnMut(u32, f64),
    ) -> f64 {
        let n = sums.z.n;
        if n - 1 > MOST_SCORED {
            return SCORE_IN_LARGE * n as f64;
        }
        if n == 1 {
            members.for_each(|i| keep(i, 1.0));
            return 1.0;
        }
        let mut total = 0.0;
        let (prior, appearance) = (&self.prior, self.appearance());
        let ln_prior = prior.ln_size(n - 1) + prior.ln_size(1) - prior.ln_size(n);
        let seen_together = appearance.ln_likelihood_of(sums.tally);
        let mut score = |i: u32, [ln_left, ln_together]: [f64; 2], d: f64| {
            let one = appearance.tally(&[i]);
            let ln_apart = ln_left
                + appearance.ln_likelihood_of(sums.tally.without(one))
                + appearance.ln_likelihood_of(one);
            let ln_odds =
                ln_apart - (ln_together + seen_together) + (ln_prior + self.ln_one_set_more);
            let score = self.scores.score(ln_odds, n - 1, d);
            keep(i, score);
            total += score;
        };
        match &self.law {
            Law::Metric(metric) => {
                let ln_gaussian = |z: &Moments| {
                    if z.n > 1 {
                        metric.model.ln_gaussian_of(z.n, z.scatter_m2)
                    } else {
                        0.0
                    }
                };
                let ln_together = ln_gaussian(&sums.z);
                for i in members {
                    let z = self.z_m(i);
                    let left = sums.z.without(z);
                    let d2 = square_distance(z, left.mean_m);
                    score(i, [ln_gaussian(&left), ln_together], d2.sqrt());
                }
            }
            Law::Covariance(law) => {
                let together = law.blocks.block(members.clone());
                for i in members {
                    let left = law.blocks.without(&together, i);
                    let ln_both = [left.ln_gaussian(), together.ln_gaussian()];
                    score(i, ln_both, law.blocks.distance(&left, i));
                }
            }
        }
        total
    }
}

/// The mean covariance of some detections: xx, xy, yy, m².
fn mean(model: &CovarianceModel, members: impl Iterator<Item = u32>) -> [f64; 3] {
    let (mut sum, mut n) = ([0.0; 3], 0.0);
    for i in members {
        let c = model.covariance_m2(i);
        for (sum, value) in sum.iter_mut().zip([c.xx, c.xy, c.yy]) {
            *sum += value;
        }
        n += 1.0;
    }
    sum.map(|sum| sum / n)
}
