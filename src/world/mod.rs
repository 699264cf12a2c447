//! Polygonal worlds: walls, their corners as landmarks, and the route a robot drives.
//!
//! A world is one or more outer walls and any number of obstacles within them, each a closed simple
//! polygon (m). Free space is inside an outer wall and outside every obstacle. The landmarks are
//! the vertices, numbered from 0 through the outer walls, then the obstacles. The route runs
//! through the waypoints and from the last back to the first, and is driven in laps.
//!
//! One way through the room: `file` or `built_in` → [`World`] → `drive` (believed and true path) →
//! `camera` with `sight` (sightings) → the tracker (detections), put together by [`simulate`].

mod built_in;
mod camera;
mod checks;
mod drive;
mod error;
mod file;
mod geometry;
mod office;
mod settings;
mod sight;
mod simulate;

use std::fmt::Write as _;

use crate::files::path_of;
use crate::rng::{Purpose, WORLD_SEMANTICS};

pub use built_in::{BUILT_IN_WORLDS, crossing_ranges};
pub use error::WorldError;
pub use geometry::{Point, Segment};
pub use office::OfficePlan;
pub use settings::{SettingsError, SimulationSettings};
pub use sight::VisibleCorner;
pub use simulate::{Simulation, SimulationError, simulate};

/// Walls, corners and route. Checked when made; never changes after.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct World {
    name: String,
    outer: Vec<Vec<Point>>,
    obstacles: Vec<Vec<Point>>,
    waypoints: Vec<Point>,
    corners: Vec<WorldCorner>,
    walls: Vec<Segment>,
}

/// A vertex, where two walls meet; its place in [`World::corners`] is its landmark number.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct WorldCorner {
    /// Where it is, m.
    pub position_m: Point,
    /// The walls that meet there, as indices into [`World::walls`].
    pub wall_ix: [usize; 2],
}

impl World {
    /// Checks walls and route. `name` only serves messages; the vertices may run either way.
    pub fn new(
        name: impl Into<String>,
        mut outer: Vec<Vec<Point>>,
        mut obstacles: Vec<Vec<Point>>,
        waypoints: Vec<Point>,
    ) -> Result<Self, WorldError> {
        let name = name.into();
        checks::polygons(&name, &mut outer, &mut obstacles)?;
        let (mut corners, mut walls) = (Vec::new(), Vec::new());
        for (ix, polygon) in outer.iter().chain(&obstacles).enumerate() {
            let (first, n) = (walls.len(), polygon.len());
            let is_left_free = (geometry::signed_area_m2(polygon) > 0.0) == (ix < outer.len());
            walls.extend(geometry::sides(polygon).map(|side| {
                if is_left_free {
                    side
                } else {
                    Segment {
                        a: side.b,
                        b: side.a,
                    }
                }
            }));
            corners.extend(
                polygon
                    .iter()
                    .enumerate()
                    .map(|(ix, position_m)| WorldCorner {
                        position_m: *position_m,
                        wall_ix: [first + (ix + n - 1) % n, first + ix],
                    }),
            );
        }
        let world = Self {
            name,
            outer,
            obstacles,
            waypoints,
            corners,
            walls,
        };
        checks::route(&world)?;
        Ok(world)
    }

    /// A world from a file if the text ends in `.toml`, else the built-in world of that name.
    pub fn load(name_or_path: &str) -> Result<Self, WorldError> {
        if name_or_path.ends_with(".toml") {
            Self::read_toml(path_of(name_or_path))
        } else {
            Self::built_in(name_or_path)
        }
    }

    /// What messages call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The outer walls.
    pub fn outer(&self) -> &[Vec<Point>] {
        &self.outer
    }

    /// The obstacles.
    pub fn obstacles(&self) -> &[Vec<Point>] {
        &self.obstacles
    }

    /// The route, without the way back from the last waypoint to the first.
    pub fn waypoints(&self) -> &[Point] {
        &self.waypoints
    }

    /// The landmarks; the index is the landmark number.
    pub fn corners(&self) -> &[WorldCorner] {
        &self.corners
    }

    /// All walls, free space on the left of each.
    pub fn walls(&self) -> &[Segment] {
        &self.walls
    }

    /// Whether a point is in free space and touches no wall.
    pub fn is_free(&self, p: Point) -> bool {
        self.outer
            .iter()
            .any(|polygon| geometry::contains(polygon, p))
            && !self
                .obstacles
                .iter()
                .any(|polygon| geometry::contains(polygon, p))
            && self
                .walls
                .iter()
                .all(|wall| wall.distance_to_m(p) >= geometry::TOUCH_M)
    }

    /// Walls and route as one text, for identity. The name is left out: a file and a built-in
    /// world with the same walls and route are the same world.
    pub fn canonical_text(&self) -> String {
        let mut text = String::new();
        let mut line = |kind: &str, points: &[Point]| {
            text.push_str(kind);
            for [x, y] in points {
                // Adding 0 turns −0 into 0.
                write!(text, " {},{}", x + 0.0, y + 0.0).expect("a String takes any text");
            }
            text.push('\n');
        };
        self.outer.iter().for_each(|polygon| line("outer", polygon));
        self.obstacles
            .iter()
            .for_each(|polygon| line("obstacle", polygon));
        line("waypoints", &self.waypoints);
        text
    }
}

/// What a simulation's generator is for: seed, world, settings and replicate, nothing of any model
/// or sampler, so that all cells of a sweep see the same worlds.
pub fn world_purpose(
    seed: u64,
    world: &World,
    settings: &SimulationSettings,
    replicate: u64,
) -> Purpose {
    Purpose::new(WORLD_SEMANTICS, seed)
        .text("world", &world.canonical_text())
        .text("simulation", &settings.canonical_text())
        .number("replicate", replicate)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_purpose_sees_seed_world_settings_and_replicate_but_no_name() {
        let ring = World::built_in("square-ring").expect("built in");
        let settings = SimulationSettings::default();
        let key = world_purpose(1, &ring, &settings, 0).key();
        let renamed = World {
            name: "other".into(),
            ..ring.clone()
        };
        assert_eq!(key, world_purpose(1, &renamed, &settings, 0).key());
        let office = World::built_in("office").expect("built in");
        let louder = SimulationSettings {
            noise: 2.0,
            ..settings.clone()
        };
        for other in [
            world_purpose(2, &ring, &settings, 0),
            world_purpose(1, &office, &settings, 0),
            world_purpose(1, &ring, &louder, 0),
            world_purpose(1, &ring, &settings, 1),
        ] {
            assert_ne!(key, other.key());
        }
    }

    #[test]
    fn walls_keep_free_space_on_their_left_whatever_the_sense_of_rotation() {
        let ring = World::built_in("square-ring").expect("built in");
        let reversed = |polygons: &[Vec<Point>]| -> Vec<Vec<Point>> {
            polygons
                .iter()
                .map(|p| p.iter().rev().copied().collect())
                .collect()
        };
        let turned = World::new(
            "turned",
            reversed(ring.outer()),
            reversed(ring.obstacles()),
            ring.waypoints().to_vec(),
        )
        .expect("still good");
        for world in [ring, turned] {
            for wall in world.walls() {
                let middle = [(wall.a[0] + wall.b[0]) / 2.0, (wall.a[1] + wall.b[1]) / 2.0];
                let length = wall.length_m();
                let left = [
                    -(wall.b[1] - wall.a[1]) / length,
                    (wall.b[0] - wall.a[0]) / length,
                ];
                assert!(world.is_free([middle[0] + 0.1 * left[0], middle[1] + 0.1 * left[1]]));
                assert!(!world.is_free(middle));
            }
        }
    }
}
