//! All set partitions of N detections, in the order of their restricted growth strings.

use super::Topology;

/// Iterator over every partition of N detections; their number is the Bell number.
#[derive(Clone, Debug)]
pub struct Partitions {
    labels: Vec<u32>,
    exhausted: bool,
}

impl Partitions {
    /// Starts with all detections in one set.
    pub fn of(n: usize) -> Self {
        Self {
            labels: vec![0; n],
            exhausted: false,
        }
    }
}

impl Iterator for Partitions {
    type Item = Topology;

    fn next(&mut self) -> Option<Topology> {
        if self.exhausted {
            return None;
        }
        let current = Topology::canonical(&self.labels);
        // The successor raises the last label that is not yet one above all before it.
        self.exhausted = true;
        for i in (1..self.labels.len()).rev() {
            let highest_before = self.labels[..i].iter().max().copied().unwrap_or(0);
            if self.labels[i] <= highest_before {
                self.labels[i] += 1;
                self.labels[i + 1..].fill(0);
                self.exhausted = false;
                break;
            }
        }
        Some(current)
    }
}
