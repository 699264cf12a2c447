//! What a proposal under the estimator `common` is evaluated in.
//!
//! A proposal goes through [`Workspace::take_out`] and [`Workspace::put_in`], each of which returns a bound on the
//! log weight of its draws, and, if it is accepted, through [`Workspace::commit`]. Every changed detection has
//! a *slot*; nothing of the state is touched before the commit, so a rejection undoes nothing.

use rand::Rng;

use super::Model;
use super::common::{CommonDraws, add, fill, stride};
use super::locations::{Locations, Normals, Placer, Reach, add_shares};
use super::numeric::ln_mean_exp;

const NO_SLOT: u32 = u32::MAX;

/// What a proposal is evaluated in. Nothing is allocated once it has grown.
#[derive(Clone, Debug)]
pub struct Workspace {
    n_draws: usize,
    stride: usize,
    pub(super) placer: Placer,
    /// The detections whose locations change; their place in this list is their slot.
    changed: Vec<u32>,
    /// Slot of each detection, or `NO_SLOT`.
    slot_of: Vec<u32>,
    /// The set, among those that come, of each slot.
    set_of_slot: Vec<u32>,
    /// Proposed locations, a row for each slot.
    locations: Locations,
    /// Proposed normals, a row for each slot, when they are refreshed.
    normals: Normals,
    refreshes: bool,
    /// Pen_r/H without the changed detections, then of the proposal.
    shares: Vec<f64>,
    excess: Vec<f64>,
    ln_weights: Vec<f64>,
    /// What is taken out.
    removed: Vec<f64>,
    pub(super) near: Vec<u32>,
    near_slots: Vec<u32>,
    /// Slots by the left edge of their box.
    order: Vec<u32>,
}

impl Workspace {
    /// For N detections with R ≥ 1 draws.
    pub fn new(n_detections: usize, n_draws: usize) -> Self {
        let stride = stride(n_draws);
        Self {
            n_draws,
            stride,
            placer: Placer::new(stride),
            changed: Vec::new(),
            slot_of: vec![NO_SLOT; n_detections],
            set_of_slot: Vec::new(),
            locations: Locations::new(0, n_draws, stride),
            normals: Normals::default(),
            refreshes: false,
            shares: vec![0.0; stride],
            excess: vec![0.0; stride],
            ln_weights: vec![0.0; n_draws],
            removed: vec![0.0; stride],
            near: Vec::new(),
            near_slots: Vec::new(),
            order: Vec::new(),
        }
    }

    /// As [`Placer::ln_bound`].
    pub fn ln_bound(&mut self, model: &Model, members: &[u32]) -> f64 {
        self.placer.ln_bound(model, members)
    }

    /// Takes out what the members of the sets that come have now, and returns a bound on the log weight of
    /// every draw of the proposal: without their pairs, and with h = 0 for them.
    pub fn take_out(
        &mut self,
        model: &Model,
        draws: &CommonDraws,
        set_of: &[u32],
        sets_after: &[Vec<u32>],
    ) -> f64 {
        for i in self.changed.drain(..) {
            self.slot_of[i as usize] = NO_SLOT;
        }
        self.set_of_slot.clear();
        for (set_ix, members) in sets_after.iter().enumerate() {
            for &i in members {
                self.slot_of[i as usize] = self.changed.len() as u32;
                self.changed.push(i);
                self.set_of_slot.push(set_ix as u32);
            }
        }
        self.refreshes = false;
        let (reach, locations) = (Reach::of(model), &draws.locations);
        self.removed.fill(0.0);
        for (slot, &i) in self.changed.iter().enumerate() {
            let own = locations.box_m(i as usize);
            self.near.clear();
            draws.grid.near(own, reach.most_m, |j| {
                // A pair of changed detections is met twice and counted once.
                let other = self.slot_of[j as usize];
                let counts = other == NO_SLOT || other as usize > slot;
                let apart = counts && set_of[i as usize] != set_of[j as usize];
                if apart && reach.holds(model, i, j, own, locations.box_m(j as usize)) {
                    self.near.push(j);
                }
            });
            let first = (i, locations.row(i as usize));
            let others = (self.near.as_slice(), self.near.as_slice());
            add_shares(model, first, others, locations, &mut self.removed);
        }
        // No sum is below 0 but for rounding.
        for ((left, all), removed) in self.shares.iter_mut().zip(&draws.shares).zip(&self.removed) {
            *left = (all - removed).max(0.0);
        }
        if let Model::Covariance(_) = model {
            self.removed.fill(0.0);
            for &i in &self.changed {
                add(locations.excess_row(i as usize), &mut self.removed);
            }
            let sums = draws.excess.iter().zip(&self.removed);
            for (left, (all, removed)) in self.excess.iter_mut().zip(sums) {
                *left = (all - removed).min(0.0);
            }
        }
        self.weigh(model)
    }

    /// New normals for the changed detections, instead of those they have.
    pub fn refresh(&mut self, rng: &mut impl Rng) {
        let n_values = self.changed.len() * self.stride;
        if self.normals.x.len() < n_values {
            self.normals.x.resize(n_values, 0.0);
            self.normals.y.resize(n_values, 0.0);
        }
        let rows = 0..self.changed.len();
        fill(&mut self.normals, rows, self.n_draws, self.stride, rng);
        self.refreshes = true;
    }

    /// Puts the changed detections where the proposal has them, and returns the largest log weight of its
    /// draws.
    pub fn put_in(&mut self, model: &Model, draws: &CommonDraws, sets_after: &[Vec<u32>]) -> f64 {
        self.locations.reserve_rows(self.changed.len());
        let slot_of = &self.slot_of;
        let slot = |i: u32| slot_of[i as usize] as usize;
        for members in sets_after {
            let to = (&mut self.locations, slot);
            if self.refreshes {
                let from = (&self.normals, slot);
                self.placer.place(model, members, from, to);
            } else {
                let from = (&draws.normals, |i: u32| i as usize);
                self.placer.place(model, members, from, to);
            }
        }
        for slot in 0..self.changed.len() {
            self.locations.bound_row(slot);
        }
        self.add_pairs_with_others(model, draws);
        if sets_after.len() > 1 {
            self.add_pairs_among_changed(model);
        }
        if let Model::Covariance(_) = model {
            for slot in 0..self.changed.len() {
                add(self.locations.excess_row(slot), &mut self.excess);
            }
        }
        self.weigh(model)
    }

    fn add_pairs_with_others(&mut self, model: &Model, draws: &CommonDraws) {
        let reach = Reach::of(model);
        for (slot, &i) in self.changed.iter().enumerate() {
            let own = self.locations.box_m(slot);
            self.near.clear();
            draws.grid.near(own, reach.most_m, |j| {
                let other = draws.locations.box_m(j as usize);
                if self.slot_of[j as usize] == NO_SLOT && reach.holds(model, i, j, own, other) {
                    self.near.push(j);
                }
            });
            let first = (i, self.locations.row(slot));
            let others = (self.near.as_slice(), self.near.as_slice());
            add_shares(model, first, others, &draws.locations, &mut self.shares);
        }
    }

    fn add_pairs_among_changed(&mut self, model: &Model) {
        let (reach, locations) = (Reach::of(model), &self.locations);
        let left = |slot: u32| locations.box_m(slot as usize)[0];
        self.order.clear();
        self.order.extend(0..self.changed.len() as u32);
        self.order
            .sort_unstable_by(|&a, &b| left(a).total_cmp(&left(b)).then(a.cmp(&b)));
        for (place, &slot) in self.order.iter().enumerate() {
            let (i, own) = (self.changed[slot as usize], locations.box_m(slot as usize));
            self.near.clear();
            self.near_slots.clear();
            for &other_slot in &self.order[place + 1..] {
                let other = locations.box_m(other_slot as usize);
                if other[0] - own[1] >= reach.most_m {
                    break;
                }
                let j = self.changed[other_slot as usize];
                let apart =
                    self.set_of_slot[slot as usize] != self.set_of_slot[other_slot as usize];
                if apart && reach.holds(model, i, j, own, other) {
                    self.near.push(j);
                    self.near_slots.push(other_slot);
                }
            }
            let first = (i, locations.row(slot as usize));
            let others = (self.near.as_slice(), self.near_slots.as_slice());
            add_shares(model, first, others, locations, &mut self.shares);
        }
    }

    /// The log weight of every draw; returns the largest.
    fn weigh(&mut self, model: &Model) -> f64 {
        let height = model.penalty().height;
        let sums = self.shares.iter().zip(&self.excess);
        let mut largest = f64::NEG_INFINITY;
        for (ln_weight, (share, excess)) in self.ln_weights.iter_mut().zip(sums) {
            *ln_weight = excess - height * share;
            largest = largest.max(*ln_weight);
        }
        largest
    }

    /// ln of the mean over the draws of exp(h − Pen) of the proposal, ≤ 0 and at most what
    /// [`put_in`](Self::put_in) returned.
    pub fn ln_mean(&self) -> f64 {
        ln_mean_exp(&self.ln_weights)
    }

    /// The proposal becomes the state.
    pub fn commit(&mut self, draws: &mut CommonDraws) {
        for (slot, &i) in self.changed.iter().enumerate() {
            draws.locations.copy_row(i as usize, &self.locations, slot);
            draws.grid.relocate(i, draws.locations.box_m(i as usize));
            if self.refreshes {
                let (to, from) = (i as usize * self.stride, slot * self.stride);
                let range = from..from + self.stride;
                draws.normals.x[to..to + self.stride]
                    .copy_from_slice(&self.normals.x[range.clone()]);
                draws.normals.y[to..to + self.stride].copy_from_slice(&self.normals.y[range]);
            }
        }
        std::mem::swap(&mut draws.shares, &mut self.shares);
        std::mem::swap(&mut draws.excess, &mut self.excess);
    }
}
