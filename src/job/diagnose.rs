//! Chains of label vectors that another program drew: read and judged.

#[cfg(feature = "reports")]
use std::path::PathBuf;

use super::JobError;
use crate::labels::{Collector, LabelChains};
pub use crate::results::labels::diagnose_labels as diagnose;

#[cfg(feature = "reports")]
/// The chains of these files (CSV, JSON, Parquet); of each chain at most so many distinct
/// topologies are held.
///
/// # Errors
/// A file that cannot be read or will not do, as [`whole`], or no draw at all.
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
    let found = whole(collector)?;
    if found.chains.is_empty() {
        let files: Vec<String> = files
            .iter()
            .map(|file| file.display().to_string())
            .collect();
        return Err(JobError::Refused(format!(
            "{}: got no draw, expected at least one; write a row for each draw",
            files.join(", ")
        )));
    }
    Ok(found)
}

/// The chains that a collector took in, cut to the shortest.
///
/// # Errors
/// A chain that is longer than the shortest and too long to be cut.
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
/// let found = job::diagnose(chains.chains, BurnInRule::Auto, &|_| ());
/// assert_eq!((found.n_items, found.n_topologies), (3, 2));
/// # Ok::<(), job::JobError>(())
/// ```
pub fn whole(collector: Collector) -> Result<LabelChains, JobError> {
    collector.finish().map_err(|name| {
        JobError::Refused(format!(
            "{name}: got more draws than other chains and too many to be cut, expected chains of \
             one length; leave draws out at the end"
        ))
    })
}
