//! The plain range-bearing CSV, one sighting a row, with the dead-reckoned pose it was made from:
//! `t,robot_x,robot_y,robot_theta,range,bearing,true_landmark_id` in seconds, metres and radians;
//! identity −1 (or nothing) is clutter. Plain, or compressed with gzip.

use std::io::Read;
use std::path::Path;

use super::error::ImportError;
use crate::sighting::{Pose, Sighting, wrap_rad};

const COLUMNS: [&str; 7] = [
    "t",
    "robot_x",
    "robot_y",
    "robot_theta",
    "range",
    "bearing",
    "true_landmark_id",
];
/// The first two bytes of a gzip file (RFC 1952).
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];

/// What the sensor states of its own precision; the format does not hold it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorNoise {
    /// Standard deviation of a range at distance 0, m.
    pub range_m: f64,
    /// Its growth with distance, m per m.
    pub range_growth: f64,
    /// Standard deviation of a bearing, rad.
    pub bearing_rad: f64,
}

/// Reads a recording; sightings come in the order of the file.
///
/// # Errors
/// A file that cannot be read, lacks a column, or holds a value that will not do.
pub fn read_range_bearing(path: &Path, noise: SensorNoise) -> Result<Vec<Sighting>, ImportError> {
    let shown = path.display().to_string();
    let io = |source| ImportError::Read {
        path: shown.clone(),
        source,
    };
    let mut bytes = std::fs::read(path).map_err(io)?;
    if bytes.starts_with(&GZIP_MAGIC) {
        let mut plain = Vec::new();
        flate2::read::MultiGzDecoder::new(bytes.as_slice())
            .read_to_end(&mut plain)
            .map_err(io)?;
        bytes = plain;
    }
    parse(&bytes, &shown, noise)
}

fn parse(bytes: &[u8], path: &str, noise: SensorNoise) -> Result<Vec<Sighting>, ImportError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let malformed = |error: csv::Error| ImportError::Malformed {
        path: path.to_owned(),
        what: error.to_string().replace('\n', " "),
    };
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(bytes);
    let header = reader.headers().map_err(malformed)?.clone();
    let place = |column: &str| header.iter().position(|name| name == column);
    let places: Option<Vec<usize>> = COLUMNS.iter().map(|column| place(column)).collect();
    let Some(places) = places else {
        return Err(ImportError::Header {
            path: path.to_owned(),
            got: header.iter().collect::<Vec<_>>().join(","),
            expected: COLUMNS.join(","),
        });
    };
    let mut sightings = Vec::new();
    for record in reader.records() {
        let record = record.map_err(malformed)?;
        let line = record.position().map_or(0, csv::Position::line);
        let field = |k: usize| record.get(places[k]).unwrap_or_default();
        let bad = |k: usize, expected: &'static str| ImportError::Value {
            path: path.to_owned(),
            line,
            column: COLUMNS[k],
            got: field(k).chars().take(40).collect(),
            expected,
        };
        let number = |k: usize| match field(k).parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(bad(k, "a finite number")),
        };
        let range_m = number(4)?;
        if range_m <= 0.0 {
            return Err(bad(4, "a range above 0 m"));
        }
        let landmark = match field(6) {
            "" | "-1" => None,
            text => Some(
                text.parse::<i64>()
                    .map_err(|_| bad(6, "a whole number, -1 for clutter"))?,
            ),
        };
        sightings.push(Sighting {
            time_s: number(0)?,
            believed_pose: Pose {
                x_m: number(1)?,
                y_m: number(2)?,
                heading_rad: number(3)?,
            },
            range_m,
            bearing_rad: wrap_rad(number(5)?),
            range_std_m: noise.range_m + noise.range_growth * range_m,
            bearing_std_rad: noise.bearing_rad,
            corner: None,
            landmark: landmark.filter(|&id| id >= 0),
        });
    }
    if sightings.is_empty() {
        return Err(ImportError::Empty {
            path: path.to_owned(),
        });
    }
    Ok(sightings)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    const NOISE: SensorNoise = SensorNoise {
        range_m: 0.1,
        range_growth: 0.01,
        bearing_rad: 0.02,
    };

    fn refusal(text: &str) -> String {
        parse(text.as_bytes(), "a.csv", NOISE).map_or_else(|e| e.to_string(), |s| format!("{s:?}"))
    }

    #[test]
    fn reads_columns_by_name_and_clutter_as_unknown() {
        let text = "\u{feff}true_landmark_id,t,robot_x,robot_y,robot_theta,range,bearing\r\n\
                    7,0.5,1,2,0,10,4.0\r\n-1,0.5,1,2,0,3,0\r\n";
        let sightings = parse(text.as_bytes(), "a.csv", NOISE).expect("a good recording");
        assert_eq!(sightings.len(), 2);
        assert_eq!(
            (sightings[0].landmark, sightings[1].landmark),
            (Some(7), None)
        );
        assert!((sightings[0].range_std_m - 0.2).abs() < 1e-15);
        assert!((sightings[0].bearing_rad - (4.0 - std::f64::consts::TAU)).abs() < 1e-12);
    }

    #[test]
    fn gzip_reads_like_plain_text() {
        let text = format!("{}\n1,0,0,0,2,0.1,3\n", COLUMNS.join(","));
        let file = tempfile::NamedTempFile::new().expect("a file");
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        encoder.write_all(text.as_bytes()).expect("compressed");
        std::fs::write(file.path(), encoder.finish().expect("compressed")).expect("written");
        let sightings = read_range_bearing(file.path(), NOISE).expect("a good recording");
        assert_eq!(
            sightings,
            parse(text.as_bytes(), "a.csv", NOISE).expect("a good recording")
        );
    }

    #[test]
    fn refusals_name_line_and_column() {
        let header = COLUMNS.join(",");
        assert_eq!(
            refusal(&format!("{header}\n1,0,0,0,2,0.1,3\n1,0,nan,0,2,0.1,3\n")),
            "a.csv, line 3, column robot_y: got \"nan\", expected a finite number; correct the row"
        );
        assert_eq!(
            refusal(&format!("{header}\n1,0,0,0,-2,0.1,3\n")),
            "a.csv, line 2, column range: got \"-2\", expected a range above 0 m; correct the row"
        );
        assert!(refusal("t,x\n1,2\n").contains("got the columns t,x, expected t,robot_x"));
        assert!(refusal(&format!("{header}\n")).contains("got no sightings"));
        assert!(refusal(&format!("{header}\n1,2\n")).starts_with("a.csv: CSV error"));
        assert!(refusal("\u{0}\u{1}").starts_with("a.csv"));
    }
}
