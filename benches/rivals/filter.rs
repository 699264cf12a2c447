//! An extended Kalman filter over the pose and all landmarks (Smith, Self & Cheeseman 1990), which
//! decides each scan for good: by the cheapest exclusive assignment within a gate of 99.9 %, or by
//! joint compatibility (Neira & Tardós, IEEE T-RA 17(6), 2001). Every fifty poses the graph so far is
//! optimised with the ids so far, and the filter is run again along the optimum, so that it never
//! suffers long from what it was linearised at.

use nalgebra::{DMatrix, DVector, Matrix2, Matrix2x3, Matrix3, Vector2};
use topometric::mission::{Graph, Observation, Odometry, optimum_of};
use topometric::sighting::{Pose, wrap_rad};

use super::assignment::cheapest;

/// 99.9 % of χ² with 2, 4, 6, … degrees of freedom.
const GATES: [f64; 12] = [
    13.816, 18.467, 22.458, 26.124, 29.588, 32.909, 36.123, 39.252, 42.312, 45.315, 48.268, 51.179,
];
/// Poses between two optima of the graph so far.
const EVERY: usize = 50;
/// Nodes that a search for a joint hypothesis may look at.
const MOST_NODES: usize = 20_000;
/// The cost of a pairing outside the gate.
const FAR: f64 = 1e6;

/// How a scan is decided.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Association {
    Exclusive,
    Joint,
}

struct Filter {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
}

/// A sighting that may be of a landmark.
struct Pairing {
    error: Vector2<f64>,
    by_pose: Matrix2x3<f64>,
    by_landmark: Matrix2<f64>,
    square: f64,
    ln_det: f64,
}

/// The landmark of each sighting.
pub fn labels(graph: &Graph, how: Association) -> Vec<u32> {
    let mut filter = Filter {
        mean: DVector::from_vec(vec![
            graph.start.x_m,
            graph.start.y_m,
            graph.start.heading_rad,
        ]),
        covariance: DMatrix::zeros(3, 3),
    };
    let mut labels = vec![0; graph.observations.len()];
    let mut next = 0;
    for pose in 0..graph.times_s.len() {
        if pose > 0 && pose % EVERY == 0 && next > 0 {
            filter.optimise(graph, pose, &labels[..next]);
        }
        if pose > 0 {
            let after = filter.pose().then(graph.odometry[pose - 1].relative);
            filter.predict(&graph.odometry[pose - 1], after);
        }
        let first = next;
        while graph
            .observations
            .get(next)
            .is_some_and(|one| one.pose == pose)
        {
            next += 1;
        }
        let scan = &graph.observations[first..next];
        let pairings: Vec<Vec<Pairing>> = scan.iter().map(|one| filter.pairings(one)).collect();
        let said = match how {
            _ if scan.is_empty() || filter.n_landmarks() == 0 => vec![None; scan.len()],
            Association::Exclusive => exclusive(&pairings),
            Association::Joint => filter.joint(scan, &pairings),
        };
        for (s, one) in scan.iter().enumerate() {
            labels[first + s] = match said[s] {
                Some(landmark) => {
                    let shift = filter.update(one, landmark);
                    filter.mean += shift;
                    filter.mean[2] = wrap_rad(filter.mean[2]);
                    landmark as u32
                }
                None => filter.add(one) as u32,
            };
        }
    }
    labels
}

fn exclusive(pairings: &[Vec<Pairing>]) -> Vec<Option<usize>> {
    // A column more for each sighting: to be of no known landmark.
    let costs: Vec<Vec<f64>> = pairings
        .iter()
        .map(|of_one| {
            let cost = |one: &Pairing| match one.square < GATES[0] {
                true => one.square + one.ln_det - 100.0,
                false => FAR,
            };
            let none = vec![0.0; pairings.len()];
            of_one.iter().map(cost).chain(none).collect()
        })
        .collect();
    let assigned = cheapest(&costs).into_iter().enumerate();
    let assigned = assigned.map(|(s, column)| {
        let is_near = pairings[s]
            .get(column)
            .is_some_and(|one| one.square < GATES[0]);
        is_near.then_some(column)
    });
    assigned.collect()
}

fn covariance_of(one: &Observation) -> Matrix2<f64> {
    let [xx, xy, yy] = one.information;
    Matrix2::new(xx, xy, xy, yy).try_inverse().unwrap()
}

impl Filter {
    fn n_landmarks(&self) -> usize {
        (self.mean.len() - 3) / 2
    }

    fn pose(&self) -> Pose {
        Pose {
            x_m: self.mean[0],
            y_m: self.mean[1],
            heading_rad: self.mean[2],
        }
    }

    /// Goes on to the next pose.
    fn predict(&mut self, edge: &Odometry, after: Pose) {
        let before = self.pose();
        let (dx, dy) = (after.x_m - before.x_m, after.y_m - before.y_m);
        let moves = Matrix3::new(1.0, 0.0, -dy, 0.0, 1.0, dx, 0.0, 0.0, 1.0);
        let (sin, cos) = after.heading_rad.sin_cos();
        let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let noise = turn * edge.information.try_inverse().unwrap() * turn.transpose();
        let rows = moves * self.covariance.rows(0, 3);
        self.covariance.rows_mut(0, 3).copy_from(&rows);
        let columns = self.covariance.columns(0, 3) * moves.transpose();
        self.covariance.columns_mut(0, 3).copy_from(&columns);
        let mut own = self.covariance.fixed_view_mut::<3, 3>(0, 0);
        own += noise;
        (self.mean[0], self.mean[1]) = (after.x_m, after.y_m);
        self.mean[2] = wrap_rad(after.heading_rad);
    }

    /// One for each landmark.
    fn pairings(&self, one: &Observation) -> Vec<Pairing> {
        let noise = covariance_of(one);
        let pairing = |landmark| {
            let (error, by_pose, by_landmark) = self.predicted(one, landmark);
            let at = 3 + 2 * landmark;
            let own = self.covariance.fixed_view::<3, 3>(0, 0);
            let shared = self.covariance.fixed_view::<3, 2>(0, at);
            let of_landmark = self.covariance.fixed_view::<2, 2>(at, at);
            let cross = by_pose * shared * by_landmark.transpose();
            let spread = by_pose * own * by_pose.transpose()
                + cross
                + cross.transpose()
                + by_landmark * of_landmark * by_landmark.transpose()
                + noise;
            let square = spread
                .try_inverse()
                .map_or(FAR, |inverse| error.dot(&(inverse * error)));
            Pairing {
                error,
                by_pose,
                by_landmark,
                square,
                ln_det: spread.determinant().ln(),
            }
        };
        (0..self.n_landmarks()).map(pairing).collect()
    }

    /// Seen less expected, and how what is expected moves with pose and landmark.
    fn predicted(
        &self,
        one: &Observation,
        landmark: usize,
    ) -> (Vector2<f64>, Matrix2x3<f64>, Matrix2<f64>) {
        let at = 3 + 2 * landmark;
        let (sin, cos) = self.mean[2].sin_cos();
        let (dx, dy) = (
            self.mean[at] - self.mean[0],
            self.mean[at + 1] - self.mean[1],
        );
        let expected = Vector2::new(cos * dx + sin * dy, cos * dy - sin * dx);
        (
            Vector2::from(one.at_m) - expected,
            Matrix2x3::new(-cos, -sin, expected.y, sin, -cos, -expected.x),
            Matrix2::new(cos, sin, -sin, cos),
        )
    }

    /// The filter along the optimum of the first poses with these ids; as it is where there is none.
    fn optimise(&mut self, graph: &Graph, n_poses: usize, labels: &[u32]) {
        let first = Graph {
            start: graph.start,
            times_s: graph.times_s[..n_poses].to_vec(),
            odometry: graph.odometry[..n_poses - 1].to_vec(),
            observations: graph.observations[..labels.len()].to_vec(),
        };
        let Ok(found) = optimum_of(&first, labels) else {
            return;
        };
        self.mean.resize_vertically_mut(3, 0.0);
        self.covariance = DMatrix::zeros(3, 3);
        let mut sightings = first.observations.iter().zip(labels).peekable();
        for (k, &pose) in found.poses.iter().enumerate() {
            if k > 0 {
                self.predict(&first.odometry[k - 1], pose);
            }
            (self.mean[0], self.mean[1], self.mean[2]) = (pose.x_m, pose.y_m, pose.heading_rad);
            while let Some((one, &label)) = sightings.next_if(|(one, _)| one.pose == k) {
                let landmark = label as usize;
                if landmark == self.n_landmarks() {
                    self.add(one);
                    let at = 3 + 2 * landmark;
                    [self.mean[at], self.mean[at + 1]] = found.landmarks_m[landmark];
                } else {
                    self.update(one, landmark);
                }
            }
        }
    }

    /// Makes a sighting known to the covariance; gives how it moves the mean.
    fn update(&mut self, one: &Observation, landmark: usize) -> DVector<f64> {
        let (error, by_pose, by_landmark) = self.predicted(one, landmark);
        let at = 3 + 2 * landmark;
        let gain = self.covariance.columns(0, 3) * by_pose.transpose()
            + self.covariance.columns(at, 2) * by_landmark.transpose();
        let spread =
            by_pose * gain.rows(0, 3) + by_landmark * gain.rows(at, 2) + covariance_of(one);
        let inverse = spread.try_inverse().unwrap();
        let weighted = &gain * inverse;
        let shift = &weighted * error;
        self.covariance -= weighted * gain.transpose();
        // Rounding would make it lopsided, and more so with every scan.
        self.covariance = 0.5 * (&self.covariance + self.covariance.transpose());
        shift
    }

    /// A landmark more; gives its number.
    fn add(&mut self, one: &Observation) -> usize {
        let n = self.mean.len();
        let (sin, cos) = self.mean[2].sin_cos();
        let turn = Matrix2::new(cos, -sin, sin, cos);
        let arm = turn * Vector2::from(one.at_m);
        let moves = Matrix2x3::new(1.0, 0.0, -arm.y, 0.0, 1.0, arm.x);
        let shared = moves * self.covariance.rows(0, 3);
        let own = moves * self.covariance.fixed_view::<3, 3>(0, 0) * moves.transpose()
            + turn * covariance_of(one) * turn.transpose();
        let place = [self.mean[0] + arm.x, self.mean[1] + arm.y];
        let mean = std::mem::replace(&mut self.mean, DVector::zeros(0));
        self.mean = mean.push(place[0]).push(place[1]);
        let covariance = std::mem::replace(&mut self.covariance, DMatrix::zeros(0, 0));
        self.covariance = covariance.resize(n + 2, n + 2, 0.0);
        self.covariance.view_mut((n, 0), (2, n)).copy_from(&shared);
        self.covariance
            .view_mut((0, n), (n, 2))
            .copy_from(&shared.transpose());
        self.covariance.view_mut((n, n), (2, 2)).copy_from(&own);
        (n - 3) / 2
    }

    /// The hypothesis with the most pairings that are jointly within the gate; of equals the
    /// nearest.
    fn joint(&self, scan: &[Observation], pairings: &[Vec<Pairing>]) -> Vec<Option<usize>> {
        let mut search = Search {
            filter: self,
            scan,
            pairings,
            best: vec![None; scan.len()],
            most: (0, f64::INFINITY),
            nodes: 0,
        };
        search.go_on(&mut Vec::new());
        search.best
    }
}

struct Search<'a> {
    filter: &'a Filter,
    scan: &'a [Observation],
    pairings: &'a [Vec<Pairing>],
    best: Vec<Option<usize>>,
    /// Pairings of the best, and their joint distance, squared.
    most: (usize, f64),
    nodes: usize,
}

impl Search<'_> {
    fn go_on(&mut self, said: &mut Vec<Option<usize>>) {
        self.nodes += 1;
        let s = said.len();
        let n_said = said.iter().flatten().count();
        if s == self.scan.len() {
            let square = self.square(said).unwrap_or(f64::INFINITY);
            if n_said > self.most.0 || n_said == self.most.0 && square < self.most.1 {
                self.most = (n_said, square);
                self.best.clone_from(said);
            }
            return;
        }
        if self.nodes > MOST_NODES {
            return;
        }
        let near = self.pairings[s].iter().enumerate();
        let near = near.filter(|(_, one)| one.square < GATES[0]);
        let mut near: Vec<(usize, f64)> = near.map(|(b, one)| (b, one.square)).collect();
        near.sort_by(|a, b| a.1.total_cmp(&b.1));
        for (b, _) in near {
            if said.contains(&Some(b)) {
                continue;
            }
            said.push(Some(b));
            let gate = GATES[n_said.min(GATES.len() - 1)];
            if self.square(said).is_some_and(|square| square < gate) {
                self.go_on(said);
            }
            said.pop();
        }
        // Without this one it can still be as good as the best.
        if n_said + self.scan.len() - s > self.most.0 {
            said.push(None);
            self.go_on(said);
            said.pop();
        }
    }

    /// The joint distance of what is said, squared.
    fn square(&self, said: &[Option<usize>]) -> Option<f64> {
        let pairs: Vec<(usize, usize)> = said
            .iter()
            .enumerate()
            .filter_map(|(s, b)| Some((s, (*b)?)))
            .collect();
        let n = 2 * pairs.len();
        let mut errors = DVector::zeros(n);
        let mut spread = DMatrix::zeros(n, n);
        let covariance = &self.filter.covariance;
        for (i, &(s, a)) in pairs.iter().enumerate() {
            let of_a = &self.pairings[s][a];
            errors.rows_mut(2 * i, 2).copy_from(&of_a.error);
            for (j, &(t, b)) in pairs.iter().enumerate() {
                let of_b = &self.pairings[t][b];
                let (at_a, at_b) = (3 + 2 * a, 3 + 2 * b);
                let block =
                    of_a.by_pose * covariance.fixed_view::<3, 3>(0, 0) * of_b.by_pose.transpose()
                        + of_a.by_pose
                            * covariance.fixed_view::<3, 2>(0, at_b)
                            * of_b.by_landmark.transpose()
                        + of_a.by_landmark
                            * covariance.fixed_view::<2, 3>(at_a, 0)
                            * of_b.by_pose.transpose()
                        + of_a.by_landmark
                            * covariance.fixed_view::<2, 2>(at_a, at_b)
                            * of_b.by_landmark.transpose();
                let mut own = spread.view_mut((2 * i, 2 * j), (2, 2));
                own.copy_from(&block);
                if i == j {
                    own += covariance_of(&self.scan[s]);
                }
            }
        }
        let root = spread.cholesky()?;
        Some(errors.dot(&root.solve(&errors)))
    }
}
