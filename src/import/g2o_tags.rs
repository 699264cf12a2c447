//! The tags of pose graphs in the plane: g2o's, those of its tutorial, and those of iSAM and TORO.
//!
//! | a line of | fields after the tag |
//! |---|---|
//! | pose vertices | id x y θ |
//! | landmark vertices | id x y |
//! | odometry | from to x y θ, information (6) |
//! | odometry between offset frames | from to offset offset x y θ, information (6) |
//! | points | pose landmark x y, information (3) |
//! | points from an offset sensor | pose landmark offset x y, information (3) |
//! | `BR` (gtsam) | pose landmark bearing range, their standard deviations |
//! | offsets | id x y θ |

/// What a line means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tag {
    /// A vertex that is a pose.
    Pose,
    /// A vertex that is a landmark.
    Landmark,
    /// A pose seen from a pose.
    Odometry(Order),
    /// The same, each seen by a sensor with an offset.
    OffsetOdometry,
    /// A landmark seen from a pose, as a point.
    Point(Naming),
    /// The same, seen by a sensor with an offset.
    OffsetPoint,
    /// The point of g2o's tutorial: with an offset, or without as some programs write it.
    TutorialPoint,
    /// A landmark seen from a pose, as a bearing and a range.
    BearingRange,
    /// Where a sensor sits on the robot.
    Offset,
    /// Vertices that an optimiser holds still.
    Fix,
    /// Parameters that mean nothing here.
    Ignored,
    /// A line of a graph in space.
    Spatial,
    /// Anything else: left out and counted.
    Other,
}

/// The order of the six numbers of an information.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// xx xy xθ yy yθ θθ.
    Rows,
    /// As above, or TORO's xx xy yy θθ xθ yθ: `EDGE2` is used with both.
    RowsOrToro,
}

/// Which names a landmark's number is one of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Naming {
    /// The vertices, poses among them, as in g2o.
    Vertices,
    /// The landmarks alone, as in iSAM: landmark 0 is not pose 0.
    Landmarks,
}

/// The tag that a word is.
pub(super) fn tag(word: &str) -> Tag {
    match word {
        "VERTEX_SE2" | "VERTEX2" | "VERTEX" | "TUTORIAL_VERTEX_SE2" => Tag::Pose,
        "VERTEX_XY" | "VERTEX_POINT_XY" | "TUTORIAL_VERTEX_POINT_XY" => Tag::Landmark,
        "EDGE_SE2" | "TUTORIAL_EDGE_SE2" | "ODOMETRY" | "Constraint2" => Tag::Odometry(Order::Rows),
        "EDGE2" | "EDGE" => Tag::Odometry(Order::RowsOrToro),
        "EDGE_SE2_OFFSET" => Tag::OffsetOdometry,
        "EDGE_SE2_XY" | "EDGE_SE2_POINT_XY" | "EDGE_SE2_POINTXY" => Tag::Point(Naming::Vertices),
        "LANDMARK" | "LANDMARK2" => Tag::Point(Naming::Landmarks),
        "EDGE_SE2_POINTXY_OFFSET" | "EDGE_SE2_XY_OFFSET" => Tag::OffsetPoint,
        "TUTORIAL_EDGE_SE2_POINT_XY" => Tag::TutorialPoint,
        "BR" => Tag::BearingRange,
        "PARAMS_SE2OFFSET" | "TUTORIAL_PARAMS_SE2_OFFSET" => Tag::Offset,
        "FIX" => Tag::Fix,
        _ if word.starts_with("PARAMS") || word.starts_with("TUTORIAL_PARAMS") => Tag::Ignored,
        _ if is_spatial(word) => Tag::Spatial,
        _ => Tag::Other,
    }
}

fn is_spatial(word: &str) -> bool {
    const TAGS: [&str; 7] = [
        "EDGE3",
        "VERTEX3",
        "ODOMETRY3",
        "LANDMARK3",
        "POINT3",
        "Constraint3",
        "VERTEX_TRACKXYZ",
    ];
    let is_g2o = word.starts_with("EDGE_") || word.starts_with("VERTEX_");
    TAGS.contains(&word)
        || is_g2o
            && ["SE3", "SIM3", "XYZ", "POINT3"]
                .iter()
                .any(|part| word.contains(part))
}

/// Whether the first word of a file is a tag of a graph.
pub(super) fn is_graph(word: &str) -> bool {
    let is_name = word
        .chars()
        .all(|c| c.is_ascii_alphanumeric() || "_:".contains(c));
    let starts = ["VERTEX", "EDGE", "PARAMS", "TUTORIAL_"];
    is_name
        && (starts.iter().any(|start| word.starts_with(start))
            || word == "EQUIV"
            || !matches!(tag(word), Tag::Other))
}
