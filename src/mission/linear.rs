//! The mission linearised at given poses, with the poses integrated out.
//!
//! Sighting s says l = v_s + B_s dp_k + e_s: v_s is its place from the linearisation point, B_s
//! (2×3) moves it with its pose, e_s has information N_s. The poses have information H_p (odometry
//! plus Σ BᵀNB) whatever sightings are of one landmark, so one elimination serves all partitions.
//! What is left is an information between sightings,
//!
//!   Λ_{st} = δ_{st} N_s − N_s B_s Σ_{k(s),k(t)} B_tᵀ N_t,   h_s = N_s v_s + N_s B_s y₀,
//!
//! Σ = H_p⁻¹, y₀ = Ση, of which a partition adds up rows and columns: with Z the membership of
//! sightings in landmarks, the landmarks have information ZᵀΛZ and information vector Zᵀh. Λ is
//! never made. From scan i to the next Σ_{i,·} = Γ_i Σ_{i+1,·}, so sums over it are two passes over
//! the scans, each as long as correlations last.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x2, Vector2, Vector3};

use super::graph::{Observation, Odometry, Part};
use super::joint::{Block, Joint};
use super::poses::{PoseFactor, PoseInformation};
use crate::sighting::{Pose, wrap_rad};

/// Correlations of poses below this are taken for zero. The information is multiplied by
/// coordinates, so far from the origin what is left out would move the optimum.
const NEGLIGIBLE: f64 = 1e-15;

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct Linear {
    /// h_s.
    vector: Vec<[f64; 2]>,
    /// v_s, m.
    pub place_m: Vec<[f64; 2]>,
    /// N_s.
    weight: Vec<Matrix2<f64>>,
    /// N_sB_s.
    weighted: Vec<Matrix2x3<f64>>,
    scans: Vec<ScanLaw>,
    scan_of: Vec<u32>,
    factor: PoseFactor,
    /// η.
    gradient: Vec<Vector3<f64>>,
}

/// The pose of a scan.
#[derive(Clone, Debug)]
struct ScanLaw {
    pose: usize,
    first: usize,
    end: usize,
    /// Σ_{i,i}.
    covariance: Matrix3<f64>,
    /// 1/√ of its diagonal; 0 for the first pose, which is known.
    scale: [f64; 3],
    /// Γ_i; that of the last scan is never asked for.
    back: Matrix3<f64>,
}

impl Linear {
    /// Linearises at `poses`. A sighting turns with its pose about the pose, with the arm to
    /// `points_m` where they are given (the landmarks, for Gauss–Newton), else to where it was
    /// seen. `None` if the information of the poses is not positive definite.
    pub fn new(part: Part<'_>, poses: &[Pose], points_m: Option<&[[f64; 2]]>) -> Option<Self> {
        let (mut information, mut gradient) = of_odometry(part.odometry, poses);
        let n = part.observations.len();
        let mut lines = Lines {
            weight: Vec::with_capacity(n),
            weighted: Vec::with_capacity(n),
            place_m: Vec::with_capacity(n),
        };
        for (s, one) in part.observations.iter().enumerate() {
            let moves = lines.push(one, poses[one.pose], points_m.map(|points| points[s]));
            let weighted = lines.weighted[s];
            information.diagonal[one.pose] += moves.tr_mul(&weighted);
            gradient[one.pose] -= weighted.tr_mul(&Vector2::from(lines.place_m[s]));
        }
        let factor = information.factor()?;
        let mut shift = gradient.clone();
        factor.solve(&mut shift);
        let vector = part.observations.iter().enumerate().map(|(s, one)| {
            let place = Vector2::from(lines.place_m[s]);
            (lines.weight[s] * place + lines.weighted[s] * shift[one.pose]).into()
        });
        let scans = scans(part.observations);
        Some(Self {
            vector: vector.collect(),
            place_m: lines.place_m,
            weight: lines.weight,
            weighted: lines.weighted,
            scan_of: scan_of(&scans),
            scans: laws(&scans, &factor),
            factor,
            gradient,
        })
    }

    /// ½ ln det H_p.
    pub fn half_ln_det_poses(&self) -> f64 {
        self.factor.half_ln_det
    }

    /// The joint of the landmarks of a partition into n sets, gᵀCg, and ln det of their
    /// information; `None` if it is not positive definite.
    pub fn joint(&self, labels: &[u32], n: usize) -> Option<(Joint, f64, f64)> {
        let stride = (2 * n).next_multiple_of(8) + 8;
        let information = self.information(labels, n, stride);
        let mut vector = vec![[0.0; 2]; n];
        for (&a, h) in labels.iter().zip(&self.vector) {
            vector[a as usize][0] += h[0];
            vector[a as usize][1] += h[1];
        }
        let (joint, ln_det) = Joint::of_information(information, stride, &vector)?;
        let means = joint.mean_m.iter().zip(&vector);
        let square = means.map(|(x, g)| x[0] * g[0] + x[1] * g[1]).sum();
        Some((joint, square, ln_det))
    }

    /// ZᵀΛZ in rows of `stride` numbers. Going through the scans, W_j = (W_{j−1} + F_{j−1}ᵀ)Γ_{j−1}
    /// keeps for each landmark what its earlier sightings have in common with scan j, F = BᵀN.
    fn information(&self, labels: &[u32], n: usize, stride: usize) -> Vec<f64> {
        let mut sums = Sums {
            matrix: vec![0.0; stride * stride],
            stride,
        };
        let size = |weighted: &Matrix2x3<f64>| weighted.amax();
        let negligible = NEGLIGIBLE * self.weighted.iter().map(size).fold(0.0, f64::max);
        let mut carried = vec![Matrix2x3::zeros(); n];
        let mut active: Vec<usize> = Vec::new();
        let mut is_active = vec![false; n];
        for scan in &self.scans {
            let sightings = scan.first..scan.end;
            let of_scan = || sightings.clone().zip(&labels[sightings.clone()]);
            for (s, &a) in of_scan() {
                let a = a as usize;
                let here = scan.covariance * self.weighted[s].transpose();
                sums.add(a, a, &self.weight[s]);
                for &b in &active {
                    sums.add_both(b, a, &-(carried[b] * here));
                }
                for (t, &b) in of_scan() {
                    sums.add(b as usize, a, &-(self.weighted[t] * here));
                }
            }
            for (s, &a) in of_scan() {
                let a = a as usize;
                carried[a] += self.weighted[s];
                if !is_active[a] {
                    is_active[a] = true;
                    active.push(a);
                }
            }
            active.retain(|&a| {
                carried[a] *= scan.back;
                is_active[a] = size(&carried[a]) > negligible;
                if !is_active[a] {
                    carried[a] = Matrix2x3::zeros();
                }
                is_active[a]
            });
        }
        sums.matrix
    }

    /// Sums over the rows of Λ of some sightings: for each landmark that has any, the sum over its
    /// sightings t of Λ_{t,s}; the same over the block itself; and Σ h_s.
    pub fn sums(&self, block: &[u32], labels: &[u32]) -> (Vec<(usize, Block)>, Block, [f64; 2]) {
        let label = labels[block[0] as usize];
        let n = labels.iter().max().map_or(0, |&most| most as usize + 1);
        let mut place_of = vec![usize::MAX; n];
        let mut by_landmark: Vec<(usize, Block)> = Vec::new();
        let mut own = Matrix2::zeros();
        let (first, responses) = self.responses(block);
        for (scan, response) in self.scans[first..].iter().zip(&responses) {
            let sightings = scan.first..scan.end;
            for (t, &of_t) in sightings.clone().zip(&labels[sightings]) {
                let mut sum = -(self.weighted[t] * response);
                if of_t == label && block.contains(&(t as u32)) {
                    sum += self.weight[t];
                    own += sum;
                }
                let a = of_t as usize;
                if place_of[a] == usize::MAX {
                    place_of[a] = by_landmark.len();
                    by_landmark.push((a, [0.0; 4]));
                }
                let sums = by_landmark[place_of[a]].1.iter_mut();
                let values = [sum.m11, sum.m12, sum.m21, sum.m22];
                sums.zip(values).for_each(|(sum, value)| *sum += value);
            }
        }
        let mut vector = [0.0; 2];
        for &s in block {
            vector[0] += self.vector[s as usize][0];
            vector[1] += self.vector[s as usize][1];
        }
        (by_landmark, [own.m11, own.m12, own.m21, own.m22], vector)
    }

    /// Σ over the block of Σ_{i,k(s)} B_sᵀN_s for the scans i where it matters, from the first of
    /// them on.
    fn responses(&self, block: &[u32]) -> (usize, Vec<Matrix3x2<f64>>) {
        let scan_of = |s: &u32| self.scan_of[*s as usize] as usize;
        let low = block.iter().map(scan_of).min().unwrap_or(0);
        let high = block.iter().map(scan_of).max().unwrap_or(0);
        let mut sources = vec![Matrix3x2::zeros(); high - low + 1];
        for s in block {
            sources[scan_of(s) - low] += self.weighted[*s as usize].transpose();
        }
        let scaled = |scan: &ScanLaw, response: &Matrix3x2<f64>| {
            let size = |row: usize| response[(row, 0)].abs().max(response[(row, 1)].abs());
            (0..3)
                .map(|row| size(row) * scan.scale[row])
                .fold(0.0, f64::max)
        };
        let mut largest: f64 = 0.0;
        let mut down = Vec::new();
        let mut response = Matrix3x2::zeros();
        for i in (0..=high).rev() {
            let scan = &self.scans[i];
            response = scan.back * response;
            if i >= low {
                response += scan.covariance * sources[i - low];
            }
            let size = scaled(scan, &response);
            largest = largest.max(size);
            down.push(response);
            if i < low && size < NEGLIGIBLE * largest {
                break;
            }
        }
        down.reverse();
        let first = high + 1 - down.len();
        let mut carried = Matrix3x2::zeros();
        for i in low + 1..self.scans.len() {
            if let Some(source) = sources.get(i - 1 - low) {
                carried += source;
            }
            carried = self.scans[i - 1].back.tr_mul(&carried);
            let response = self.scans[i].covariance * carried;
            match down.get_mut(i - first) {
                Some(sum) => *sum += response,
                None => down.push(response),
            }
            if i > high && scaled(&self.scans[i], &response) < NEGLIGIBLE * largest {
                break;
            }
        }
        (first, down)
    }

    /// How the poses move from the linearisation point if the landmark of sighting s lies at
    /// `landmark_m(s)`: dp = H_p⁻¹(η + Σ BᵀN l), (m, m, rad) for each pose.
    pub fn pose_shift(&self, landmark_m: impl Fn(usize) -> [f64; 2]) -> Vec<Vector3<f64>> {
        let mut right = self.gradient.clone();
        for (s, weighted) in self.weighted.iter().enumerate() {
            let pose = self.scans[self.scan_of[s] as usize].pose;
            right[pose] += weighted.tr_mul(&Vector2::from(landmark_m(s)));
        }
        self.factor.solve(&mut right);
        right
    }
}

/// What is kept of sightings while the band is made.
struct Lines {
    weight: Vec<Matrix2<f64>>,
    weighted: Vec<Matrix2x3<f64>>,
    place_m: Vec<[f64; 2]>,
}

impl Lines {
    /// Appends a sighting and gives its B_s.
    fn push(&mut self, one: &Observation, pose: Pose, point_m: Option<[f64; 2]>) -> Matrix2x3<f64> {
        let (place, weight) = one.in_frame(pose);
        let place: [f64; 2] = place.into();
        let [x, y] = point_m.unwrap_or(place);
        let arm = [x - pose.x_m, y - pose.y_m];
        let moves = Matrix2x3::new(1.0, 0.0, -arm[1], 0.0, 1.0, arm[0]);
        self.weight.push(weight);
        self.weighted.push(weight * moves);
        self.place_m.push(place);
        moves
    }
}

/// Information and gradient of the odometry.
fn of_odometry(odometry: &[Odometry], poses: &[Pose]) -> (PoseInformation, Vec<Vector3<f64>>) {
    let n = odometry.len() + 1;
    let mut information = PoseInformation {
        diagonal: vec![Matrix3::zeros(); n],
        coupling: Vec::with_capacity(n - 1),
    };
    let mut gradient = vec![Vector3::zeros(); n];
    for (k, edge) in odometry.iter().enumerate() {
        let (residual, [before, after]) = residual(edge, poses[k], poses[k + 1]);
        let (to_before, to_after) = (
            before.tr_mul(&edge.information),
            after.tr_mul(&edge.information),
        );
        information.diagonal[k] += to_before * before;
        information.diagonal[k + 1] += to_after * after;
        information.coupling.push(to_before * after);
        gradient[k] -= to_before * residual;
        gradient[k + 1] -= to_after * residual;
    }
    (information, gradient)
}

/// The error of odometry (m, m, rad in the axes of the next pose) and its derivatives by both
/// poses.
pub(super) fn residual(
    edge: &Odometry,
    before: Pose,
    after: Pose,
) -> (Vector3<f64>, [Matrix3<f64>; 2]) {
    let (sin, cos) = libm::sincos(before.heading_rad);
    let (dx, dy) = (after.x_m - before.x_m, after.y_m - before.y_m);
    let (ahead, left) = (cos * dx + sin * dy, cos * dy - sin * dx);
    let z = edge.relative;
    let turned = wrap_rad(after.heading_rad - before.heading_rad - z.heading_rad);
    let (sin_z, cos_z) = libm::sincos(z.heading_rad);
    let back = Matrix3::new(cos_z, sin_z, 0.0, -sin_z, cos_z, 0.0, 0.0, 0.0, 1.0);
    let by_before = Matrix3::new(-cos, -sin, left, sin, -cos, -ahead, 0.0, 0.0, -1.0);
    let by_after = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
    (
        back * Vector3::new(ahead - z.x_m, left - z.y_m, turned),
        [back * by_before, back * by_after],
    )
}

/// A symmetric matrix of 2×2 blocks that is being added up.
struct Sums {
    matrix: Vec<f64>,
    stride: usize,
}

impl Sums {
    fn add(&mut self, a: usize, b: usize, block: &Matrix2<f64>) {
        let top = 2 * a * self.stride + 2 * b;
        self.matrix[top] += block.m11;
        self.matrix[top + 1] += block.m12;
        self.matrix[top + self.stride] += block.m21;
        self.matrix[top + self.stride + 1] += block.m22;
    }

    fn add_both(&mut self, a: usize, b: usize, block: &Matrix2<f64>) {
        self.add(a, b, block);
        self.add(b, a, &block.transpose());
    }
}

/// The sightings of one pose.
pub(super) struct Scan {
    pub pose: usize,
    pub first: usize,
    pub end: usize,
}

/// Sightings by pose.
pub(super) fn scans(observations: &[Observation]) -> Vec<Scan> {
    let mut scans: Vec<Scan> = Vec::new();
    for (s, one) in observations.iter().enumerate() {
        match scans.last_mut() {
            Some(scan) if scan.pose == one.pose => scan.end = s + 1,
            _ => scans.push(Scan {
                pose: one.pose,
                first: s,
                end: s + 1,
            }),
        }
    }
    scans
}

/// The scan of each sighting.
pub(super) fn scan_of(scans: &[Scan]) -> Vec<u32> {
    let of_each = scans.iter().enumerate();
    let of_each = of_each.flat_map(|(scan, one)| (one.first..one.end).map(move |_| scan as u32));
    of_each.collect()
}

/// The laws of the poses of scans.
fn laws(scans: &[Scan], factor: &PoseFactor) -> Vec<ScanLaw> {
    let covariances = factor.covariances();
    let law = |(i, scan): (usize, &Scan)| {
        let covariance = covariances[scan.pose];
        let next = scans.get(i + 1).map_or(scan.pose, |next| next.pose);
        ScanLaw {
            pose: scan.pose,
            first: scan.first,
            end: scan.end,
            covariance,
            scale: [0, 1, 2].map(|axis| match covariance[(axis, axis)] {
                variance if variance > 0.0 => 1.0 / variance.sqrt(),
                _ => 0.0,
            }),
            back: factor.step_back(scan.pose, next),
        }
    };
    scans.iter().enumerate().map(law).collect()
}
