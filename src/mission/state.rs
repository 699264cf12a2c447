//! A partition of the sightings with the joint posterior of its landmarks, at a linearisation
//! point.
//!
//! With H = ZᵀΛZ, g = Zᵀh (see `linear`) and C = H⁻¹ the evidence of a partition of M landmarks is
//! ½ gᵀCg − ½ ln det H + M ln 2π, up to what all partitions share, and the prior is that of `view`.
//! Both are kept up to date: to join two landmarks is one update of rank two, to take sightings out
//! of a landmark another.

use std::f64::consts::TAU;

use super::graph::Part;
use super::joint::{Freed, Joint};
use super::linear::{Linear, scan_of, scans};
use super::view::{Reach, Seen, Standing, View};
use crate::sighting::Pose;

/// One landmark.
#[derive(Clone, Debug)]
pub(super) struct Landmark {
    /// Its sightings, in no order.
    pub sightings: Vec<u32>,
    /// A bit for each scan that saw it.
    seen: Vec<u64>,
    pub standing: Standing,
}

/// What changes with the partition.
#[derive(Clone, Debug)]
pub(super) struct Association {
    /// The landmark of each sighting.
    pub labels: Vec<u32>,
    pub landmarks: Vec<Landmark>,
    pub joint: Joint,
    /// See the module; without what is shared.
    pub ln_evidence: f64,
}

/// What stays until the mission is linearised anew.
#[derive(Clone, Debug)]
pub(super) struct Fixed {
    pub poses: Vec<Pose>,
    pub linear: Linear,
    pub view: View,
    /// The scan of each sighting.
    pub scan_of: Vec<u32>,
    pub n_scans: usize,
}

/// Both.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub fixed: Fixed,
    pub now: Association,
}

impl State {
    /// Linearises a mission at `poses` under a partition (any labels). `None` if an information is
    /// not positive definite.
    pub fn new(
        part: Part<'_>,
        poses: Vec<Pose>,
        labels: &[u32],
        reach: Reach,
        ln_area_m2: f64,
    ) -> Option<Self> {
        let linear = Linear::new(part, &poses, None)?;
        let scans = scans(part.observations);
        let view = View::new(reach, &scans, &poses, ln_area_m2);
        let mut fixed = Fixed {
            poses,
            linear,
            view,
            scan_of: scan_of(&scans),
            n_scans: scans.len(),
        };
        let (labels, n) = compact(labels);
        let mut sightings = vec![Vec::new(); n];
        for (s, &label) in labels.iter().enumerate() {
            sightings[label as usize].push(s as u32);
        }
        let seen = sightings
            .iter()
            .map(|of_one| fixed.seen(of_one))
            .collect::<Vec<_>>();
        fixed.view.learn(&seen);
        let (joint, ln_evidence) = fixed.joint(&labels, n)?;
        let landmarks = sightings.into_iter();
        let landmarks = landmarks.map(|of_one| fixed.landmark(of_one)).collect();
        Some(Self {
            now: Association {
                labels,
                landmarks,
                joint,
                ln_evidence,
            },
            fixed,
        })
    }

    /// The number of landmarks.
    pub fn n_landmarks(&self) -> usize {
        self.now.landmarks.len()
    }

    /// ln of the posterior of the partition, up to a constant of this linearisation point.
    pub fn ln_target(&self) -> f64 {
        let m = self.n_landmarks() as f64;
        let costs = self.now.landmarks.iter().map(|one| one.standing.cost());
        let area = m * self.fixed.view.ln_area_m2;
        self.now.ln_evidence + libm::lgamma(m + 1.0) - area - costs.sum::<f64>()
    }

    /// What one landmark fewer gains by area and number, of `n` landmarks: ln A − ln n.
    pub fn ln_fewer(&self, n: usize) -> f64 {
        self.fixed.view.ln_area_m2 - libm::log(n as f64)
    }

    /// Whether a scan saw both.
    pub fn conflict(&self, a: usize, b: usize) -> bool {
        self.now.landmarks[a].conflicts(&self.now.landmarks[b])
    }

    /// The log of how much more probable the partition becomes if two landmarks are joined, roughly
    /// (see [`Standing::gain`]), and dᵀS⁻¹d; `None` if one scan saw both or they are further apart
    /// than `gate`.
    pub fn joining(&self, a: usize, b: usize, gate: f64) -> Option<(f64, f64)> {
        let matched = self.now.joint.match_of(a, b);
        if matched.square_distance > gate || self.conflict(a, b) {
            return None;
        }
        let [of_a, of_b] = [a, b].map(|one| self.now.landmarks[one].standing);
        let prior = self.ln_fewer(self.n_landmarks()) + of_a.gain(of_b);
        Some((matched.ln_density + prior, matched.square_distance))
    }

    /// Joins landmark b to a. The last landmark takes the number of b.
    pub fn join(&mut self, a: usize, b: usize) {
        let now = &mut self.now;
        now.ln_evidence += now.joint.match_of(a, b).ln_density;
        now.joint.identify(a, b);
        let gone = std::mem::take(&mut now.landmarks[b].sightings);
        for &s in &gone {
            now.labels[s as usize] = a as u32;
        }
        now.landmarks[a].sightings.extend(gone);
        let all = std::mem::take(&mut now.landmarks[a].sightings);
        now.landmarks[a] = self.fixed.landmark(all);
        now.joint.swap_remove(b);
        now.landmarks.swap_remove(b);
        if let Some(moved) = now.landmarks.get(b) {
            for &s in &moved.sightings {
                now.labels[s as usize] = b as u32;
            }
        }
    }

    /// What frees some sightings of a landmark, but not all of them; with it ln N(0) of the change:
    /// what the evidence loses when they become a landmark of their own is the density of their
    /// offset at 0.
    pub fn freed(&self, sightings: &[u32]) -> Option<(Freed, f64)> {
        let now = &self.now;
        let (r, own, mut vector) = self.fixed.linear.sums(sightings, &now.labels);
        let gain = now.joint.times_sparse(&r);
        let (mut xx, mut xy, mut yy) = (own[0], 0.5 * (own[1] + own[2]), own[3]);
        for &(label, block) in &r {
            let [gx, gy] =
                [0, 1].map(|column| [gain[column][2 * label], gain[column][2 * label + 1]]);
            xx -= block[0] * gx[0] + block[2] * gx[1];
            xy -= block[0] * gy[0] + block[2] * gy[1];
            yy -= block[1] * gy[0] + block[3] * gy[1];
            let [x, y] = now.joint.mean_m[label];
            vector[0] -= block[0] * x + block[2] * y;
            vector[1] -= block[1] * x + block[3] * y;
        }
        let det = xx * yy - xy * xy;
        if !(xx > 0.0 && det > 0.0) {
            return None;
        }
        let covariance = [yy / det, -xy / det, xx / det];
        let offset_m = [
            covariance[0] * vector[0] + covariance[1] * vector[1],
            covariance[1] * vector[0] + covariance[2] * vector[1],
        ];
        let square_distance = offset_m[0] * vector[0] + offset_m[1] * vector[1];
        let ln_density = -0.5 * square_distance + 0.5 * libm::log(det) - libm::log(TAU);
        let freed = Freed {
            gain,
            offset_m,
            covariance,
        };
        Some((freed, ln_density))
    }

    /// Makes some sightings of a landmark, but not all, a landmark of their own, the last.
    pub fn split(&mut self, sightings: &[u32], freed: &Freed, ln_density: f64) {
        let now = &mut self.now;
        let a = now.labels[sightings[0] as usize] as usize;
        now.ln_evidence -= ln_density;
        now.joint.free(a, freed);
        let new = now.landmarks.len() as u32;
        for &s in sightings {
            now.labels[s as usize] = new;
        }
        let labels = &now.labels;
        let mut left = std::mem::take(&mut now.landmarks[a].sightings);
        left.retain(|&s| labels[s as usize] != new);
        now.landmarks[a] = self.fixed.landmark(left);
        now.landmarks.push(self.fixed.landmark(sightings.to_vec()));
    }

    /// Where the poses go to at the optimum of this partition, to first order.
    pub fn moved_poses(&self) -> Vec<nalgebra::Vector3<f64>> {
        let now = &self.now;
        let place = |s: usize| now.joint.mean_m[now.labels[s] as usize];
        self.fixed.linear.pose_shift(place)
    }
}

impl Landmark {
    /// Whether a scan saw both.
    pub fn conflicts(&self, other: &Self) -> bool {
        self.seen.iter().zip(&other.seen).any(|(a, b)| a & b != 0)
    }

    /// Whether a scan saw it.
    pub fn is_seen_in(&self, scan: usize) -> bool {
        self.seen[scan / 64] >> (scan % 64) & 1 == 1
    }
}

impl Fixed {
    /// The landmark of some sightings.
    pub fn landmark(&self, sightings: Vec<u32>) -> Landmark {
        let mut seen = vec![0; self.n_scans.div_ceil(64)];
        for &s in &sightings {
            let scan = self.scan_of[s as usize];
            seen[scan as usize / 64] |= 1 << (scan % 64);
        }
        Landmark {
            standing: self.standing(&sightings),
            sightings,
            seen,
        }
    }

    /// The joint of the landmarks of a partition into n, and its evidence.
    pub fn joint(&self, labels: &[u32], n: usize) -> Option<(Joint, f64)> {
        let (joint, square, ln_det) = self.linear.joint(labels, n)?;
        let ln_evidence = 0.5 * square - 0.5 * ln_det + n as f64 * libm::log(TAU);
        Some((joint, ln_evidence))
    }

    /// The same for the prior alone.
    pub fn standing(&self, sightings: &[u32]) -> Standing {
        self.view.standing(&self.seen(sightings))
    }

    /// Where and by which scans the landmark of some sightings was seen.
    fn seen(&self, sightings: &[u32]) -> Seen {
        Seen {
            at_m: self.mean_place_m(sightings),
            scans: sightings
                .iter()
                .map(|&s| self.scan_of[s as usize])
                .collect(),
        }
    }

    /// Mean of the places of sightings from the linearisation point, m.
    fn mean_place_m(&self, sightings: &[u32]) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for &s in sightings {
            let [x, y] = self.linear.place_m[s as usize];
            sum = [sum[0] + x, sum[1] + y];
        }
        sum.map(|value| value / sightings.len() as f64)
    }
}

/// The same partition with labels from 0 on in the order of sightings, and how many there are.
pub(super) fn compact(labels: &[u32]) -> (Vec<u32>, usize) {
    let most = labels.iter().max().map_or(0, |&most| most as usize + 1);
    let mut new = vec![u32::MAX; most];
    let mut n = 0;
    let renamed = labels.iter().map(|&label| {
        let name = &mut new[label as usize];
        if *name == u32::MAX {
            *name = n;
            n += 1;
        }
        *name
    });
    (renamed.collect(), n as usize)
}
