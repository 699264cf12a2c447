//! Worlds by name.
//!
//! - `square-ring`, after Figure 2 of the source report: eight corners, driven one and a quarter
//!   times around. Without noise every corner is seen in exactly two stretches.
//! - `office` and `office:ROWSxCOLUMNS`: see [`OfficePlan`].
//!
//! [`crossing_ranges`], after Figure 5, has no walls: it is a set of detections.

use super::file::nearest;
use super::{OfficePlan, World, WorldError};
use crate::detections::{Covariance, Detection, Detections};

/// Names of the built-in worlds. `office` also takes a size, as in `office:2x5`.
pub const BUILT_IN_WORLDS: [&str; 2] = ["square-ring", "office"];

const EXPECTED: &str = "square-ring, office, office:ROWSxCOLUMNS or a path ending in .toml";

impl World {
    /// The built-in world of that name.
    pub fn built_in(name: &str) -> Result<Self, WorldError> {
        if let Some(size) = name.strip_prefix("office:") {
            let Some((rows, columns)) = parse_size(size) else {
                return Err(WorldError::Name {
                    got: name.into(),
                    expected: "office:ROWSxCOLUMNS with whole numbers from 1 to 100",
                    change: "write for instance office:2x5".into(),
                });
            };
            return OfficePlan {
                rows,
                columns,
                ..OfficePlan::default()
            }
            .build(name);
        }
        match name {
            "square-ring" => square_ring(),
            "office" => OfficePlan::default().build(name),
            _ => Err(WorldError::Name {
                got: name.into(),
                expected: EXPECTED,
                change: format!("write {} if that is meant", nearest(name, &BUILT_IN_WORLDS)),
            }),
        }
    }
}

fn parse_size(size: &str) -> Option<(usize, usize)> {
    let (rows, columns) = size.split_once('x')?;
    let read = |text: &str| text.parse().ok().filter(|n| (1..=100).contains(n));
    Some((read(rows)?, read(columns)?))
}

/// A ring 20 m wide around a block, driven along its middle.
///
/// The start matters: over a lap of 140 m a corner of the block is hidden for 50 m from 10 m past a
/// turn, a corner of the outer wall for 38.6 m from 15.7 m past a turn. A drive of 175 m that starts
/// at a turn has every such gap strictly inside it once, with at least 10 m of sight before and
/// after, so that drift does not change the number of stretches.
fn square_ring() -> Result<World, WorldError> {
    let square = |from: f64, to: f64| vec![[from, from], [to, from], [to, to], [from, to]];
    let waypoints = square(0.0, 35.0);
    World::new(
        "square-ring",
        vec![square(-10.0, 45.0)],
        vec![square(10.0, 25.0)],
        waypoints,
    )
}

/// Two rows of three detections whose wide ranges cross, after Figure 5 of the source report: the
/// right sets are the three pairs along the long axes, not the two rows.
pub fn crossing_ranges() -> Detections {
    let covariance = Covariance {
        xx: 30.0,
        xy: 29.9,
        yy: 30.0,
    };
    let rows = [
        (0.0, 0.0, 0),
        (2.0, 0.0, 1),
        (4.0, 0.0, 2),
        (5.0, 5.0, 0),
        (7.0, 5.0, 1),
        (9.0, 5.0, 2),
    ];
    let detection = |(x_m, y_m, landmark)| Detection {
        covariance_m2: Some(covariance),
        landmark: Some(landmark),
        ..Detection::at(x_m, y_m)
    };
    Detections::new(rows.into_iter().map(detection).collect())
        .expect("finite, and determinant 5.99")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_names_and_sizes_are_refused_in_one_line() {
        let message = |name| World::load(name).expect_err("no such world").to_string();
        assert_eq!(
            message("sqare-ring"),
            "world: got \"sqare-ring\", expected square-ring, office, office:ROWSxCOLUMNS or a path \
             ending in .toml; write square-ring if that is meant"
        );
        for name in [
            "office:",
            "office:0x3",
            "office:3",
            "office:3x-1",
            "office:3x101",
        ] {
            let expected = "expected office:ROWSxCOLUMNS with whole numbers from 1 to 100";
            assert!(message(name).contains(expected), "{name}");
        }
    }

    #[test]
    fn crossing_ranges_are_three_pairs() {
        assert_eq!(crossing_ranges().len(), 6);
        assert_eq!(crossing_ranges().truth(), [0, 1, 2, 0, 1, 2].map(Some));
    }
}
