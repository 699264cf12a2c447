//! A parametric office: rows of rooms with doors onto corridors, for any number of corners.
//!
//! Seen from above, with corridors all around and between the rows:
//!
//! ```text
//! ┌───────────────────────────┐
//! │  ┌──────┬──────┬──────┐   │   a row is one obstacle: a comb of walls
//! │  │ room │ room │ room │   │   whose rooms open downwards
//! │  └─  ───┴─  ───┴─  ───┘   │
//! │  ┌──────┬──────┬──────┐   │
//! │  │ room │ room │ room │   │
//! │  └─  ───┴─  ───┴─  ───┘   │
//! └───────────────────────────┘
//! ```
//!
//! A row of c rooms has 4 + 8·c corners (per room four of the room and four of its door), the outer
//! wall has 4: 4 + rows·(4 + 8·columns) in all. The route enters every room: along the corridor
//! below each row, rightwards and leftwards by turns, and back to the start down the left corridor.
//!
//! Drift grows with the length of the route and walls do not stop the true path: where it has left
//! free space the robot is blind and groups break up. `office:2x3` is fair at noise 0.25 and hard
//! at 1; larger ones want less noise.

use super::geometry::Point;
use super::{World, WorldError};

/// Sizes of an office.
#[derive(Clone, Debug, PartialEq)]
pub struct OfficePlan {
    /// Rows of rooms.
    pub rows: usize,
    /// Rooms per row.
    pub columns: usize,
    /// Inner width of a room, along the corridor, m.
    pub room_width_m: f64,
    /// Inner depth of a room, away from the corridor, m.
    pub room_depth_m: f64,
    /// Width of a door, m; doors are in the middle of the wall.
    pub door_width_m: f64,
    /// Thickness of all walls, m.
    pub wall_m: f64,
    /// Width of the corridors, m.
    pub corridor_m: f64,
}

impl Default for OfficePlan {
    /// Two rows of three rooms (60 corners), roomy enough that neighbouring corners are further
    /// apart (4 m) than two visits of one corner at the default noise over a short loop.
    fn default() -> Self {
        Self {
            rows: 2,
            columns: 3,
            room_width_m: 16.0,
            room_depth_m: 14.0,
            door_width_m: 5.0,
            wall_m: 4.0,
            corridor_m: 14.0,
        }
    }
}

impl OfficePlan {
    /// 4 + rows·(4 + 8·columns).
    pub fn n_corners(&self) -> usize {
        4 + self.rows * (4 + 8 * self.columns)
    }

    /// The world of this plan.
    pub fn build(&self, name: &str) -> Result<World, WorldError> {
        self.check(name)?;
        let outer = vec![
            [0.0, 0.0],
            [self.width_m(), 0.0],
            [self.width_m(), self.height_m()],
            [0.0, self.height_m()],
        ];
        let obstacles = (0..self.rows).map(|row| self.row_outline(row)).collect();
        World::new(name, vec![outer], obstacles, self.route())
    }

    fn check(&self, name: &str) -> Result<(), WorldError> {
        let fault = |place: &str, got: f64, expected, change| {
            let (world, place) = (name.into(), place.into());
            Err(WorldError::Geometry {
                world,
                place,
                got: got.to_string(),
                expected,
                change,
            })
        };
        let positive = [
            ("rows", self.rows as f64),
            ("columns", self.columns as f64),
            ("room_width_m", self.room_width_m),
            ("room_depth_m", self.room_depth_m),
            ("door_width_m", self.door_width_m),
            ("wall_m", self.wall_m),
            ("corridor_m", self.corridor_m),
        ];
        if let Some((place, got)) = positive
            .into_iter()
            .find(|(_, v)| !(v.is_finite() && *v > 0.0))
        {
            return fault(place, got, "a finite number above 0", "change the plan");
        }
        if self.door_width_m >= self.room_width_m {
            let change = "narrow the door or widen the room";
            return fault(
                "door_width_m",
                self.door_width_m,
                "less than room_width_m",
                change,
            );
        }
        Ok(())
    }

    fn row_width_m(&self) -> f64 {
        self.wall_m + self.columns as f64 * self.room_pitch_m()
    }

    fn row_height_m(&self) -> f64 {
        self.room_depth_m + 2.0 * self.wall_m
    }

    fn room_pitch_m(&self) -> f64 {
        self.room_width_m + self.wall_m
    }

    fn width_m(&self) -> f64 {
        self.row_width_m() + 2.0 * self.corridor_m
    }

    fn height_m(&self) -> f64 {
        self.corridor_m + self.rows as f64 * (self.row_height_m() + self.corridor_m)
    }

    /// Lower edge of a row, m.
    fn row_bottom_m(&self, row: usize) -> f64 {
        self.corridor_m + row as f64 * (self.row_height_m() + self.corridor_m)
    }

    /// Left inner wall of a room, m.
    fn room_left_m(&self, column: usize) -> f64 {
        self.corridor_m + self.wall_m + column as f64 * self.room_pitch_m()
    }

    /// The comb, counter-clockwise from its lower left: in and out of every room on the way right.
    fn row_outline(&self, row: usize) -> Vec<Point> {
        let (left, bottom) = (self.corridor_m, self.row_bottom_m(row));
        let (right, top) = (left + self.row_width_m(), bottom + self.row_height_m());
        let (floor, ceiling) = (bottom + self.wall_m, top - self.wall_m);
        let mut outline = vec![[left, bottom]];
        for column in 0..self.columns {
            let room_left = self.room_left_m(column);
            let room_right = room_left + self.room_width_m;
            let door_left = room_left + (self.room_width_m - self.door_width_m) / 2.0;
            let door_right = door_left + self.door_width_m;
            outline.extend([
                [door_left, bottom],
                [door_left, floor],
                [room_left, floor],
                [room_left, ceiling],
                [room_right, ceiling],
                [room_right, floor],
                [door_right, floor],
                [door_right, bottom],
            ]);
        }
        outline.extend([[right, bottom], [right, top], [left, top]]);
        outline
    }

    fn route(&self) -> Vec<Point> {
        let half = self.corridor_m / 2.0;
        let (left, right) = (half, self.width_m() - half);
        let mut route = Vec::new();
        for row in 0..self.rows {
            let bottom = self.row_bottom_m(row);
            let corridor = bottom - half;
            let room = bottom + self.row_height_m() / 2.0;
            let is_rightwards = row % 2 == 0;
            let mut columns: Vec<usize> = (0..self.columns).collect();
            if !is_rightwards {
                columns.reverse();
            }
            let (from, to) = if is_rightwards {
                (left, right)
            } else {
                (right, left)
            };
            route.push([from, corridor]);
            for column in columns {
                let x = self.room_left_m(column) + self.room_width_m / 2.0;
                route.extend([[x, corridor], [x, room], [x, corridor]]);
            }
            route.push([to, corridor]);
        }
        if self.rows % 2 == 1 {
            // The last row was left on the right: home over the top.
            let top = self.height_m() - half;
            route.extend([[right, top], [left, top]]);
        }
        route
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offices_have_the_promised_corners_and_a_free_route() {
        for (rows, columns) in [(1, 1), (1, 2), (2, 3), (3, 1), (5, 8)] {
            let plan = OfficePlan {
                rows,
                columns,
                ..Default::default()
            };
            // World::new has checked that the route is free; the number of corners is our promise.
            let world = World::built_in(&format!("office:{rows}x{columns}")).expect("a good plan");
            assert_eq!(world.corners().len(), plan.n_corners(), "{rows}x{columns}");
            assert!(world.waypoints().iter().all(|p| world.is_free(*p)));
            let mut seen = vec![false; plan.n_corners()];
            for waypoint in world.waypoints() {
                for corner in world.visible_corners(*waypoint, 1e3) {
                    seen[corner.landmark] = true;
                }
            }
            assert!(seen.iter().all(|seen| *seen), "{rows}x{columns}");
        }
        assert_eq!(
            OfficePlan {
                rows: 1,
                columns: 1,
                ..Default::default()
            }
            .n_corners(),
            16
        );
    }

    #[test]
    fn other_sizes_work_and_impossible_ones_are_refused() {
        let narrow = OfficePlan {
            room_width_m: 3.0,
            door_width_m: 0.9,
            wall_m: 0.2,
            corridor_m: 1.5,
            ..Default::default()
        };
        assert!(narrow.build("narrow").is_ok());
        let message = |plan: OfficePlan| plan.build("o").expect_err("impossible").to_string();
        assert_eq!(
            message(OfficePlan {
                door_width_m: 16.0,
                ..Default::default()
            }),
            "o, door_width_m: got 16, expected less than room_width_m; narrow the door or widen the room"
        );
        assert_eq!(
            message(OfficePlan {
                wall_m: 0.0,
                ..Default::default()
            }),
            "o, wall_m: got 0, expected a finite number above 0; change the plan"
        );
    }
}
