//! What is made of a chain that ran to its end: its summary, its probes, its coupled pair, and its
//! distance to the exact posterior where that is known. Sweeps and `ptm sample` finish their chains
//! here alike.

use super::coupling;
use super::exact::{ExactTables, compare};
use super::noise_of;
use super::outcome::{ChainOutcome, summarise};
use super::probes::Sender;
use crate::chain::{Start, Trace};
use crate::dataset::DataSet;
use crate::model::Model;
use crate::partition::Topology;
use crate::rng::Purpose;
use crate::settings::Settings;

/// A chain at its end, with all that it ran on.
pub(super) struct Finished<'a> {
    pub trace: &'a Trace,
    pub start: &'a Start,
    pub model: &'a Model,
    pub data: &'a DataSet,
    pub settings: &'a Settings,
    pub purpose: &'a Purpose,
    pub tables: &'a ExactTables,
}

impl Finished<'_> {
    /// Its record; `None` if `stop` ended the probes.
    pub fn outcome(&self, stop: &dyn Fn() -> bool) -> Option<ChainOutcome> {
        let mut outcome = self.without_probes();
        self.complete(&mut outcome, stop)?;
        Some(outcome)
    }

    /// Its record but for the noise of its estimates and its probes.
    pub fn without_probes(&self) -> ChainOutcome {
        let (trace, data, settings, purpose) = (self.trace, self.data, self.settings, self.purpose);
        let start = self
            .start
            .partition(data.detections.len(), purpose)
            .topology();
        let mut outcome = summarise(trace, &start, data.truth.as_ref(), settings);
        let burn_in = outcome.series.first_step;
        outcome.exact = compare(self.tables, trace, burn_in, settings, data, purpose);
        outcome
    }

    /// Adds the noise of its estimates, its probes and its coupled pair; `None` if `stop` ended
    /// these.
    pub fn complete(&self, outcome: &mut ChainOutcome, stop: &dyn Fn() -> bool) -> Option<()> {
        let (trace, settings, purpose) = (self.trace, self.settings, self.purpose);
        let burn_in = outcome.series.first_step;
        let noise = noise_of(trace, burn_in, self.model, settings, purpose);
        outcome.checks.add_noise(noise);
        outcome.probes = Vec::new();
        let map = outcome
            .top
            .first()
            .map(|top| top.labels.parse::<Topology>());
        if let Some(Ok(map)) = &map {
            let sender = Sender {
                model: self.model,
                settings,
                purpose,
                trace,
                burn_in,
                map,
            };
            outcome.probes = sender.send(stop)?;
        }
        let (from, what) = ((self.start, trace.n_steps), (self.model, settings));
        outcome.coupling = coupling::send(what, from, purpose, stop)?;
        Some(())
    }
}
