//! Points, lines and polygons in the plane, with one tolerance for "touches".

/// A point, m.
pub type Point = [f64; 2];

/// Things nearer than this touch, m. Far below any wall and far above rounding at city scale.
pub const TOUCH_M: f64 = 1e-9;

/// A straight wall between two neighbouring vertices of a polygon.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Segment {
    /// Where it starts, m.
    pub a: Point,
    /// Where it ends, m.
    pub b: Point,
}

impl Segment {
    /// Length, m.
    pub fn length_m(self) -> f64 {
        distance_m(self.a, self.b)
    }

    /// Signed distance of a point from the whole line, m; positive on the left of a→b.
    pub fn left_m(self, p: Point) -> f64 {
        cross(self.a, self.b, p) / self.length_m()
    }

    /// Distance of a point from the segment, m.
    pub fn distance_to_m(self, p: Point) -> f64 {
        let d = [self.b[0] - self.a[0], self.b[1] - self.a[1]];
        let along = (p[0] - self.a[0]) * d[0] + (p[1] - self.a[1]) * d[1];
        let share = (along / (d[0] * d[0] + d[1] * d[1])).clamp(0.0, 1.0);
        distance_m(p, [self.a[0] + share * d[0], self.a[1] + share * d[1]])
    }

    /// Whether two segments share a point, ends included.
    pub fn touches(self, other: Self) -> bool {
        // Either each segment has the other's ends on different sides, or an end lies on a segment.
        let crosses = |s: Self, t: Self| {
            let (a, b) = (s.left_m(t.a), s.left_m(t.b));
            (a > TOUCH_M && b < -TOUCH_M) || (a < -TOUCH_M && b > TOUCH_M)
        };
        (crosses(self, other) && crosses(other, self))
            || self.distance_to_m(other.a) < TOUCH_M
            || self.distance_to_m(other.b) < TOUCH_M
            || other.distance_to_m(self.a) < TOUCH_M
            || other.distance_to_m(self.b) < TOUCH_M
    }

    /// Distance along a ray (unit direction) to the segment, m; `None` if it misses.
    pub fn hit_by_ray_m(self, from: Point, direction: Point) -> Option<f64> {
        let d = [self.b[0] - self.a[0], self.b[1] - self.a[1]];
        let o = [self.a[0] - from[0], self.a[1] - from[1]];
        let determinant = direction[0] * d[1] - direction[1] * d[0];
        if determinant == 0.0 {
            return None;
        }
        let range_m = (o[0] * d[1] - o[1] * d[0]) / determinant;
        let share = (o[0] * direction[1] - o[1] * direction[0]) / determinant;
        (range_m >= 0.0 && (0.0..=1.0).contains(&share)).then_some(range_m)
    }
}

/// Distance of two points, m.
pub fn distance_m(a: Point, b: Point) -> f64 {
    libm::hypot(b[0] - a[0], b[1] - a[1])
}

/// Twice the signed area of a triangle, m²; positive if c is on the left of a→b.
pub fn cross(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The sides of a closed polygon, the last one back to the first vertex.
pub fn sides(polygon: &[Point]) -> impl Iterator<Item = Segment> + '_ {
    let next = polygon.iter().cycle().skip(1);
    polygon
        .iter()
        .zip(next)
        .map(|(a, b)| Segment { a: *a, b: *b })
}

/// Signed area, m²; positive if the vertices run counter-clockwise.
pub fn signed_area_m2(polygon: &[Point]) -> f64 {
    // Relative to a vertex, so that a small polygon far from the origin keeps its digits.
    polygon.first().map_or(0.0, |o| {
        sides(polygon).map(|s| cross(*o, s.a, s.b)).sum::<f64>() / 2.0
    })
}

/// Whether a point lies within a polygon; on its border either answer may come.
pub fn contains(polygon: &[Point], p: Point) -> bool {
    let crossings = sides(polygon).filter(|s| {
        // Half-open in y, so that a vertex on the ray counts once.
        (s.a[1] > p[1]) != (s.b[1] > p[1])
            && p[0] < s.a[0] + (p[1] - s.a[1]) / (s.b[1] - s.a[1]) * (s.b[0] - s.a[0])
    });
    crossings.count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(a: Point, b: Point) -> Segment {
        Segment { a, b }
    }

    #[test]
    fn segments_touch_by_crossing_meeting_or_overlapping() {
        let s = segment([0.0, 0.0], [4.0, 0.0]);
        for (a, b, expected) in [
            ([2.0, -1.0], [2.0, 1.0], true),
            ([2.0, 0.0], [2.0, 1.0], true),
            ([4.0, 0.0], [5.0, 1.0], true),
            ([3.0, 0.0], [9.0, 0.0], true),
            ([5.0, 0.0], [9.0, 0.0], false),
            ([2.0, 0.1], [2.0, 1.0], false),
            ([5.0, -1.0], [5.0, 1.0], false),
            ([0.0, 1.0], [4.0, 1.0], false),
        ] {
            assert_eq!(s.touches(segment(a, b)), expected, "{a:?} {b:?}");
            assert_eq!(segment(b, a).touches(s), expected, "{a:?} {b:?}");
        }
    }

    #[test]
    fn rays_hit_what_is_ahead() {
        let wall = segment([5.0, -1.0], [5.0, 1.0]);
        assert_eq!(wall.hit_by_ray_m([0.0, 0.0], [1.0, 0.0]), Some(5.0));
        assert_eq!(wall.hit_by_ray_m([0.0, 0.0], [-1.0, 0.0]), None);
        assert_eq!(wall.hit_by_ray_m([0.0, 2.0], [1.0, 0.0]), None);
    }

    #[test]
    fn an_l_shape_contains_its_arms_but_not_its_notch() {
        let l = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 1.0],
            [1.0, 1.0],
            [1.0, 4.0],
            [0.0, 4.0],
        ];
        assert_eq!(signed_area_m2(&l), 7.0);
        for (p, expected) in [
            ([0.5, 0.5], true),
            ([3.0, 0.5], true),
            ([0.5, 1.0], true),
            ([2.0, 2.0], false),
            ([-1.0, 1.0], false),
        ] {
            assert_eq!(contains(&l, p), expected, "{p:?}");
        }
    }
}
