//! What of a chain's trace is kept in its record, so that chains can be compared with one another
//! when the traces are gone: M, ln target and the topology after burn-in, and who shares a set.
//!
//! **Exact** for a chain of at most [`MAX_STRETCHES`] stretches after burn-in, which is most chains
//! of set partitions: they stand still. Of a chain that moved more often every `stride`-th state is
//! kept and stands for the steps since the one before; of one whose topologies do not all fit, its
//! [snapshots](crate::chain::Snapshots). That is a systematic sample of the chain, so whatever is
//! computed of it holds for the chain; **what is lost** is resolution: it is worth at most
//! [`MAX_STRETCHES`] independent draws, and an excursion of less than a stride may be missed. A
//! chain's own means, counts and most visited topologies are of all its steps and stand beside this.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};

use super::pairs::{PairSeries, unsure_pairs};
use crate::chain::{ChainSums, TopologyCount, TopologyId, Trace};
use crate::diagnostics::loss::Loss;
use crate::partition::{Partition, Topology};

/// Stretches kept of a chain at most: ten times the effective draws that a chain needs (100), and
/// 20 kB of journal.
pub const MAX_STRETCHES: u64 = 1000;
/// Pairs of detections that share a set in a smaller part of the draws are left out.
pub const LEAST_TOGETHER: f64 = 0.001;

/// A chain after its burn-in, in stretches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChainSeries {
    /// The step that the first stretch begins at: the burn-in, or 0 if the chain has none.
    pub first_step: u64,
    /// Steps from one kept state to the next; 1 where every state is kept.
    pub stride: u64,
    /// Steps of each stretch.
    pub lengths: Vec<u64>,
    /// M of each stretch.
    pub n_sets: Vec<u32>,
    /// ln P(T) + ln Ẑ(T) of each stretch.
    pub ln_target: Vec<f64>,
    /// The topology of each stretch, by its place in `topologies`.
    pub topology: Vec<u32>,
    /// Identities of the topologies, in the order in which they are first met.
    pub topologies: Vec<String>,
    /// The variation of information of each of them to the chain's MAP topology, nats; −1 if it has
    /// none.
    #[serde(default)]
    pub map_distance: Vec<f32>,
    /// Detections i < j and the share of **all** draws after burn-in that puts them into one set.
    pub together: Vec<(u32, u32, f32)>,
    /// Pairs that are sometimes in one set and sometimes not, stretch by stretch.
    pub unsure_pairs: Vec<PairSeries>,
}

/// Sixteen hexadecimal digits that two topologies share with probability 2⁻⁶⁴.
pub fn topology_identity(topology: &Topology) -> String {
    let hash = Partition::from_labels(topology.labels()).hash();
    format!("{:016x}", hash as u64 ^ (hash >> 64) as u64)
}

impl ChainSeries {
    /// Of a trace after `burn_in` steps, its topology counts and its sums from there on.
    pub(super) fn new(
        trace: &Trace,
        burn_in: u64,
        frequencies: &[TopologyCount],
        sums: &ChainSums,
    ) -> Self {
        let (stride, kept) = kept(trace, burn_in);
        let mut series = Self {
            first_step: burn_in,
            stride,
            lengths: kept.iter().map(|own| own.length).collect(),
            n_sets: kept.iter().map(|own| own.n_sets).collect(),
            ln_target: kept.iter().map(|own| own.ln_target).collect(),
            topology: Vec::with_capacity(kept.len()),
            topologies: Vec::new(),
            map_distance: Vec::new(),
            together: together(sums),
            unsure_pairs: Vec::new(),
        };
        let map = frequencies.first().map(|row| &row.topology);
        let mut place_of = HashMap::new();
        for own in &kept {
            let (topologies, distances) = (&mut series.topologies, &mut series.map_distance);
            let place = *place_of.entry(own.id).or_insert_with(|| {
                topologies.push(topology_identity(own.topology));
                distances.push(distance(own.topology, map));
                topologies.len() as u32 - 1
            });
            series.topology.push(place);
        }
        let labels: Vec<&[u32]> = kept.iter().map(|own| own.topology.labels()).collect();
        series.unsure_pairs = unsure_pairs(&labels, sums);
        series
    }

    pub(super) fn shrink(&mut self) {
        self.lengths.shrink_to_fit();
        self.n_sets.shrink_to_fit();
        self.ln_target.shrink_to_fit();
        self.topology.shrink_to_fit();
        self.topologies.shrink_to_fit();
        self.map_distance.shrink_to_fit();
        self.together.shrink_to_fit();
        self.unsure_pairs.shrink_to_fit();
    }

    /// The distance to the chain's MAP topology in stretch `k`; NaN if it is not known.
    pub fn distance_to_map(&self, k: usize) -> f64 {
        let distance = self.map_distance.get(self.topology[k] as usize);
        distance
            .filter(|d| **d >= 0.0)
            .map_or(f64::NAN, |d| f64::from(*d))
    }

    /// The step after the last.
    pub fn end_step(&self) -> u64 {
        self.first_step + self.lengths.iter().sum::<u64>()
    }

    /// A value of each stretch with its number of steps, from step `first_step` on.
    pub fn stretches<'a, T: Copy>(
        &'a self,
        values: &'a [T],
        first_step: u64,
    ) -> impl Iterator<Item = (T, u64)> + 'a {
        let mut start = self.first_step;
        let stretch = move |(&value, &length): (&T, &u64)| {
            let end = start + length;
            let kept = end.saturating_sub(first_step.max(start));
            start = end;
            (kept > 0).then_some((value, kept))
        };
        values.iter().zip(&self.lengths).filter_map(stretch)
    }
}

/// −1 if the chain has no MAP topology.
fn distance(topology: &Topology, map: Option<&Topology>) -> f32 {
    map.map_or(-1.0, |map| {
        Loss::VariationOfInformation.distance(topology, map) as f32
    })
}

/// A state that is kept of a chain.
struct Kept<'a> {
    /// Steps that it stands for.
    length: u64,
    n_sets: u32,
    ln_target: f64,
    id: TopologyId,
    topology: &'a Topology,
}

/// Steps from one kept state to the next, and the states.
fn kept(trace: &Trace, burn_in: u64) -> (u64, Vec<Kept<'_>>) {
    if let Some(snapshots) = trace.snapshots() {
        let states = snapshots.after(burn_in, trace.n_steps);
        let kept = states.map(|(state, length)| Kept {
            length,
            n_sets: state.n_sets,
            ln_target: state.ln_target,
            id: state.id,
            topology: &state.topology,
        });
        return (snapshots.every(), kept.collect());
    }
    let n_stretches = trace.dwell_times(burn_in).count() as u64;
    let n_steps: u64 = trace.dwell_times(burn_in).map(|(_, dwell)| dwell).sum();
    let stride = if n_stretches <= MAX_STRETCHES {
        1
    } else {
        n_steps.div_ceil(MAX_STRETCHES)
    };
    // Steps that the states kept so far stand for, once `end` steps are seen.
    let covered = |end: u64| {
        if end == n_steps {
            n_steps
        } else {
            end / stride * stride
        }
    };
    let (mut start, mut kept) = (0, Vec::new());
    for (run, dwell) in trace.dwell_times(burn_in) {
        let length = covered(start + dwell) - covered(start);
        start += dwell;
        if length > 0 {
            let topology = trace.topologies.get(run.topology);
            kept.push(Kept {
                length,
                n_sets: run.n_sets,
                ln_target: run.ln_target,
                id: run.topology,
                topology: topology.expect("a whole trace holds its topologies"),
            });
        }
    }
    (stride, kept)
}

fn together(sums: &ChainSums) -> Vec<(u32, u32, f32)> {
    let total = sums.n_sets.n as f64;
    let share = |(&(i, j), &steps): (&(u32, u32), &u64)| (i, j, steps as f64 / total);
    let mut pairs: Vec<(u32, u32, f32)> = sums
        .pairs
        .iter()
        .map(share)
        .filter(|(_, _, share)| *share >= LEAST_TOGETHER)
        .map(|(i, j, share)| (i, j, share as f32))
        .collect();
    pairs.sort_unstable_by_key(|&(i, j, _)| (i, j));
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::{Run, TopologyTable, TraceRecorder};

    /// A trace that stands at topology k % 3 of three detections for `dwell(k)` steps.
    fn trace(n_runs: u64, dwell: impl Fn(u64) -> u64) -> Trace {
        let labels: [[u32; 3]; 3] = [[0, 1, 2], [0, 0, 1], [0, 0, 0]];
        let mut trace = TraceRecorder::new(100).finish();
        let mut table = TopologyTable::new(100);
        for k in 0..n_runs {
            let labels = &labels[(k % 3) as usize];
            let partition = Partition::from_labels(labels);
            trace.runs.push(Run {
                first_step: trace.n_steps,
                topology: table.enter(&partition),
                n_sets: partition.n_sets() as u32,
                ln_target: k as f64,
            });
            trace.n_steps += dwell(k);
        }
        trace.topologies = table;
        trace
    }

    fn series(trace: &Trace, burn_in: u64) -> ChainSeries {
        let frequencies = trace.frequencies(burn_in);
        ChainSeries::new(trace, burn_in, &frequencies, &trace.sums(burn_in))
    }

    #[test]
    fn a_chain_of_few_moves_is_kept_whole() {
        let kept = series(&trace(5, |k| k + 1), 2);
        assert_eq!((kept.first_step, kept.stride, kept.end_step()), (2, 1, 15));
        // The burn-in cuts the second stretch, steps 1 and 2.
        assert_eq!(kept.lengths, [1, 3, 4, 5]);
        assert_eq!(kept.n_sets, [2, 1, 3, 2]);
        assert_eq!(kept.topology, [0, 1, 2, 0]);
        assert_eq!(kept.topologies.len(), 3);
        // {0, 1}, {2} holds 6 of 13 steps; ln 3 − ⅔ ln 2 from one set, ⅔ ln 2 from three.
        let apart = [1, 0, 2].map(|k| kept.distance_to_map(k));
        let pair = 2.0 / 3.0 * 2.0_f64.ln();
        let expected = [3.0_f64.ln() - pair, 0.0, pair];
        for (found, expected) in apart.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{apart:?}");
        }
        let later: Vec<(u32, u64)> = kept.stretches(&kept.n_sets, 7).collect();
        assert_eq!(later, [(3, 3), (2, 5)]);
        assert_eq!(kept.stretches(&kept.n_sets, 0).count(), 4);
        // 0 and 1 are together in [0,0,1] for 6 and in [0,0,0] for 3 of 13 steps.
        assert_eq!(kept.together[0], (0, 1, (9.0 / 13.0) as f32));
        let unsure: Vec<_> = kept.unsure_pairs.iter().map(|own| own.pair).collect();
        assert_eq!(unsure.len(), 3, "{unsure:?}");
        for own in &kept.unsure_pairs {
            let together: Vec<bool> = (0..4).map(|k| own.is_together(k)).collect();
            let expected = match own.pair {
                (0, 1) => [true, true, false, true],
                _ => [false, true, false, false],
            };
            assert_eq!(together, expected, "{:?}", own.pair);
        }
    }

    #[test]
    fn a_chain_of_many_moves_is_sampled_at_even_steps() {
        let n = 2 * MAX_STRETCHES + 1;
        let whole = trace(n, |_| 1);
        let kept = series(&whole, 0);
        // 2,001 steps at a stride of 3: 667 states, every third, each for three steps.
        assert_eq!(
            (kept.stride, kept.lengths.len(), kept.end_step()),
            (3, 667, n)
        );
        assert!(kept.lengths.iter().all(|length| *length == 3));
        assert!(
            kept.ln_target
                .iter()
                .zip(0..)
                .all(|(x, k)| *x == f64::from(3 * k + 2))
        );
        // A standstill between moves is one stretch however long, and the end is always covered.
        let uneven = trace(MAX_STRETCHES + 7, |k| if k == 3 { 5000 } else { 1 });
        let kept = series(&uneven, 0);
        assert_eq!(kept.end_step(), uneven.n_steps);
        assert!(kept.lengths.iter().any(|length| *length > 4990));
        assert!(kept.lengths.len() as u64 <= MAX_STRETCHES);
    }

    #[test]
    fn the_record_survives_the_journal() {
        let kept = series(&trace(40, |k| k % 4 + 1), 3);
        let text = serde_json::to_string(&kept).expect("a record");
        assert_eq!(
            serde_json::from_str::<ChainSeries>(&text).expect("the record"),
            kept
        );
    }
}
