//! The sightings of one scan assigned to known landmarks, together: a beam over hypotheses.
//!
//! Each new sighting is a landmark of its own so far. A hypothesis says for each of them which
//! known landmark it is, no two the same, or none. It is scored on the joint Gaussian of the few
//! landmarks concerned, conditioned on what it has said so far. A sighting is assigned if that has
//! enough of the probability of all hypotheses; the others stay as they are.

use super::joint::Joint;
use super::state::State;

/// Known landmarks further from a sighting than this, squared and in standard deviations, are no
/// candidates.
const GATE: f64 = 25.0;
/// Once a hypothesis has said something, its landmarks may be so much further away.
const LATER_GATE: f64 = 32.5;
/// Candidates for each sighting.
const MOST_CANDIDATES: usize = 8;
/// Hypotheses kept.
const WIDTH: usize = 24;
/// Hypotheses this far below the best (nats) are dropped.
const DEPTH: f64 = 15.0;

struct Hypothesis {
    ln_weight: f64,
    /// For each sighting the place in the small joint of its landmark.
    said: Vec<Option<usize>>,
    joint: Joint,
}

impl State {
    /// Assigns the sightings of a scan to landmarks with `is_known(b)` where the probability of
    /// that is at least `sure`. Gives how many.
    pub fn assign_scan(
        &mut self,
        sightings: &[u32],
        sure: f64,
        is_known: impl Fn(usize) -> bool,
    ) -> usize {
        let own: Vec<usize> = sightings
            .iter()
            .map(|&s| self.now.labels[s as usize] as usize)
            .collect();
        let candidates = self.candidates(&own, is_known);
        if candidates.is_empty() {
            return 0;
        }
        let n = own.len();
        let all: Vec<usize> = own.iter().chain(&candidates).copied().collect();
        let beam = self.beam(n, &all);
        let Some(best) = beam.first() else { return 0 };
        let weights: Vec<f64> = beam
            .iter()
            .map(|one| libm::exp(one.ln_weight - best.ln_weight))
            .collect();
        let total: f64 = weights.iter().sum();
        // Numbers of landmarks change as they are joined, sightings do not.
        let mut pairs = Vec::new();
        for (t, &s) in sightings.iter().enumerate() {
            let Some(place) = best.said[t] else { continue };
            let agree = beam
                .iter()
                .zip(&weights)
                .filter(|(one, _)| one.said[t] == Some(place));
            if agree.map(|(_, weight)| weight).sum::<f64>() > sure * total {
                pairs.push((s, self.now.landmarks[all[place]].sightings[0]));
            }
        }
        for &(s, of_known) in &pairs {
            let [new, known] = [s, of_known].map(|one| self.now.labels[one as usize] as usize);
            self.join(known, new);
        }
        pairs.len()
    }

    /// Known landmarks that a sighting may be of, in order.
    fn candidates(&self, own: &[usize], is_known: impl Fn(usize) -> bool) -> Vec<usize> {
        let known: Vec<usize> = (0..self.n_landmarks())
            .filter(|&b| !own.contains(&b) && is_known(b))
            .collect();
        let mut candidates: Vec<usize> = Vec::new();
        for &a in own {
            let near = known.iter().filter_map(|&b| {
                let distance = self.now.joint.match_of(a, b).square_distance;
                (distance < GATE && !self.conflict(a, b)).then_some((distance, b))
            });
            let mut near: Vec<(f64, usize)> = near.collect();
            near.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
            candidates.extend(near.iter().take(MOST_CANDIDATES).map(|(_, b)| b));
        }
        candidates.sort_unstable();
        candidates.dedup();
        candidates
    }

    /// The best hypotheses first, on the landmarks `all`, of which the first n are the sightings'.
    fn beam(&self, n: usize, all: &[usize]) -> Vec<Hypothesis> {
        let mut beam = vec![Hypothesis {
            ln_weight: 0.0,
            said: Vec::new(),
            joint: self.now.joint.of_some(all),
        }];
        let ln_fewer = self.ln_fewer(self.n_landmarks());
        for t in 0..n {
            let own = self.now.landmarks[all[t]].standing;
            // The number of a hypothesis, what it says next, and its weight.
            let mut next: Vec<(usize, Option<usize>, f64)> = Vec::new();
            for (ix, one) in beam.iter().enumerate() {
                next.push((ix, None, one.ln_weight));
                for c in (n..all.len()).filter(|c| !one.said.contains(&Some(*c))) {
                    let matched = one.joint.match_of(c, t);
                    if matched.square_distance < LATER_GATE && !self.conflict(all[t], all[c]) {
                        let gain = own.gain(self.now.landmarks[all[c]].standing);
                        let ln_weight = one.ln_weight + matched.ln_density + ln_fewer + gain;
                        next.push((ix, Some(c), ln_weight));
                    }
                }
            }
            next.sort_by(|x, y| y.2.total_cmp(&x.2).then(x.0.cmp(&y.0)).then(x.1.cmp(&y.1)));
            let floor = next[0].2 - DEPTH;
            next.truncate(WIDTH);
            let kept = next.into_iter().filter(|one| one.2 > floor);
            let grown = kept.map(|(ix, said, ln_weight)| {
                let from = &beam[ix];
                let mut joint = from.joint.clone();
                if let (Some(c), true) = (said, t + 1 < n) {
                    joint.identify(c, t);
                }
                Hypothesis {
                    ln_weight,
                    said: from.said.iter().copied().chain([said]).collect(),
                    joint,
                }
            });
            beam = grown.collect();
        }
        beam
    }
}
