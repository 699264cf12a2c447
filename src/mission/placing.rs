//! Where a block of sightings of one landmark may go, each place with its weight.
//!
//! The block is freed first, at least in thought: `u` is its landmark, δ = u − l_a its offset from
//! what is left of its landmark a, with covariance P. A place b then has u − b = (l_a − b) + δ, so
//! that with f = (Cr)_a − (Cr)_b − I the difference has mean (l_a − b) − fδ and covariance S_ab + f
//! P fᵀ: O(1) for each place.

use super::joint::{Freed, Match, match_of};
use super::state::State;

/// Differences of more standard deviations than this, squared, are no place.
const GATE: f64 = 60.0;

/// Where a block may go.
#[derive(Clone, Debug)]
pub(super) struct Placing {
    /// The landmark that the block is of.
    pub from: usize,
    /// What frees the block, with ln N(0); `None` if it is the whole landmark.
    pub freed: Option<(Freed, f64)>,
    /// Landmarks, with the log of their weight. To be a landmark of its own has ln weight 0.
    pub targets: Vec<(usize, f64)>,
}

impl Placing {
    /// The place that the block has now.
    pub fn now(&self) -> Option<usize> {
        self.freed.as_ref().map(|_| self.from)
    }

    /// The number of landmarks while the block is one of its own.
    fn n_apart(&self, state: &State) -> usize {
        state.n_landmarks() + usize::from(self.freed.is_some())
    }

    /// The best place, `None` for a landmark of its own, and the log of its odds against all others
    /// together.
    pub fn best(&self) -> (Option<usize>, f64) {
        let mut best = (None, 0.0);
        for &(b, weight) in &self.targets {
            if weight > best.1 {
                best = (Some(b), weight);
            }
        }
        let all = self.targets.iter().map(|&(b, weight)| (Some(b), weight));
        let others = all.chain([(None, 0.0)]).filter(|(b, _)| *b != best.0);
        (
            best.0,
            best.1 - ln_sum_exp(others.map(|(_, weight)| weight)),
        )
    }
}

/// ln Σ exp of some numbers.
pub(super) fn ln_sum_exp(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = values.clone().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    most + libm::log(values.map(|value| libm::exp(value - most)).sum())
}

impl State {
    /// Where a block of sightings of one landmark may go; `None` if it cannot be freed, for
    /// rounding. The prior counts roughly, as in [`Standing::gain`].
    pub fn placing(&self, block: &[u32]) -> Option<Placing> {
        let mut placing = self.densities(block)?;
        let own = self.fixed.standing(block);
        let ln_fewer = self.ln_fewer(placing.n_apart(self));
        for (b, weight) in &mut placing.targets {
            let landmark = &self.now.landmarks[*b];
            let mut standing = landmark.standing;
            if *b == placing.from {
                standing.n -= block.len();
            }
            *weight += ln_fewer + own.gain(standing);
        }
        Some(placing)
    }

    /// The same with the prior as it is.
    pub fn exact_placing(&self, block: &[u32]) -> Option<Placing> {
        let mut placing = self.densities(block)?;
        let own = self.fixed.standing(block);
        let ln_fewer = self.ln_fewer(placing.n_apart(self));
        for (b, weight) in &mut placing.targets {
            let landmark = &self.now.landmarks[*b];
            let (apart, together) = if *b == placing.from {
                let left = landmark.sightings.iter().filter(|s| !block.contains(s));
                let left: Vec<u32> = left.copied().collect();
                (self.fixed.standing(&left), landmark.standing)
            } else {
                let both = [&landmark.sightings[..], block].concat();
                (landmark.standing, self.fixed.standing(&both))
            };
            *weight += ln_fewer + own.cost() + apart.cost() - together.cost();
        }
        Some(placing)
    }

    /// Where a block may go, weighted by the Gaussian alone.
    fn densities(&self, block: &[u32]) -> Option<Placing> {
        let from = self.now.labels[block[0] as usize] as usize;
        let landmark = &self.now.landmarks[from];
        let others = (0..self.n_landmarks()).filter(|&b| b != from);
        let near = |matched: Match| (matched.square_distance <= GATE).then_some(matched.ln_density);
        if landmark.sightings.len() == block.len() {
            let near = |b| near(self.now.joint.match_of(from, b)).map(|density| (b, density));
            let targets = others.filter_map(near);
            let targets = targets.filter(|&(b, _)| !self.conflict(from, b));
            return Some(Placing {
                from,
                freed: None,
                targets: targets.collect(),
            });
        }
        let (freed, ln_density) = self.freed(block)?;
        let mut targets = vec![(from, ln_density)];
        for b in others {
            let (d, s) = self.now.joint.difference(b, from);
            let f = minus(&freed, from, b);
            let (d, s) = freed_difference(d, s, &freed, f);
            if let Some(ln_density) = near(match_of(d, s))
                && !self.is_seen_with(block, b)
            {
                targets.push((b, ln_density));
            }
        }
        Some(Placing {
            from,
            freed: Some((freed, ln_density)),
            targets,
        })
    }

    /// Whether a scan of the block saw a landmark that the block is not of.
    fn is_seen_with(&self, block: &[u32], b: usize) -> bool {
        let scans = block.iter().map(|&s| self.fixed.scan_of[s as usize]);
        let landmark = &self.now.landmarks[b];
        scans
            .into_iter()
            .any(|scan| landmark.is_seen_in(scan as usize))
    }

    /// Puts a block where it shall go. Returns whether that is elsewhere than before.
    pub fn place(&mut self, block: &[u32], placing: &Placing, target: Option<usize>) -> bool {
        if target == placing.now() {
            return false;
        }
        if let Some((freed, ln_density)) = &placing.freed {
            self.split(block, freed, *ln_density);
        }
        if let Some(b) = target {
            let own = self.now.labels[block[0] as usize] as usize;
            self.join(b, own);
        }
        true
    }
}

/// f: (Cr)_a − (Cr)_b − I, by rows.
fn minus(freed: &Freed, a: usize, b: usize) -> [f64; 4] {
    let at = |axis: usize, column: usize| {
        freed.gain[column][2 * a + axis] - freed.gain[column][2 * b + axis]
    };
    [at(0, 0) - 1.0, at(0, 1), at(1, 0), at(1, 1) - 1.0]
}

/// Mean and covariance of u − b from those of l_a − b.
fn freed_difference(
    [dx, dy]: [f64; 2],
    [sxx, sxy, syy]: [f64; 3],
    freed: &Freed,
    [fxx, fxy, fyx, fyy]: [f64; 4],
) -> ([f64; 2], [f64; 3]) {
    let [ox, oy] = freed.offset_m;
    let [pxx, pxy, pyy] = freed.covariance;
    let (gxx, gxy) = (fxx * pxx + fxy * pxy, fxx * pxy + fxy * pyy);
    let (gyx, gyy) = (fyx * pxx + fyy * pxy, fyx * pxy + fyy * pyy);
    (
        [dx - fxx * ox - fxy * oy, dy - fyx * ox - fyy * oy],
        [
            sxx + gxx * fxx + gxy * fxy,
            sxy + gxx * fyx + gxy * fyy,
            syy + gyx * fyx + gyy * fyy,
        ],
    )
}
