//! The prior over partitions, which knows what was in view.
//!
//! A landmark costs ln A, A the explored area, and what it was in view for without being seen. If
//! F_i landmarks are in view of scan i and k_i of them are seen, any k_i of F_i being as probable,
//! one landmark more costs q_i = ln(F_i/(F_i − k_i)), summed over the scans that have it in view.
//! The sum is capped at [`CAP`]; a landmark of few sightings costs less, as it may be clutter: at
//! most 2 + 3n for n sightings. So
//!
//!   ln P(T) = ln M! − M ln A − Σ_m min(CAP, 2 + 3n_m, Σ_{i sees m} q_i).
//!
//! The q_i come from the map at which the mission was linearised and stay until it is linearised
//! anew, so that P is a function of the partition alone. A landmark is in view where the mean of
//! its sightings' places lies within what the sensor reaches: 2 to 95 % of all ranges and the
//! middle 95 % of all bearings. The scans that saw it count always.

use std::f64::consts::PI;

use super::graph::Observation;
use super::linear::Scan;
use crate::sighting::Pose;

/// A landmark's cost for not being seen is at most this, in nats: beyond it the model of the
/// sensor is doubted rather than the landmark.
const CAP: f64 = 20.0;
/// At most these for a landmark of n sightings: a + b·n. One sighting is clutter for 5 nats.
const CLUTTER: [f64; 2] = [2.0, 3.0];
/// F − k is at least this.
const LEAST_UNSEEN: f64 = 0.5;
/// The explored area is the number of cells in view; a cell is so much of the sensor's range.
const CELL: f64 = 0.2;

/// What the sensor reaches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    least_m: f64,
    most_m: f64,
    bearings_rad: [f64; 2],
    /// Directions of the two bearings.
    edges: [[f64; 2]; 2],
}

impl Reach {
    /// From the sightings of a mission.
    pub fn of(observations: &[Observation]) -> Self {
        let sorted = |value: fn(&Observation) -> f64| {
            let mut values: Vec<f64> = observations.iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let quantile = |values: &[f64], share: f64| {
            let place = share * (values.len() - 1) as f64;
            let (low, part) = (place.floor() as usize, place.fract());
            let high = (low + 1).min(values.len() - 1);
            values[low] + part * (values[high] - values[low])
        };
        let ranges = sorted(|one| libm::hypot(one.at_m[0], one.at_m[1]));
        let bearings = sorted(|one| libm::atan2(one.at_m[1], one.at_m[0]));
        let bearings_rad = [quantile(&bearings, 0.025), quantile(&bearings, 0.975)];
        Self {
            least_m: quantile(&ranges, 0.02),
            most_m: quantile(&ranges, 0.95),
            bearings_rad,
            edges: bearings_rad.map(|bearing| {
                let (sin, cos) = libm::sincos(bearing);
                [cos, sin]
            }),
        }
    }

    /// Whether a point in the axes of the robot (m) is within it.
    fn has(&self, [x, y]: [f64; 2]) -> bool {
        let square = x * x + y * y;
        if square >= self.most_m * self.most_m || square <= self.least_m * self.least_m {
            return false;
        }
        let [first, last] = self.edges;
        let beyond_first = first[0] * y - first[1] * x > 0.0;
        let before_last = x * last[1] - y * last[0] > 0.0;
        if self.bearings_rad[1] - self.bearings_rad[0] <= PI {
            beyond_first && before_last
        } else {
            beyond_first || before_last
        }
    }

    /// ln of the area (m²) that scans from these poses have seen, counted in cells.
    pub fn ln_explored_m2(&self, poses: impl Iterator<Item = Pose>) -> f64 {
        let cell_m = self.most_m * CELL;
        let mut cells: Vec<(i64, i64)> = Vec::new();
        for pose in poses {
            for range in 1..=7 {
                let range_m = self.most_m * (0.1 + 0.15 * f64::from(range - 1));
                for step in 0..9 {
                    let share = f64::from(step) / 8.0;
                    let [first, last] = self.bearings_rad;
                    let point = pose.point_at_m(range_m, first + share * (last - first));
                    let [x, y] = point.map(|value| (value / cell_m).floor() as i64);
                    cells.push((x, y));
                }
            }
            // Keeps the list short on long missions.
            if cells.len() > 1 << 20 {
                cells.sort_unstable();
                cells.dedup();
            }
        }
        cells.sort_unstable();
        cells.dedup();
        libm::log(cells.len() as f64 * cell_m * cell_m)
    }
}

/// What was in view, and what it costs not to be seen.
#[derive(Clone, Debug)]
pub(super) struct View {
    reach: Reach,
    eyes: Vec<Eye>,
    /// q_i of each scan.
    pub unseen_cost: Vec<f64>,
    /// ln A, A in m².
    pub ln_area_m2: f64,
}

/// A scan's pose.
#[derive(Clone, Copy, Debug)]
struct Eye {
    at_m: [f64; 2],
    cos: f64,
    sin: f64,
}

/// Where a landmark is, and by which scans it was seen.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    /// m.
    pub at_m: [f64; 2],
    /// In no order.
    pub scans: Vec<u32>,
}

/// A landmark for the prior.
#[derive(Clone, Copy, Debug)]
pub(super) struct Standing {
    /// The number of its sightings.
    pub n: usize,
    /// Σ q_i over the scans that have it in view or saw it.
    pub unseen_cost: f64,
}

impl Standing {
    /// What the landmark costs beside ln A, nats.
    pub fn cost(self) -> f64 {
        let cap = CAP.min(CLUTTER[0] + CLUTTER[1] * self.n as f64);
        self.unseen_cost.min(cap)
    }

    /// Roughly that of both as one: the place of the one with more sightings counts.
    pub fn with(self, other: Self) -> Self {
        let leading = if self.n >= other.n { self } else { other };
        Self {
            n: self.n + other.n,
            unseen_cost: leading.unseen_cost,
        }
    }

    /// What the prior gains by joining two, roughly, beside ln A and the number of landmarks.
    pub fn gain(self, other: Self) -> f64 {
        self.cost() + other.cost() - self.with(other).cost()
    }
}

impl View {
    /// Of scans, before anything is known of landmarks.
    pub fn new(reach: Reach, scans: &[Scan], poses: &[Pose], ln_area_m2: f64) -> Self {
        let eye = |scan: &Scan| {
            let pose = poses[scan.pose];
            let (sin, cos) = libm::sincos(pose.heading_rad);
            Eye {
                at_m: pose.position_m(),
                cos,
                sin,
            }
        };
        Self {
            reach,
            eyes: scans.iter().map(eye).collect(),
            unseen_cost: vec![0.0; scans.len()],
            ln_area_m2,
        }
    }

    /// Whether a scan has a point (m) in view.
    pub fn sees(&self, scan: usize, [x, y]: [f64; 2]) -> bool {
        let eye = &self.eyes[scan];
        let (dx, dy) = (x - eye.at_m[0], y - eye.at_m[1]);
        let ahead = eye.cos * dx + eye.sin * dy;
        self.reach.has([ahead, eye.cos * dy - eye.sin * dx])
    }

    /// How a landmark stands.
    pub fn standing(&self, landmark: &Seen) -> Standing {
        self.standing_at(landmark, &self.unseen_cost)
    }

    /// The same at other costs of the scans.
    fn standing_at(&self, landmark: &Seen, costs: &[f64]) -> Standing {
        let sees = |scan: usize| self.sees(scan, landmark.at_m);
        let in_view = (0..self.eyes.len()).filter(|&scan| sees(scan));
        let in_view: f64 = in_view.map(|scan| costs[scan]).sum();
        let scans = landmark.scans.iter().map(|&scan| scan as usize);
        let beyond = scans.filter(|&scan| !sees(scan));
        let beyond: f64 = beyond.map(|scan| costs[scan]).sum();
        Standing {
            n: landmark.scans.len(),
            unseen_cost: in_view + beyond,
        }
    }

    /// Learns q from a map, of which the landmarks of two and more sightings count. Gives for each
    /// scan an equal share of ln F_i!/(F_i − k_i)! for each landmark in view: the whole cost of
    /// seeing these landmarks and no others.
    pub fn learn(&mut self, landmarks: &[Seen]) -> Vec<f64> {
        let n = self.eyes.len();
        let (mut in_view, mut seen) = (vec![0.0; n], vec![0.0; n]);
        for landmark in landmarks.iter().filter(|one| one.scans.len() > 1) {
            for (scan, count) in in_view.iter_mut().enumerate() {
                if self.sees(scan, landmark.at_m) {
                    *count += 1.0;
                }
            }
            for scan in landmark.scans.iter().map(|&scan| scan as usize) {
                seen[scan] += 1.0;
                if !self.sees(scan, landmark.at_m) {
                    in_view[scan] += 1.0;
                }
            }
        }
        let mut shares = vec![0.0; n];
        for (scan, cost) in self.unseen_cost.iter_mut().enumerate() {
            let (f, k): (f64, f64) = (in_view[scan], seen[scan]);
            if f > 0.0 {
                *cost = libm::log(f / (f - k).max(LEAST_UNSEEN));
                shares[scan] = (libm::lgamma(f + 1.0) - libm::lgamma(f - k + 1.0)) / f;
            } else {
                *cost = 0.0;
            }
        }
        shares
    }

    /// What a whole map costs beside ln A: the sum over landmarks of their shares, and of q for
    /// those of one sighting, capped as in the search.
    pub fn whole_cost(&mut self, landmarks: &[Seen]) -> f64 {
        let shares = self.learn(landmarks);
        let costs = landmarks.iter().map(|landmark| {
            let cost = match landmark.scans.len() {
                1 => &self.unseen_cost,
                _ => &shares,
            };
            self.standing_at(landmark, cost).cost()
        });
        costs.sum()
    }
}
