//! The files of shards: one journal for each start, in the folder `shards`.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::journal::io;
use super::{JournalError, Shard};

/// Folder of the shards' files, beside the journal.
pub(super) const SHARDS: &str = "shards";

/// A file of one start of a shard.
pub(super) struct ShardFile {
    pub path: PathBuf,
    pub shard: Shard,
    pub start: u32,
}

/// The name of the journal of one start of a shard.
pub(super) fn shard_file_name(shard: Shard, start: u32) -> String {
    format!("{}-of-{}.{start}.jsonl", shard.index() + 1, shard.count())
}

/// The files of all shards of a folder, in the order of shards and starts.
///
/// # Errors
/// A folder that cannot be read.
pub(super) fn shard_files(folder: &Path) -> Result<Vec<ShardFile>, JournalError> {
    let shards = folder.join(SHARDS);
    let entries = match std::fs::read_dir(&shards) {
        Ok(entries) => entries,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(io(&shards, "read", error)),
    };
    let mut found = Vec::new();
    for entry in entries {
        let path = entry.map_err(|error| io(&shards, "read", error))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let parse = || {
            let (shard, start) = name.strip_suffix(".jsonl")?.rsplit_once('.')?;
            let shard: Shard = shard.replace("-of-", "/").parse().ok()?;
            Some((shard, start.parse().ok()?))
        };
        if let Some((shard, start)) = parse() {
            found.push(ShardFile { path, shard, start });
        }
    }
    found.sort_by_key(|file| (file.shard.count(), file.shard, file.start));
    Ok(found)
}
