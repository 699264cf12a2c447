//! Chains of label vectors that another program drew: read and judged.

#[cfg(feature = "reports")]
use std::path::PathBuf;

use super::JobError;
use crate::labels::{Collector, LabelChain, LabelChains};
use crate::results::labels::{LabelsResult, diagnose_labels};
use crate::settings::BurnInRule;

/// Judges chains as chains of ours are judged; `stage` hears what is computed.
///
/// # Errors
/// A burn-in that leaves no draw.
pub fn diagnose(
    chains: Vec<LabelChain>,
    burn_in: BurnInRule,
    stage: &dyn Fn(&str),
) -> Result<LabelsResult, JobError> {
    let n_draws = chains.iter().map(|chain| chain.trace.n_steps).min();
    let n_draws = n_draws.unwrap_or(0);
    match burn_in {
        BurnInRule::Fixed(n) if n >= n_draws => Err(JobError::Refused(format!(
            "burn-in: got {n}, expected auto or less than the draws of a chain ({n_draws})"
        ))),
        _ => Ok(diagnose_labels(chains, burn_in, stage)),
    }
}

/// The chains of these files (CSV, JSON, Parquet); of each chain at most so many distinct
/// topologies are held.
///
/// # Errors
/// A file that cannot be read or will not do; as [`whole`].
#[cfg(feature = "reports")]
pub fn read_labels(
    files: &[PathBuf],
    max_topologies: usize,
    stage: &dyn Fn(&str),
) -> Result<LabelChains, JobError> {
    let mut collector = Collector::new(max_topologies);
    for file in files {
        stage(&format!("reading {}", file.display()));
        if crate::table::is_parquet(file) {
            crate::table::read_labels(file, &mut collector)?;
        } else {
            crate::labels::read(crate::input::Source::open(file)?, &mut collector)?;
        }
    }
    if collector.is_empty() {
        let files: Vec<String> = files
            .iter()
            .map(|file| file.display().to_string())
            .collect();
        return Err(no_draw(&files.join(", ")));
    }
    whole(collector)
}

fn no_draw(place: &str) -> JobError {
    JobError::Refused(format!(
        "{place}: got no draw, expected at least one; write a row for each draw"
    ))
}

/// The chains that a collector took in, cut to the shortest.
///
/// # Errors
/// No draw at all; a chain that is longer than the shortest and too long to be cut.
///
/// ```
/// use topometric::job;
/// use topometric::labels::Collector;
/// use topometric::partition::Topology;
/// use topometric::settings::BurnInRule;
///
/// // Two chains of another program, 200 draws each, on three items.
/// let mut collector = Collector::new(1000);
/// for chain in 0..2_u64 {
///     for draw in 0..200_u64 {
///         let mode = (draw * 48_271 + chain * 7) % 31 < 15;
///         let labels = if mode { [0, 0, 1] } else { [0, 1, 1] };
///         let topology = Topology::canonical(&labels);
///         // One step a draw; ln of the target density is not known.
///         collector.push(&chain.to_string(), &topology, (1, 0.0)).expect("three labels");
///     }
/// }
/// let chains = job::whole(collector)?;
/// let found = job::diagnose(chains.chains, BurnInRule::Auto, &|_| ())?;
/// assert_eq!((found.n_items, found.n_topologies), (3, 2));
/// # Ok::<(), job::JobError>(())
/// ```
pub fn whole(collector: Collector) -> Result<LabelChains, JobError> {
    if collector.is_empty() {
        return Err(no_draw("labels"));
    }
    collector.finish().map_err(|name| {
        JobError::Refused(format!(
            "{name}: got more draws than other chains and too many to be cut, expected chains of \
             one length; leave draws out at the end"
        ))
    })
}
