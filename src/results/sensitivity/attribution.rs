//! How much of what a setting changes in recovery is the model's, and how much its sampler's.
//!
//! Every chain either recovers the truth or fails for one [`Fault`], so a difference in recovery
//! between two levels is the sum of the failures that one of them has fewer of each fault:
//!
//! Δ recovery = −Σ Δ fault,
//!
//! on the same cells, worlds and chains. Nothing is modelled and nothing is left over.

use super::{Response, Sensitivity};
use crate::results::Fault;

/// The largest difference in recovery that a factor makes, by fault.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribution {
    /// The factor, by its index.
    pub factor: usize,
    /// The level of lower recovery.
    pub from: usize,
    /// The level of higher recovery.
    pub to: usize,
    /// Recovery at `to` less that at `from`.
    pub recovery: f64,
    /// What of it is fewer failures of each fault, in the order of [`Fault::ALL`].
    pub by_fault: [f64; Fault::ALL.len()],
}

impl Sensitivity {
    /// Of all factors, by falling difference; empty unless every chain of known outcome was sorted.
    pub fn attributions(&self) -> Vec<Attribution> {
        let of_fault = |fault: Fault, factor: usize, levels: [usize; 2]| {
            let response = Response::FaultOf(fault);
            let own = self.contrasts.iter().find(|row| {
                (row.response, row.factor, [row.from, row.to]) == (response, factor, levels)
            });
            -own.and_then(|row| row.estimate)
                .map_or(0.0, |found| found.mean)
        };
        let strongest = self.strongest(Response::Recovery).into_iter();
        let all = strongest.filter_map(|row| {
            let recovery = row.estimate?.mean;
            let sign = if recovery < 0.0 { -1.0 } else { 1.0 };
            let levels = [row.from, row.to];
            let by_fault = Fault::ALL.map(|fault| sign * of_fault(fault, row.factor, levels));
            let [from, to] = if sign < 0.0 {
                [row.to, row.from]
            } else {
                levels
            };
            Some(Attribution {
                factor: row.factor,
                from,
                to,
                recovery: sign * recovery,
                by_fault,
            })
        });
        let all: Vec<Attribution> = all.collect();
        let adds_up =
            |own: &Attribution| (own.recovery - own.by_fault.iter().sum::<f64>()).abs() < 1e-9;
        if all.iter().all(adds_up) {
            all
        } else {
            Vec::new()
        }
    }
}

/// The share of each fault in all that the factors change, in the order of [`Fault::ALL`]: absolute
/// differences, summed over the factors; `None` if nothing changes.
pub fn shares(all: &[Attribution]) -> Option<[f64; Fault::ALL.len()]> {
    let sizes: [f64; Fault::ALL.len()] =
        std::array::from_fn(|k| all.iter().map(|own| own.by_fault[k].abs()).sum());
    let total: f64 = sizes.iter().sum();
    (total > 0.0).then(|| sizes.map(|size| size / total))
}
