//! Straight lines through the plane: a uniform one, and how many part two sets of points.
//!
//! Lines have one measure that no motion of the plane changes: dφ dp, with φ the direction of the
//! normal and p the distance from the origin. Those that meet a convex set have the length of its
//! boundary as their measure, so those that cross a segment have twice its length. The lines that
//! part two sets A and B are those that part the origin from all differences b − a: the measure is
//!
//! s(A, B) = L(conv({b − a} ∪ {0})) − L(conv A) − L(conv B),
//!
//! L the perimeter; it is 0 where the hulls meet.
//!
//! Source: Santaló, Integral Geometry and Geometric Probability (1976), chapter 3.

use crate::sampler::choices::Random;

/// A point of the plane.
type Point = [f64; 2];

/// Shares of a perimeter below this are rounding.
const ROUNDING: f64 = 1e-9;

/// A line by a point of it and a normal.
pub(super) struct Line {
    through: Point,
    normal: Point,
}

impl Line {
    /// A uniform one of those that cross the segment between two points: through a uniform point of
    /// it, at an angle with density ½ sin.
    pub(super) fn across(from: Point, to: Point, random: &mut impl Random) -> Self {
        let along = random.uniform();
        let cos = 2.0 * random.uniform() - 1.0;
        let sin = (1.0 - cos * cos).sqrt();
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        Self {
            through: [from[0] + along * dx, from[1] + along * dy],
            // The line has the direction (cos, sin) beside the segment.
            normal: [sin * dx + cos * dy, sin * dy - cos * dx],
        }
    }

    /// Whether a point is on the side of the end of the segment.
    pub(super) fn is_beyond(&self, point: Point) -> bool {
        let [dx, dy] = [point[0] - self.through[0], point[1] - self.through[1]];
        self.normal[0] * dx + self.normal[1] * dy > 0.0
    }
}

/// Working space.
#[derive(Default)]
pub(super) struct Parting {
    points: Vec<Point>,
    hulls: [Vec<Point>; 2],
    hull: Vec<Point>,
}

impl Parting {
    /// s(A, B): the measure of the lines that part two sets of points, in their unit. `None` where
    /// none does, but for rounding.
    pub(super) fn measure(
        &mut self,
        first: impl Iterator<Item = Point>,
        second: impl Iterator<Item = Point>,
    ) -> Option<f64> {
        let Self {
            points,
            hulls: [one, other],
            hull,
        } = self;
        points.clear();
        points.extend(first);
        convex_hull(points, one);
        points.clear();
        points.extend(second);
        convex_hull(points, other);
        points.clear();
        points.push([0.0; 2]);
        for a in &*one {
            points.extend(other.iter().map(|b| [b[0] - a[0], b[1] - a[1]]));
        }
        convex_hull(points, hull);
        let (whole, own) = (perimeter(hull), perimeter(one) + perimeter(other));
        (whole - own > ROUNDING * whole).then_some(whole - own)
    }
}

/// The corners of the convex hull, counter-clockwise; sorts the points (Andrew 1979).
fn convex_hull(points: &mut Vec<Point>, hull: &mut Vec<Point>) {
    points.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    hull.clear();
    let mut half = |points: &mut dyn Iterator<Item = &Point>| {
        let start = hull.len();
        for &point in points {
            while hull.len() >= start + 2 && !turns_left(&hull[hull.len() - 2..], point) {
                hull.pop();
            }
            hull.push(point);
        }
        // It opens the other half.
        if hull.len() > 1 {
            hull.pop();
        }
    };
    half(&mut points.iter());
    if points.len() > 1 {
        half(&mut points.iter().rev());
    }
}

fn turns_left(last: &[Point], point: Point) -> bool {
    let [a, b] = [last[0], last[1]];
    (b[0] - a[0]) * (point[1] - a[1]) - (b[1] - a[1]) * (point[0] - a[0]) > 0.0
}

/// That of a hull: twice its length if it is a segment.
fn perimeter(hull: &[Point]) -> f64 {
    let next = hull.iter().cycle().skip(1);
    let sides = hull.iter().zip(next);
    sides
        .map(|(a, b)| ((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1])).sqrt())
        .sum()
}
