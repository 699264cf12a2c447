//! Sweeps at temperature 1: draws of the partition from its posterior, at a linearisation point.
//!
//! A sweep goes through blocks of sightings that are fixed beforehand: single sightings, stretches
//! and whole landmarks of the map that was found. A block whose sightings are all of one landmark
//! is drawn anew given everything else (Gibbs): it joins one of the landmarks that no scan of the
//! block saw, or becomes one of its own. Then pairs of sightings of one scan that lie near each
//! other may exchange their landmarks (Metropolis, a symmetric proposal). All weights are exact:
//! the Gaussian's by updates of rank two, the prior's from its formula. Places beyond the gate of
//! `placing` (a density of e⁻³⁰ of its peak) are left out.

use rand::{Rng, RngExt};

use super::graph::Part;
use super::placing::{Placing, ln_sum_exp};
use super::state::State;

/// A pause that divides the stretches of a landmark, poses.
const PAUSE: usize = 10;
/// Sightings of a scan further apart than this (m) are not exchanged, in standard deviations of
/// both, squared.
const EXCHANGE_GATE: f64 = 60.0;

/// What sweeps move, and how often.
pub(super) struct Sweeper {
    blocks: Vec<Vec<u32>>,
    exchanges: Vec<[u32; 2]>,
}

impl Sweeper {
    /// For the map of a state.
    pub fn new(state: &State, part: Part<'_>) -> Self {
        let mut blocks = state.single_blocks(part, 0);
        blocks.extend(state.stretches(part, PAUSE));
        let mut whole: Vec<Vec<u32>> = state
            .now
            .landmarks
            .iter()
            .map(|one| one.sightings.clone())
            .collect();
        whole.iter_mut().for_each(|one| one.sort_unstable());
        whole.retain(|one| one.len() > 1);
        whole.sort();
        blocks.extend(whole);
        blocks.sort_by_key(Vec::len);
        blocks.dedup();
        let scans = super::linear::scans(part.observations);
        let pairs = scans.iter().flat_map(|scan| {
            let (first, end) = (scan.first as u32, scan.end as u32);
            (first..end).flat_map(move |s| (s + 1..end).map(move |t| [s, t]))
        });
        let near = pairs.filter(|&[s, t]| {
            let [s, t] = [s, t].map(|one| &part.observations[one as usize]);
            super::duplicates::square_distance(s, t) < EXCHANGE_GATE
        });
        Self {
            blocks,
            exchanges: near.collect(),
        }
    }

    /// One sweep. `None` if rounding made the joint singular.
    pub fn sweep(&self, state: &mut State, rng: &mut impl Rng) -> Option<()> {
        for block in &self.blocks {
            let label = |s: u32| state.now.labels[s as usize];
            if block.iter().any(|&s| label(s) != label(block[0])) {
                continue;
            }
            if let Some(placing) = state.exact_placing(block) {
                let target = placing.draw(rng);
                state.place(block, &placing, target);
            }
        }
        for &[s, t] in &self.exchanges {
            state.exchange(s, t, rng);
        }
        state.refresh()
    }
}

impl Placing {
    /// A place by its weight.
    fn draw(&self, rng: &mut impl Rng) -> Option<usize> {
        let weights = self.targets.iter().map(|(_, weight)| *weight);
        let all = ln_sum_exp(weights.chain([0.0]));
        let mut left: f64 = rng.random();
        for &(b, weight) in &self.targets {
            left -= libm::exp(weight - all);
            if left < 0.0 {
                return Some(b);
            }
        }
        None
    }
}

impl State {
    /// Proposes that two sightings of one scan exchange their landmarks.
    fn exchange(&mut self, s: u32, t: u32, rng: &mut impl Rng) {
        let label = |state: &Self, one: u32| state.now.labels[one as usize] as usize;
        let [of_s, of_t] = [s, t].map(|one| self.now.landmarks[label(self, one)].sightings.len());
        // Landmarks of one sighting each would only exchange their names.
        if of_s == 1 && of_t == 1 {
            return;
        }
        let before = self.now.clone();
        let ln_before = self.ln_target();
        let others = [s, t].map(|one| {
            let landmark = &self.now.landmarks[label(self, one)];
            landmark
                .sightings
                .iter()
                .copied()
                .find(|&other| other != one)
        });
        let is_done = self.exchanged([s, t], others);
        let ln_ratio = self.ln_target() - ln_before;
        let is_accepted = is_done && libm::log(rng.random::<f64>()) < ln_ratio;
        if !is_accepted {
            self.now = before;
        }
    }

    /// Does it; `others` are sightings that stay in the landmarks, if any.
    fn exchanged(&mut self, pair: [u32; 2], others: [Option<u32>; 2]) -> bool {
        for one in pair {
            let label = self.now.labels[one as usize] as usize;
            if self.now.landmarks[label].sightings.len() > 1 {
                let Some((freed, ln_density)) = self.freed(&[one]) else {
                    return false;
                };
                self.split(&[one], &freed, ln_density);
            }
        }
        for (one, other) in pair.into_iter().zip([others[1], others[0]]) {
            if let Some(other) = other {
                let [new, known] = [one, other].map(|s| self.now.labels[s as usize] as usize);
                self.join(known, new);
            }
        }
        true
    }

    /// Computes the joint anew, which rounding has moved.
    pub fn refresh(&mut self) -> Option<()> {
        let (joint, ln_evidence) = self.fixed.joint(&self.now.labels, self.n_landmarks())?;
        self.now.joint = joint;
        self.now.ln_evidence = ln_evidence;
        Some(())
    }
}

/// What draws say of a map.
#[derive(Clone, Debug)]
pub(super) struct Tally {
    labels: Vec<u32>,
    sizes: Vec<u32>,
    /// For each sighting, the sum over draws of the share of its landmark's others that are with
    /// it.
    together: Vec<f64>,
    /// For each landmark, the number of draws that have it, exactly.
    exact: Vec<u32>,
    n_draws: u32,
}

impl Tally {
    /// Of a map with n landmarks.
    pub fn new(labels: &[u32], n: usize) -> Self {
        let mut sizes = vec![0; n];
        for &label in labels {
            sizes[label as usize] += 1;
        }
        Self {
            labels: labels.to_vec(),
            sizes,
            together: vec![0.0; labels.len()],
            exact: vec![0; n],
            n_draws: 0,
        }
    }

    /// Counts a draw.
    pub fn count(&mut self, state: &State) {
        self.n_draws += 1;
        for landmark in &state.now.landmarks {
            let mut named: Vec<u32> = landmark
                .sightings
                .iter()
                .map(|&s| self.labels[s as usize])
                .collect();
            named.sort_unstable();
            let n = landmark.sightings.len() as u32;
            if named[0] == named[named.len() - 1] && n == self.sizes[named[0] as usize] {
                self.exact[named[0] as usize] += 1;
            }
            for &s in &landmark.sightings {
                let label = self.labels[s as usize];
                let size = self.sizes[label as usize];
                let with = named.partition_point(|&one| one <= label)
                    - named.partition_point(|&one| one < label);
                self.together[s as usize] += match size {
                    1 => f64::from(u8::from(n == 1)),
                    _ => (with - 1) as f64 / f64::from(size - 1),
                };
            }
        }
    }

    /// The probability of each sighting's landmark: the expected share of the landmark's other
    /// sightings that are of one landmark with it; of a landmark of one sighting, that it is.
    pub fn of_sightings(&self) -> Vec<f64> {
        let n = f64::from(self.n_draws.max(1));
        self.together.iter().map(|sum| sum / n).collect()
    }

    /// The probability that exactly these sightings are a landmark.
    pub fn of_landmarks(&self) -> Vec<f64> {
        let n = f64::from(self.n_draws.max(1));
        self.exact
            .iter()
            .map(|&count| f64::from(count) / n)
            .collect()
    }
}
