//! Which corners can be seen from a point, and what they look like from there.
//!
//! A corner v is visible from r iff r is in free space and the open segment r→v touches no wall.
//! Touching counts as blocking, grazing another corner included: such rays have measure zero, and
//! nothing then hangs on rounding. A robot whose true pose has drifted into a wall sees nothing.
//!
//! A visible corner is *closed* when both its walls are visible near it, *open* when one is hidden
//! (one wall and a gap; source report, section 2). Near a visible corner a wall is visible iff r is
//! on its free side, so this needs no further rays: corners that bulge into the free space are open
//! from where they hide one of their walls, all others are closed.

use super::World;
use super::geometry::{Point, Segment, TOUCH_M, distance_m};
use crate::detections::Corner;

/// A corner as seen from somewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisibleCorner {
    /// Its number: the index into [`World::corners`].
    pub landmark: usize,
    /// Distance, m.
    pub range_m: f64,
    /// What it looks like.
    pub kind: Corner,
}

impl World {
    /// The corners visible from a point within a distance, by number.
    pub fn visible_corners(&self, from: Point, max_range_m: f64) -> Vec<VisibleCorner> {
        if !self.is_free(from) {
            return Vec::new();
        }
        // Near walls first: they hide the most, and walls beyond a corner cannot hide it.
        let mut walls: Vec<(f64, usize)> = self
            .walls()
            .iter()
            .enumerate()
            .map(|(ix, wall)| (wall.distance_to_m(from), ix))
            .filter(|(near_m, _)| *near_m <= max_range_m)
            .collect();
        walls.sort_by(|(a, _), (b, _)| a.total_cmp(b));

        let mut visible = Vec::new();
        for (landmark, corner) in self.corners().iter().enumerate() {
            let range_m = distance_m(from, corner.position_m);
            if range_m > max_range_m {
                continue;
            }
            let ray = Segment {
                a: from,
                b: corner.position_m,
            };
            let is_hidden = walls
                .iter()
                .take_while(|(near_m, _)| *near_m <= range_m)
                .any(|(_, ix)| self.hides(*ix, landmark, ray));
            if !is_hidden {
                visible.push(VisibleCorner {
                    landmark,
                    range_m,
                    kind: self.kind(landmark, from),
                });
            }
        }
        visible
    }

    /// Distance from a point in free space to the first wall in a direction, m. Infinite only when
    /// rounding lets the ray slip between two walls at their common corner.
    pub fn free_range_m(&self, from: Point, direction_rad: f64) -> f64 {
        let (sin, cos) = libm::sincos(direction_rad);
        let hits = self
            .walls()
            .iter()
            .filter_map(|wall| wall.hit_by_ray_m(from, [cos, sin]));
        hits.fold(f64::INFINITY, f64::min)
    }

    /// Whether a wall is in the way of a ray from free space to a corner.
    fn hides(&self, wall_ix: usize, landmark: usize, ray: Segment) -> bool {
        // The corner's own walls always touch the ray, at the corner. They hide it only where they
        // run along the ray towards the robot, and then the wall at their other end touches it too.
        !self.corners()[landmark].wall_ix.contains(&wall_ix) && self.walls()[wall_ix].touches(ray)
    }

    fn kind(&self, landmark: usize, from: Point) -> Corner {
        let walls = self.corners()[landmark].wall_ix;
        if walls
            .iter()
            .all(|ix| self.walls()[*ix].left_m(from) > TOUCH_M)
        {
            Corner::Closed
        } else {
            Corner::Open
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners 0–3: (−10,−10), (45,−10), (45,45), (−10,45); 4–7: (10,10), (25,10), (25,25), (10,25).
    fn ring() -> World {
        World::built_in("square-ring").expect("built in")
    }

    fn seen(from: Point) -> Vec<usize> {
        ring()
            .visible_corners(from, 1e3)
            .iter()
            .map(|corner| corner.landmark)
            .collect()
    }

    #[test]
    fn exactly_behind_a_corner_nothing_is_seen() {
        // (25,25) and (45,45) lie on the diagonal behind (10,10).
        assert_eq!(seen([0.0, 0.0]), [0, 1, 3, 4, 5, 7]);
        // From (10−ε, 0) the corner (10,25) is seen past (10,10), along the wall it is not.
        assert!(seen([10.0 - 1e-6, 0.0]).contains(&7));
        assert!(!seen([10.0 + 1e-6, 0.0]).contains(&7));
    }

    #[test]
    fn along_a_wall_only_its_near_end_is_seen() {
        assert_eq!(seen([10.0, 0.0]), [0, 1, 3, 4, 5]);
        assert_eq!(seen([0.0, 25.0]), [0, 2, 3, 4, 7]);
    }

    #[test]
    fn a_ray_that_grazes_another_corner_is_blocked() {
        // From (5,30) the ray to (45,−10) runs along x + y = 35 through (10,25) and (25,10).
        assert!(!seen([5.0, 30.0]).contains(&1));
        // A pillar's tip just reaches, or not, the ray from (1,4) to the dent at (9,4).
        let square = vec![[0.0, 0.0], [10.0, 0.0], [9.0, 4.0], [10.0, 8.0], [0.0, 8.0]];
        let world = |tip: f64| {
            let pillar = vec![[4.0, 1.0], [6.0, 1.0], [5.0, tip]];
            World::new(
                "tip",
                vec![square.clone()],
                vec![pillar],
                vec![[1.0, 7.0], [2.0, 7.0]],
            )
            .expect("a good world")
        };
        let sees = |tip| {
            world(tip)
                .visible_corners([1.0, 4.0], 1e3)
                .iter()
                .any(|c| c.landmark == 2)
        };
        assert!(sees(3.999));
        assert!(!sees(4.0));
        assert!(!sees(4.001));
    }

    #[test]
    fn from_within_a_wall_or_outside_nothing_is_seen() {
        for from in [
            [15.0, 15.0],
            [10.0, 12.0],
            [10.0, 10.0],
            [-10.0, 0.0],
            [100.0, 0.0],
        ] {
            assert!(seen(from).is_empty(), "{from:?}");
        }
    }

    #[test]
    fn corners_too_far_away_are_not_seen() {
        let near = ring().visible_corners([0.0, 0.0], 15.0);
        assert_eq!(
            near.iter()
                .map(|corner| corner.landmark)
                .collect::<Vec<_>>(),
            [0, 4]
        );
        assert!((near[0].range_m - 200f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn kinds_of_corners_by_hand() {
        let kinds = |from| -> Vec<(usize, Corner)> {
            ring()
                .visible_corners(from, 1e3)
                .iter()
                .map(|c| (c.landmark, c.kind))
                .collect()
        };
        use Corner::{Closed, Open};
        // From the lower left both walls of (10,10) are in view, but one each of (25,10), (10,25).
        assert_eq!(
            kinds([0.0, 0.0]),
            [
                (0, Closed),
                (1, Closed),
                (3, Closed),
                (4, Closed),
                (5, Open),
                (7, Open)
            ]
        );
        // From below only the lower walls of the block are in view.
        assert_eq!(
            kinds([17.0, 0.0]),
            [(0, Closed), (1, Closed), (4, Open), (5, Open)]
        );
    }

    #[test]
    fn rays_end_at_the_first_wall() {
        let ring = ring();
        assert!((ring.free_range_m([0.0, 15.0], 0.0) - 10.0).abs() < 1e-9);
        assert!((ring.free_range_m([0.0, 0.0], 0.0) - 45.0).abs() < 1e-9);
        assert!((ring.free_range_m([0.0, 0.0], std::f64::consts::PI) - 10.0).abs() < 1e-9);
    }
}
