//! What must hold for walls and route: simple closed polygons that touch nothing, a route in free
//! space.
//!
//! Polygons may not even touch: where two meet, what is a corner and what can be seen past it would
//! be a matter of rounding.

use super::geometry::{Point, Segment, TOUCH_M, contains, distance_m, sides};
use super::{World, WorldError};

/// Faults of one world.
struct Faults<'a> {
    world: &'a str,
}

impl Faults<'_> {
    fn at(
        &self,
        place: String,
        got: String,
        expected: &'static str,
        change: &'static str,
    ) -> WorldError {
        WorldError::Geometry {
            world: self.world.into(),
            place,
            got,
            expected,
            change,
        }
    }
}

/// Checks the polygons, and drops a last vertex that only repeats the first.
pub(super) fn polygons(
    world: &str,
    outer: &mut [Vec<Point>],
    obstacles: &mut [Vec<Point>],
) -> Result<(), WorldError> {
    let faults = Faults { world };
    if outer.is_empty() {
        let change = "add the vertices of the wall that bounds the world";
        return Err(faults.at("outer".into(), "no polygon".into(), "at least one", change));
    }
    let n_outer = outer.len();
    let place = |ix: usize| {
        if ix < n_outer {
            format!("outer polygon {}", ix + 1)
        } else {
            format!("obstacle {}", ix - n_outer + 1)
        }
    };
    for (ix, polygon) in outer.iter_mut().chain(obstacles.iter_mut()).enumerate() {
        // Some formats repeat the first vertex to say that the polygon is closed.
        if polygon.len() > 1 && polygon.first() == polygon.last() {
            polygon.pop();
        }
        simple(polygon, &place(ix), &faults)?;
    }
    let all: Vec<&Vec<Point>> = outer.iter().chain(obstacles.iter()).collect();
    for (ix, polygon) in all.iter().enumerate() {
        for (other_ix, other) in all.iter().enumerate().skip(ix + 1) {
            if sides(polygon).any(|s| sides(other).any(|t| s.touches(t))) {
                let got = format!("a wall that touches {}", place(ix));
                let change = "move one of them, or join the two into one polygon";
                return Err(faults.at(place(other_ix), got, "polygons that do not touch", change));
            }
        }
        let inside = |range: &[Vec<Point>]| {
            range
                .iter()
                .filter(|other| *other != *polygon && contains(other, polygon[0]))
                .count()
        };
        let (n_outer_around, n_obstacles_around) = (inside(outer), inside(obstacles));
        if ix < n_outer && n_outer_around + n_obstacles_around > 0 {
            let got = "an outer wall inside another polygon".to_string();
            let change = "remove it, or list it under obstacles";
            return Err(faults.at(place(ix), got, "outer walls side by side", change));
        }
        if ix >= n_outer && (n_outer_around == 0 || n_obstacles_around > 0) {
            let got = if n_outer_around == 0 {
                "an obstacle outside every outer wall"
            } else {
                "an obstacle inside another"
            };
            let expected = "obstacles in free space";
            return Err(faults.at(place(ix), got.into(), expected, "move or remove it"));
        }
    }
    Ok(())
}

fn simple(polygon: &[Point], place: &str, faults: &Faults) -> Result<(), WorldError> {
    let n = polygon.len();
    if n < 3 {
        let got = format!("{n} vertices");
        return Err(faults.at(
            place.into(),
            got,
            "at least 3",
            "add vertices or remove the polygon",
        ));
    }
    let at = |ix: usize| format!("{place}, vertex {}", ix + 1);
    for (ix, [x, y]) in polygon.iter().enumerate() {
        if !(x.is_finite() && y.is_finite()) {
            let got = format!("[{x}, {y}]");
            return Err(faults.at(at(ix), got, "two finite numbers (m)", "correct the vertex"));
        }
    }
    for ix in 0..n {
        let (before, here, after) = (
            polygon[(ix + n - 1) % n],
            polygon[ix],
            polygon[(ix + 1) % n],
        );
        if distance_m(here, after) < TOUCH_M {
            let got = format!("[{}, {}] twice in a row", here[0], here[1]);
            return Err(faults.at(at(ix), got, "neighbours apart", "remove one of the two"));
        }
        if distance_m(before, after) < TOUCH_M
            || (Segment {
                a: before,
                b: after,
            })
            .left_m(here)
            .abs()
                < TOUCH_M
        {
            let got = "no corner but a straight line or a spike".to_string();
            return Err(faults.at(
                at(ix),
                got,
                "walls that meet at an angle",
                "remove the vertex",
            ));
        }
    }
    let walls: Vec<Segment> = sides(polygon).collect();
    for a in 0..n {
        // Neighbouring sides share a vertex and, at an angle, nothing else.
        for b in a + 2..n {
            if (b + 1) % n != a && walls[a].touches(walls[b]) {
                let got = format!("a side that touches the side from vertex {}", b + 1);
                let change = "reorder or move the vertices";
                return Err(faults.at(at(a), got, "a polygon that does not meet itself", change));
            }
        }
    }
    Ok(())
}

/// Checks that the route, the way back to its start included, stays in free space.
pub(super) fn route(world: &World) -> Result<(), WorldError> {
    let faults = Faults {
        world: world.name(),
    };
    let waypoints = world.waypoints();
    if waypoints.len() < 2 {
        let got = waypoints.len().to_string();
        return Err(faults.at(
            "waypoints".into(),
            got,
            "at least 2",
            "add waypoints to drive through",
        ));
    }
    for (ix, p) in waypoints.iter().enumerate() {
        if !(p[0].is_finite() && p[1].is_finite() && world.is_free(*p)) {
            let got = format!("[{}, {}]", p[0], p[1]);
            let expected = "a point in free space, off the walls";
            return Err(faults.at(
                format!("waypoint {}", ix + 1),
                got,
                expected,
                "move the waypoint",
            ));
        }
    }
    for (ix, leg) in sides(waypoints).enumerate() {
        let to = (ix + 1) % waypoints.len() + 1;
        let place = format!("leg from waypoint {} to {to}", ix + 1);
        if leg.length_m() < TOUCH_M {
            let got = "no distance".to_string();
            return Err(faults.at(
                place,
                got,
                "neighbouring waypoints apart",
                "remove one of the two",
            ));
        }
        if let Some(wall) = world.walls().iter().find(|wall| wall.touches(leg)) {
            let ([ax, ay], [bx, by]) = (wall.a, wall.b);
            let got = format!("the wall from [{ax}, {ay}] to [{bx}, {by}] in the way");
            let change =
                "move a waypoint or add one between (the route returns to its first waypoint)";
            return Err(faults.at(place, got, "a leg that touches no wall", change));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(from: f64, to: f64) -> Vec<Point> {
        vec![[from, from], [to, from], [to, to], [from, to]]
    }

    fn message(
        outer: Vec<Vec<Point>>,
        obstacles: Vec<Vec<Point>>,
        waypoints: Vec<Point>,
    ) -> String {
        World::new("w", outer, obstacles, waypoints)
            .expect_err("faulty")
            .to_string()
    }

    #[test]
    fn impossible_walls_are_refused_in_one_line() {
        let route = || vec![[1.0, 1.0], [2.0, 1.0]];
        let outer = || vec![square(0.0, 10.0)];
        let cases = [
            (
                message(vec![], vec![], route()),
                "w, outer: got no polygon, expected at least one; add the vertices of the wall that bounds the world",
            ),
            (
                message(vec![vec![[0.0, 0.0], [1.0, 0.0]]], vec![], route()),
                "w, outer polygon 1: got 2 vertices, expected at least 3; add vertices or remove the polygon",
            ),
            (
                message(
                    outer(),
                    vec![vec![[4.0, 4.0], [5.0, f64::NAN], [5.0, 5.0]]],
                    route(),
                ),
                "w, obstacle 1, vertex 2: got [5, NaN], expected two finite numbers (m); correct the vertex",
            ),
            (
                message(
                    outer(),
                    vec![vec![[4.0, 4.0], [5.0, 4.0], [5.0, 4.0], [5.0, 5.0]]],
                    route(),
                ),
                "w, obstacle 1, vertex 2: got [5, 4] twice in a row, expected neighbours apart; remove one of the two",
            ),
            (
                message(
                    outer(),
                    vec![vec![[4.0, 4.0], [5.0, 4.0], [6.0, 4.0], [5.0, 5.0]]],
                    route(),
                ),
                "w, obstacle 1, vertex 2: got no corner but a straight line or a spike, expected walls that meet at an angle; remove the vertex",
            ),
            (
                message(
                    outer(),
                    vec![vec![[4.0, 4.0], [6.0, 6.0], [6.0, 4.0], [4.0, 6.0]]],
                    route(),
                ),
                "w, obstacle 1, vertex 1: got a side that touches the side from vertex 3, expected a polygon that does not meet itself; reorder or move the vertices",
            ),
            (
                message(outer(), vec![square(4.0, 6.0), square(5.0, 7.0)], route()),
                "w, obstacle 2: got a wall that touches obstacle 1, expected polygons that do not touch; move one of them, or join the two into one polygon",
            ),
            (
                message(outer(), vec![square(4.0, 8.0), square(5.0, 6.0)], route()),
                "w, obstacle 2: got an obstacle inside another, expected obstacles in free space; move or remove it",
            ),
            (
                message(outer(), vec![square(14.0, 15.0)], route()),
                "w, obstacle 1: got an obstacle outside every outer wall, expected obstacles in free space; move or remove it",
            ),
            (
                message(vec![square(0.0, 10.0), square(4.0, 5.0)], vec![], route()),
                "w, outer polygon 2: got an outer wall inside another polygon, expected outer walls side by side; remove it, or list it under obstacles",
            ),
        ];
        for (got, expected) in cases {
            assert_eq!(got, expected);
        }
    }

    #[test]
    fn a_route_through_walls_is_refused_in_one_line() {
        let message =
            |waypoints| message(vec![square(0.0, 10.0)], vec![square(4.0, 6.0)], waypoints);
        let cases = [
            (
                message(vec![[1.0, 1.0]]),
                "w, waypoints: got 1, expected at least 2; add waypoints to drive through",
            ),
            (
                message(vec![[1.0, 1.0], [5.0, 5.0]]),
                "w, waypoint 2: got [5, 5], expected a point in free space, off the walls; move the waypoint",
            ),
            (
                message(vec![[1.0, 1.0], [4.0, 5.0]]),
                "w, waypoint 2: got [4, 5], expected a point in free space, off the walls; move the waypoint",
            ),
            (
                message(vec![[1.0, 1.0], [1.0, f64::INFINITY]]),
                "w, waypoint 2: got [1, inf], expected a point in free space, off the walls; move the waypoint",
            ),
            (
                message(vec![[1.0, 1.0], [1.0, 1.0]]),
                "w, leg from waypoint 1 to 2: got no distance, expected neighbouring waypoints apart; remove one of the two",
            ),
            (
                message(vec![[1.0, 1.0], [9.0, 1.0], [9.0, 9.0]]),
                "w, leg from waypoint 3 to 1: got the wall from [6, 4] to [4, 4] in the way, expected a leg that touches no wall; move a waypoint or add one between (the route returns to its first waypoint)",
            ),
        ];
        for (got, expected) in cases {
            assert_eq!(got, expected);
        }
    }

    #[test]
    fn several_outer_walls_and_a_repeated_last_vertex_are_fine() {
        let mut closed = square(20.0, 30.0);
        closed.push([20.0, 20.0]);
        let world = World::new(
            "w",
            vec![square(0.0, 10.0), closed],
            vec![],
            vec![[1.0, 1.0], [2.0, 1.0]],
        );
        assert_eq!(world.expect("good").corners().len(), 8);
    }
}
