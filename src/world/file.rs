//! Worlds from TOML files.
//!
//! ```toml
//! outer = [[[-10, -10], [45, -10], [45, 45], [-10, 45]]]
//! obstacles = [[[10, 10], [25, 10], [25, 25], [10, 25]]]
//! waypoints = [[0, 0], [35, 0], [35, 35], [0, 35]]
//! ```
//!
//! `outer` and `obstacles` are lists of polygons, a polygon a list of vertices, a vertex [x, y] in m.

use std::io::ErrorKind;
use std::path::Path;

use serde::Deserialize;

use super::geometry::Point;
use super::{World, WorldError};
use crate::excerpt::message;
use crate::files::read_at_most;

/// More bytes than this are no world file.
const MAX_BYTES: u64 = 16_000_000;

const KEYS: [&str; 3] = ["outer", "obstacles", "waypoints"];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WorldFile {
    outer: Vec<Vec<Point>>,
    #[serde(default)]
    obstacles: Vec<Vec<Point>>,
    waypoints: Vec<Point>,
}

impl World {
    /// Reads and checks the file of a world.
    pub fn read_toml(path: impl AsRef<Path>) -> Result<Self, WorldError> {
        let path = path.as_ref();
        let bytes = read_at_most(path, MAX_BYTES).map_err(|source| match source.kind() {
            ErrorKind::FileTooLarge => WorldError::TooLarge {
                path: path.into(),
                most_mb: MAX_BYTES / 1_000_000,
            },
            _ => WorldError::Read {
                path: path.into(),
                source,
            },
        })?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
            let line_start = valid
                .iter()
                .rposition(|b| *b == b'\n')
                .map_or(0, |ix| ix + 1);
            WorldError::Toml {
                path: path.into(),
                line: 1 + valid.iter().filter(|b| **b == b'\n').count(),
                column: 1 + String::from_utf8_lossy(&valid[line_start..])
                    .chars()
                    .count(),
                problem: "got bytes that are not UTF-8, expected a text".to_owned(),
                change: "save it as UTF-8".to_owned(),
            }
        })?;
        Self::from_toml(&text, path)
    }

    /// Reads and checks the text of a world; `path_for_messages` is what errors call it.
    pub fn from_toml(text: &str, path_for_messages: impl AsRef<Path>) -> Result<Self, WorldError> {
        let path = path_for_messages.as_ref();
        let file: WorldFile = toml::from_str(text).map_err(|error| fault(text, path, &error))?;
        Self::new(
            path.display().to_string(),
            file.outer,
            file.obstacles,
            file.waypoints,
        )
    }
}

fn fault(text: &str, path: &Path, error: &toml::de::Error) -> WorldError {
    let before = &text[..error.span().map_or(0, |span| span.start).min(text.len())];
    let line_start = before.rfind('\n').map_or(0, |ix| ix + 1);
    let problem = error.message().lines().collect::<Vec<_>>().join(", ");
    let unknown = problem
        .strip_prefix("unknown field `")
        .and_then(|rest| rest.split_once('`'));
    let change = match unknown {
        Some((key, _)) => format!("rename it to {} or remove it", nearest(key, &KEYS)),
        None => {
            "write outer and obstacles as lists of polygons, waypoints as a list of [x, y]".into()
        }
    };
    WorldError::Toml {
        path: path.into(),
        line: 1 + before.matches('\n').count(),
        column: 1 + before[line_start..].chars().count(),
        problem: message(&problem),
        change,
    }
}

/// The known name most like the one given.
pub(super) fn nearest<'a>(name: &str, known: &[&'a str]) -> &'a str {
    let similarity = |other: &str| strsim::jaro_winkler(name, other);
    known
        .iter()
        .copied()
        .max_by(|a, b| similarity(a).total_cmp(&similarity(b)))
        .expect("some name is known")
}

#[cfg(test)]
mod tests {
    use super::*;

    const RING: &str = "outer = [[[-10, -10], [45, -10], [45, 45], [-10, 45]]]\n\
        obstacles = [[[10, 10], [25, 10.0], [25, 25], [10, 25]]]\n\
        waypoints = [[0, 0], [35, 0], [35, 35], [0, 35]]\n";

    #[test]
    fn the_example_is_the_square_ring() {
        let world = World::from_toml(RING, "ring.toml").expect("a good file");
        let ring = World::built_in("square-ring").expect("built in");
        assert_eq!(world.canonical_text(), ring.canonical_text());
        assert_eq!(world.name(), "ring.toml");
    }

    #[test]
    fn faults_are_one_line_with_place_and_remedy() {
        let message = |text: &str| {
            World::from_toml(text, "r.toml")
                .expect_err("faulty")
                .to_string()
        };
        let form = "write outer and obstacles as lists of polygons, waypoints as a list of [x, y]";
        let unknown = message(&RING.replace("obstacles", "obstakles"));
        assert_eq!(
            unknown,
            "r.toml, line 2, column 1: unknown field `obstakles`, expected one of `outer`, \
             `obstacles`, `waypoints`; rename it to obstacles or remove it"
        );
        let missing = message(RING.split_inclusive('\n').next().expect("a line"));
        assert_eq!(
            missing,
            format!("r.toml, line 1, column 1: missing field `waypoints`; {form}")
        );
        let kind = message(&RING.replace("[0, 35]", "[0, \"a\"]"));
        assert!(
            kind.starts_with("r.toml, line 3, column 45: invalid type: string \"a\""),
            "{kind}"
        );
        let syntax = message("outer = [");
        assert!(syntax.starts_with("r.toml, line 1, column "), "{syntax}");
        let geometry = message(&RING.replace("[35, 0]", "[15, 15]"));
        assert!(
            geometry.starts_with("r.toml, waypoint 2: got [15, 15]"),
            "{geometry}"
        );
        let absent = World::read_toml("/no/such.toml")
            .expect_err("no such file")
            .to_string();
        assert!(
            absent.starts_with("cannot read the world from /no/such.toml: No such"),
            "{absent}"
        );
        for text in [unknown, missing, kind, syntax, geometry, absent] {
            assert!(!text.contains('\n'), "{text}");
        }
    }
}
