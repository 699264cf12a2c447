//! `run.json`: which sweep a folder is of, and who ran it, when and on what. Host, threads and dates
//! stand here and nowhere else.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::plan::Plan;
use super::shard_files::{ShardFile, shard_files};
use super::{FolderError, JournalError};
use crate::files::{path_of, read_text_at_most, write_durable};
use crate::rng::{Purpose, SAMPLER_SEMANTICS, WORLD_SEMANTICS};
use crate::sweep::{Sweep, hex};

/// More bytes than any `run.json` has, with thousands of starts and millions of chains.
pub(super) const MAX_RUN_FILE: u64 = 1_000_000_000;

/// The content of `run.json`, and for one start of a shard of the file beside its journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunFile {
    /// Name of the sweep.
    pub sweep: String,
    /// Its identity.
    pub key: String,
    /// The detections CSV that was given, if the data are not simulated; a path as
    /// [`crate::files::text_of`] writes it.
    pub data: Option<String>,
    /// Hash of all data sets.
    #[serde(default)]
    pub data_hash: String,
    /// Semantics of worlds and chains.
    pub semantics: [String; 2],
    /// All chains.
    pub chains: usize,
    /// Chains with a record, at the last end of a run.
    pub chains_done: usize,
    /// The sweep file.
    #[serde(default)]
    pub sweep_text: String,
    /// Every start, in order; of shards, as far as they have been merged.
    #[serde(default)]
    pub starts: Vec<Start>,
}

/// One start of `ptm` on this sweep.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// Seconds since 1970 at the start.
    pub started_unix_s: u64,
    /// Seconds since 1970 at the end; null while it runs, or if it was killed.
    pub ended_unix_s: Option<u64>,
    /// How it ended: `done`, or what stopped it.
    pub end: Option<String>,
    /// Chains that it ran.
    pub chains_run: usize,
    /// The shard, if it was one.
    pub shard: Option<String>,
    /// Version of the program.
    pub version: String,
    /// The commit that it was built from, if that is known.
    pub commit: Option<String>,
    /// The machine.
    pub host: String,
    /// Its processor.
    pub cpu: String,
    /// What the processor can do, of what matters here.
    pub cpu_features: Vec<String>,
    /// Instruction set of the kernels.
    pub cpu_path: String,
    /// Worker threads.
    pub threads: usize,
    /// Limit of each chain, s.
    pub max_seconds: Option<f64>,
    /// Limit of each chain, bytes.
    pub max_bytes: Option<u64>,
}

/// What lies beside the journal of one start of a shard.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ShardRun {
    /// The start.
    pub start: Start,
    /// Wall-clock seconds of every chain that it ran, by key.
    pub seconds: BTreeMap<String, f64>,
}

impl ShardRun {
    /// Writes it beside `journal`.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn write(&self, journal: &Path) -> Result<(), FolderError> {
        let path = journal.with_extension("json");
        let text = serde_json::to_string_pretty(self).expect("texts and numbers make JSON") + "\n";
        write_durable(&path, text.as_bytes())
            .map_err(|source| FolderError::io(&path, "written", source))
    }

    /// All of a folder, in the order of shards and starts. It is what ran and no result: one that cannot
    /// be read, as when the shard was killed before it wrote any, is left out.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub fn all(folder: &Path) -> Result<Vec<Self>, JournalError> {
        let read = |file: ShardFile| {
            let path = file.path.with_extension("json");
            let text = read_text_at_most(&path, MAX_RUN_FILE).ok()?;
            serde_json::from_str(&text).ok()
        };
        Ok(shard_files(folder)?.into_iter().filter_map(read).collect())
    }
}

impl RunFile {
    /// Of a sweep, before anything is run.
    pub fn new(sweep: &Sweep, plan: &Plan) -> Self {
        let csv = sweep.base.text("detections");
        let mut data = Purpose::new(WORLD_SEMANTICS, 0);
        for data_set in plan.data_sets.iter().flatten() {
            data = data.text("data", &data_set.content_hash());
        }
        Self {
            sweep: sweep.name.clone(),
            key: plan.key(sweep),
            data: (!csv.is_empty()).then(|| csv.to_owned()),
            data_hash: hex(&data.key()[..16]),
            semantics: [WORLD_SEMANTICS.to_owned(), SAMPLER_SEMANTICS.to_owned()],
            chains: plan.tasks.len(),
            chains_done: 0,
            sweep_text: sweep.text.clone(),
            starts: Vec::new(),
        }
    }

    /// How this run differs from `other`, in words.
    pub(super) fn what_it_is(&self, other: &Self) -> String {
        if self.sweep == other.sweep && self.data != other.data {
            let data = self.data.as_deref().map(path_of);
            let data = data.map(|path| path.display().to_string());
            let data = data.unwrap_or_else(|| "simulated worlds".to_owned());
            format!("another run of this sweep, on {data}")
        } else {
            format!("another sweep or other data ({})", self.sweep)
        }
    }

    /// As it is written.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).expect("texts and numbers make JSON");
        text.push('\n');
        text
    }
}
