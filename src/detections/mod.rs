//! The data set: landmark detections in mission order, and their CSV.
//!
//! A set is checked once, when it is made, and never changes after: at least one detection, finite
//! positions (m), covariances (m²) for all or for none and positive definite, times (s) in order.
//! Whoever holds a [`Detections`] may rely on all of it.

mod csv;
mod error;
#[cfg(test)]
mod tests;

use std::fmt;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::input::{Identities, Identity, identity};

pub use csv::{COLUMNS, MAX_DETECTIONS};
pub use error::DetectionsError;

/// What a corner looks like from where it was seen (source report, section 2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Corner {
    /// One wall and a gap.
    Open,
    /// Both walls.
    Closed,
}

impl Corner {
    /// The name used in the CSV.
    pub fn name(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Closed => "closed",
        }
    }

    /// The kind of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Open, Self::Closed]
            .into_iter()
            .find(|corner| corner.name() == name)
    }
}

impl fmt::Display for Corner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A symmetric 2×2 covariance, m².
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Covariance {
    /// Variance of x, m².
    pub xx: f64,
    /// Covariance of x and y, m².
    pub xy: f64,
    /// Variance of y, m².
    pub yy: f64,
}

impl Covariance {
    /// xx·yy − xy², m⁴.
    pub fn determinant(self) -> f64 {
        self.xx * self.yy - self.xy * self.xy
    }

    /// Whether it is a covariance of a density in the plane. Not so for NaN or infinite values.
    pub fn is_positive_definite(self) -> bool {
        let values = [self.xx, self.xy, self.yy, self.determinant()];
        values.iter().all(|v| v.is_finite()) && self.xx > 0.0 && self.determinant() > 0.0
    }
}

/// One detection: a coherent group of sightings of what the robot took for one landmark.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detection {
    /// Position z, m, in the frame of the believed path.
    pub position_m: [f64; 2],
    /// Covariance C of the position, m².
    pub covariance_m2: Option<Covariance>,
    /// Time of the first sighting, s.
    pub first_seen_s: Option<f64>,
    /// Time of the last sighting, s.
    pub last_seen_s: Option<f64>,
    /// What the corner looked like in most sightings.
    pub corner: Option<Corner>,
    /// The landmark of more than half of the sightings, from 0 on; never read by a sampler.
    pub landmark: Option<i64>,
}

impl Detection {
    /// A detection of which only the position is known.
    pub fn at(x_m: f64, y_m: f64) -> Self {
        Self {
            position_m: [x_m, y_m],
            covariance_m2: None,
            first_seen_s: None,
            last_seen_s: None,
            corner: None,
            landmark: None,
        }
    }
}

/// Detections in mission order. At least one; positions finite; covariances all or none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detections {
    rows: Vec<Detection>,
    /// The name of each landmark from 0 on, in order of first appearance; empty if they have none.
    landmark_names: Vec<String>,
}

impl Detections {
    /// Checks the rows and takes them as they are, in mission order.
    pub fn new(rows: Vec<Detection>) -> Result<Self, DetectionsError> {
        let Some(first) = rows.first() else {
            return Err(DetectionsError::Empty {
                place: "detections".into(),
            });
        };
        let has_covariance = first.covariance_m2.is_some();
        for (ix, row) in rows.iter().enumerate() {
            let place = || format!("detection {}", ix + 1);
            check(row, place)?;
            if row.covariance_m2.is_some() != has_covariance {
                let (got, expected) = if has_covariance {
                    ("none", "a covariance as in detection 1")
                } else {
                    ("a covariance", "none as in detection 1")
                };
                return Err(DetectionsError::Value {
                    place: place(),
                    column: "cov_xx,cov_xy,cov_yy",
                    got: got.into(),
                    expected,
                    change: "give all detections a covariance or none",
                });
            }
        }
        Ok(Self {
            rows,
            landmark_names: Vec::new(),
        })
    }

    /// Gives landmarks names: landmark k of the detections is `names[k]`. Landmarks are numbered
    /// anew in order of first appearance, so that a file of the set reads back equal. If all names
    /// in use are whole numbers, those become the landmarks. Without names nothing changes.
    ///
    /// # Errors
    /// A landmark without a name, or a name that a table takes for an unknown landmark.
    pub fn with_landmark_names(mut self, names: &[String]) -> Result<Self, DetectionsError> {
        if names.is_empty() {
            return Ok(self);
        }
        let mut identities = Identities::default();
        let mut keys = Vec::with_capacity(self.rows.len());
        for (ix, row) in self.rows.iter().enumerate() {
            let Some(landmark) = row.landmark else {
                keys.push(None);
                continue;
            };
            let name = usize::try_from(landmark).ok().and_then(|k| names.get(k));
            let name = name.filter(|name| name.trim() == *name && !name.contains('\r'));
            let name = name.filter(|name| identity(name).is_some_and(|id| id != Identity::Unknown));
            let key = name.and_then(|name| identities.key(name).ok().flatten());
            if key.is_none() {
                return Err(DetectionsError::Value {
                    place: format!("detection {}", ix + 1),
                    column: "landmark",
                    got: format!("{landmark}, which has no name that a table can hold"),
                    expected: "a name for each landmark",
                    change: "give each a name that is neither empty nor a word for nothing",
                });
            }
            keys.push(key);
        }
        let numbered = identities.finish();
        for (row, key) in self.rows.iter_mut().zip(keys) {
            row.landmark = key.map(|key| numbered.numbers[key]);
        }
        self.landmark_names = numbered.names;
        Ok(self)
    }

    /// What a landmark is called: its name, or its number if landmarks have no names.
    pub fn landmark_name(&self, landmark: i64) -> String {
        let name = usize::try_from(landmark).ok();
        let name = name.and_then(|k| self.landmark_names.get(k));
        name.cloned().unwrap_or_else(|| landmark.to_string())
    }

    /// N, the number of detections; never 0.
    #[expect(
        clippy::len_without_is_empty,
        reason = "a set of detections is never empty"
    )]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// The detections in mission order.
    pub fn iter(&self) -> std::slice::Iter<'_, Detection> {
        self.rows.iter()
    }

    /// Positions z in mission order, m.
    pub fn positions_m(&self) -> Vec<[f64; 2]> {
        self.iter().map(|row| row.position_m).collect()
    }

    /// Covariances C in mission order, m²; `None` if the set has none.
    pub fn covariances_m2(&self) -> Option<Vec<Covariance>> {
        self.iter().map(|row| row.covariance_m2).collect()
    }

    /// The true landmark of each detection where known. For scoring only, never for a sampler.
    pub fn truth(&self) -> Vec<Option<i64>> {
        self.iter().map(|row| row.landmark).collect()
    }

    /// Whether the truth of any detection is known.
    pub fn has_truth(&self) -> bool {
        self.iter().any(|row| row.landmark.is_some())
    }

    /// SHA-256 of all values in mission order: equal sets hash alike, whatever file they came from.
    pub fn content_hash(&self) -> [u8; 32] {
        let mut hasher = Sha256::new();
        hasher.update(b"topometric detections 1");
        hasher.update((self.len() as u64).to_le_bytes());
        for row in self.iter() {
            for value in row.position_m {
                hasher.update(canonical_bits(value));
            }
            hash_optional(
                &mut hasher,
                row.covariance_m2
                    .map(|c| [c.xx, c.xy, c.yy].map(canonical_bits).concat()),
            );
            hash_optional(
                &mut hasher,
                row.first_seen_s.map(|v| canonical_bits(v).to_vec()),
            );
            hash_optional(
                &mut hasher,
                row.last_seen_s.map(|v| canonical_bits(v).to_vec()),
            );
            hash_optional(
                &mut hasher,
                row.corner.map(|v| v.name().as_bytes().to_vec()),
            );
            hash_optional(&mut hasher, row.landmark.map(|v| v.to_le_bytes().to_vec()));
        }
        hasher.finalize().into()
    }
}

impl<'a> IntoIterator for &'a Detections {
    type Item = &'a Detection;
    type IntoIter = std::slice::Iter<'a, Detection>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// Adding 0 turns −0 into 0, which equals it and so must hash alike.
fn canonical_bits(value: f64) -> [u8; 8] {
    (value + 0.0).to_bits().to_le_bytes()
}

/// Length-prefixed, and told apart from an absent value.
fn hash_optional(hasher: &mut Sha256, bytes: Option<Vec<u8>>) {
    match bytes {
        None => hasher.update([0]),
        Some(bytes) => {
            hasher.update([1]);
            hasher.update((bytes.len() as u64).to_le_bytes());
            hasher.update(&bytes);
        }
    }
}

/// What must hold for a detection by itself.
fn check(row: &Detection, place: impl Fn() -> String) -> Result<(), DetectionsError> {
    let fault = |column, got: String, expected, change| {
        Err(DetectionsError::Value {
            place: place(),
            column,
            got,
            expected,
            change,
        })
    };
    let numbers = [
        ("x", Some(row.position_m[0])),
        ("y", Some(row.position_m[1])),
        ("cov_xx", row.covariance_m2.map(|c| c.xx)),
        ("cov_xy", row.covariance_m2.map(|c| c.xy)),
        ("cov_yy", row.covariance_m2.map(|c| c.yy)),
        ("first_seen", row.first_seen_s),
        ("last_seen", row.last_seen_s),
    ];
    for (column, value) in numbers {
        if let Some(value) = value.filter(|v| !v.is_finite()) {
            let change = "correct the value or remove the row";
            return fault(column, value.to_string(), "a finite number", change);
        }
    }
    if let Some(landmark) = row.landmark.filter(|landmark| *landmark < 0) {
        let change = "leave out the landmark of a detection where it is unknown";
        return fault(
            "landmark",
            landmark.to_string(),
            "a number from 0 on",
            change,
        );
    }
    if let Some(c) = row.covariance_m2.filter(|c| !c.is_positive_definite()) {
        return fault(
            "cov_xx,cov_xy,cov_yy",
            format!(
                "{},{},{} with determinant {}",
                in_few_digits(c.xx),
                in_few_digits(c.xy),
                in_few_digits(c.yy),
                in_few_digits(c.determinant())
            ),
            "a positive definite covariance (cov_xx > 0, determinant > 0)",
            "correct the values, or remove the three columns to do without covariances",
        );
    }
    if let (Some(first), Some(last)) = (row.first_seen_s, row.last_seen_s)
        && last < first
    {
        let got = format!("{last} before first_seen {first}");
        return fault(
            "last_seen",
            got,
            "a time not before first_seen",
            "swap the two times",
        );
    }
    Ok(())
}

/// A number for a message: `{}` writes 10³⁰⁰ with all its zeros.
fn in_few_digits(number: f64) -> String {
    if number == 0.0 || (1e-5..1e16).contains(&number.abs()) {
        number.to_string()
    } else {
        format!("{number:e}")
    }
}
