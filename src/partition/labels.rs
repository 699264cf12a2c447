//! The canonical form of a topology.

use std::collections::HashMap;
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

/// A topology as a restricted growth string: `labels[i]` is the set of detection i, and sets are
/// numbered in the order in which they first appear. Written `0,0,1,2`. Clones share the labels.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Topology {
    labels: Arc<[u32]>,
}

/// Numbers that are this many times as spread as there are labels are hashed instead.
const ROOM_PER_LABEL: usize = 8;

/// A text that is no list of labels.
#[derive(Debug, thiserror::Error)]
#[error(
    "label {place}: got {got:?}, expected a whole number; write one label per detection, as in 0,0,1,2"
)]
pub struct LabelsError {
    place: usize,
    got: String,
}

impl Topology {
    /// The canonical form of any labelling.
    pub fn canonical<L: Copy + Eq + std::hash::Hash>(labels: &[L]) -> Self {
        let mut canonical_of = HashMap::with_capacity(labels.len());
        let labels = labels
            .iter()
            .map(|&label| {
                let next = canonical_of.len() as u32;
                *canonical_of.entry(label).or_insert(next)
            })
            .collect();
        Self { labels }
    }

    /// The same of whole numbers: in two passes over an array where they lie close together, as
    /// labels of samplers do.
    pub fn of_numbers(labels: &[i64]) -> Self {
        let (low, high) = match (labels.iter().min(), labels.iter().max()) {
            (Some(&low), Some(&high)) => (low, high),
            _ => (0, 0),
        };
        let most = (ROOM_PER_LABEL * labels.len()) as u64;
        let span = high.abs_diff(low);
        if span > most {
            return Self::canonical(labels);
        }
        let numbered = |&label: &i64| label.wrapping_sub(low) as u32;
        Self::of_numbered_sets(labels.iter().map(numbered), span as usize + 1)
    }

    /// The same of labels below `n_sets`, in a pass over an array.
    pub fn of_numbered_sets(labels: impl Iterator<Item = u32>, n_sets: usize) -> Self {
        let mut canonical_of = vec![u32::MAX; n_sets];
        let mut next = 0;
        let canonical = labels.map(|label| {
            let canonical = &mut canonical_of[label as usize];
            if *canonical == u32::MAX {
                *canonical = next;
                next += 1;
            }
            *canonical
        });
        Self {
            labels: canonical.collect(),
        }
    }

    /// The set of every detection.
    pub fn labels(&self) -> &[u32] {
        &self.labels
    }

    /// Number of sets M.
    pub fn n_sets(&self) -> usize {
        self.labels
            .iter()
            .max()
            .map_or(0, |&largest| largest as usize + 1)
    }

    /// The members of every set, both in rising order.
    pub fn sets(&self) -> Vec<Vec<u32>> {
        let mut sets = vec![Vec::new(); self.n_sets()];
        for (i, &label) in (0..).zip(self.labels.iter()) {
            sets[label as usize].push(i);
        }
        sets
    }

    /// The topology of some of the detections only, in the order given.
    #[must_use]
    pub fn restricted_to(&self, detections: &[usize]) -> Self {
        let labels: Vec<u32> = detections.iter().map(|&i| self.labels[i]).collect();
        Self::canonical(&labels)
    }
}

impl fmt::Display for Topology {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, label) in self.labels.iter().enumerate() {
            if i > 0 {
                f.write_str(",")?;
            }
            write!(f, "{label}")?;
        }
        Ok(())
    }
}

impl FromStr for Topology {
    type Err = LabelsError;

    fn from_str(text: &str) -> Result<Self, LabelsError> {
        let mut labels = Vec::new();
        let entries = text.split(|c: char| c == ',' || c.is_whitespace());
        for (place, entry) in entries.filter(|entry| !entry.is_empty()).enumerate() {
            let label: u32 = entry.parse().map_err(|_| LabelsError {
                place,
                got: entry.to_owned(),
            })?;
            labels.push(label);
        }
        Ok(Self::canonical(&labels))
    }
}
