//! The journal: every finished chain, appended as one checked line.
//!
//! A line is the CRC-32 of the record in eight hexadecimal digits, a space, and the record as JSON.
//! A run that is killed leaves at most one line without its end, the last one; it is cut off when the
//! journal is opened again, and said. A line that does not fit its checksum, wherever it is, means that
//! the file was changed: it is refused. Of a chain that was run again, the last record counts.
//!
//! A sweep has `journal.jsonl`. Each start of a shard has a file of its own, so that no two processes
//! ever write to one, whatever the file system and however dead the machine is that ran the shard
//! before; `merge` gathers them.

use std::collections::{BTreeMap, HashMap};
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use super::Shard;
use super::outcome::{ChainRecord, ChainStatus};
use super::shard_files::{SHARDS, shard_file_name, shard_files};
use crate::excerpt::message;
use crate::files::write_durable;

/// A record survives the end of the process at once, and of the machine within so long.
const SYNC_INTERVAL: Duration = Duration::from_secs(1);
/// More bytes than any record has: a line that goes on for longer is none.
const MAX_RECORD: u64 = 1 << 29;
/// More starts of one shard than this are a machine gone wild.
const MAX_STARTS: u32 = 9999;

/// A journal that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// It cannot be read or written.
    #[error(
        "{path}: cannot be {verb} ({source}); check the folder's rights and free space, then run the same \
         command again: what is finished is kept"
    )]
    Io {
        /// The file.
        path: String,
        /// read or written.
        verb: &'static str,
        /// Why.
        source: std::io::Error,
    },
    /// A line does not fit its checksum.
    #[error(
        "{path}:{line}: got a damaged record, expected what a sweep wrote; move the file away and run the sweep again, or restore it"
    )]
    Damaged {
        /// The file.
        path: String,
        /// The line, from 1.
        line: usize,
    },
    /// A line is whole and is no record of ours.
    #[error(
        "{path}:{line}: got a record of another version of ptm ({what}); continue with that version, or move the file away and run the sweep again"
    )]
    OtherVersion {
        /// The file.
        path: String,
        /// The line, from 1.
        line: usize,
        /// What does not fit.
        what: String,
    },
    /// Two runs of one chain gave two results.
    #[error(
        "{path}: chain {key} has another result than in {other}, expected the same: a chain is a function of its \
         key; find the machine or build that differs, and move its file away"
    )]
    Conflict {
        /// The chain.
        key: String,
        /// The file.
        path: String,
        /// The file that was read before.
        other: String,
    },
}

/// What the bytes of a journal hold.
#[derive(Debug, PartialEq)]
pub struct Contents {
    /// Its records, in order.
    pub records: Vec<ChainRecord>,
    /// Length of the whole lines; what follows is the beginning of one.
    pub good_length: usize,
}

impl Contents {
    /// Reads the bytes of a journal; `path` is for messages.
    ///
    /// # Errors
    /// A line that does not fit its checksum or is no record, unless it is the last and has no end.
    pub fn parse(bytes: &[u8], path: &str) -> Result<Self, JournalError> {
        let mut records = Vec::new();
        let lengths = read_lines(bytes, path, |record| {
            records.push(record);
            Ok(())
        })?;
        Ok(Self {
            records,
            good_length: lengths.good as usize,
        })
    }
}

/// Bytes of a journal.
struct Lengths {
    /// In whole lines.
    good: u64,
    /// After the last end of a line.
    torn: u64,
}

/// Hands out the record of every whole line, one after the other: a journal may be larger than what its records need.
fn read_lines(
    mut reader: impl BufRead,
    path: &str,
    mut enter: impl FnMut(ChainRecord) -> Result<(), JournalError>,
) -> Result<Lengths, JournalError> {
    let (mut content, mut good, mut line) = (Vec::new(), 0, 0);
    loop {
        content.clear();
        line += 1;
        let n = reader
            .by_ref()
            .take(MAX_RECORD)
            .read_until(b'\n', &mut content)
            .map_err(|source| io(Path::new(path), "read", source))?;
        if n as u64 == MAX_RECORD {
            let path = path.to_owned();
            return Err(JournalError::Damaged { path, line });
        }
        let Some(content) = content.strip_suffix(b"\n") else {
            return Ok(Lengths {
                good,
                torn: n as u64,
            });
        };
        let path = path.to_owned();
        let json = checked(content).ok_or_else(|| JournalError::Damaged {
            path: path.clone(),
            line,
        })?;
        let record = serde_json::from_str(json).map_err(|error| {
            let what = message(&error.to_string());
            JournalError::OtherVersion { path, line, what }
        })?;
        enter(record)?;
        good += n as u64;
    }
}

fn checked(line: &[u8]) -> Option<&str> {
    let (checksum, json) = std::str::from_utf8(line).ok()?.split_once(' ')?;
    (checksum == format!("{:08x}", crc32fast::hash(json.as_bytes()))).then_some(json)
}

/// A record as a line.
fn line(record: &ChainRecord) -> String {
    let json = serde_json::to_string(record).expect("texts and numbers make JSON");
    format!("{:08x} {json}\n", crc32fast::hash(json.as_bytes()))
}

/// An open journal.
pub struct Journal {
    records: HashMap<String, Held>,
    n_duplicates: usize,
    writer: Option<Mutex<Writer>>,
    notes: Vec<String>,
}

struct Held {
    record: ChainRecord,
    /// The file that it is from, by its place among those that were read; the sweep's own is the first.
    file: usize,
}

struct Writer {
    path: PathBuf,
    file: File,
    /// Bytes of whole lines.
    length: u64,
    synced: Instant,
    /// Why it takes no more, once a record could not be written.
    broken_by: Option<std::io::Error>,
}

impl Journal {
    /// Opens the journal of a folder for the one process that holds the folder's lock: reads what
    /// it and all shards hold, and cuts off a last line that a killed run left incomplete.
    ///
    /// # Errors
    /// A file that cannot be opened or is damaged.
    pub fn open(folder: &Path) -> Result<Self, JournalError> {
        let path = journal_file(folder);
        let file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&path)
            .map_err(|source| io(&path, "written", source))?;
        let mut journal = Self::empty();
        let mut read = Vec::new();
        let length = journal.read(&path, &mut read)?;
        for file in shard_files(folder)? {
            journal.read(&file.path, &mut read)?;
        }
        file.set_len(length)
            .map_err(|source| io(&path, "written", source))?;
        journal.write_to(&path, file, length);
        Ok(journal)
    }

    /// Opens a journal for one start of a shard: reads what the sweep's journal and earlier starts of
    /// the shard hold, and writes to a file that nobody else has.
    ///
    /// # Errors
    /// A file that cannot be opened or is damaged.
    pub fn open_shard(folder: &Path, shard: Shard) -> Result<Self, JournalError> {
        let mut journal = Self::empty();
        let mut read = Vec::new();
        journal.read(&journal_file(folder), &mut read)?;
        for file in shard_files(folder)? {
            // Other shards of the same count hold none of its chains.
            if file.shard == shard || file.shard.count() != shard.count() {
                journal.read(&file.path, &mut read)?;
            }
        }
        let shards = folder.join(SHARDS);
        std::fs::create_dir_all(&shards).map_err(|source| io(&shards, "written", source))?;
        for start in 1..=MAX_STARTS {
            let path = shards.join(shard_file_name(shard, start));
            match OpenOptions::new().create_new(true).append(true).open(&path) {
                Ok(file) => {
                    journal.write_to(&path, file, 0);
                    return Ok(journal);
                }
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => return Err(io(&path, "written", error)),
            }
        }
        let many = std::io::Error::other(format!("shard {shard} was started {MAX_STARTS} times"));
        Err(io(&shards, "written", many))
    }

    /// Reads the journals of a folder, which somebody else may be writing.
    ///
    /// # Errors
    /// A file that cannot be read or is damaged.
    pub fn read_only(folder: &Path) -> Result<Self, JournalError> {
        let mut journal = Self::empty();
        let mut read = Vec::new();
        journal.read(&journal_file(folder), &mut read)?;
        for file in shard_files(folder)? {
            journal.read(&file.path, &mut read)?;
        }
        Ok(journal)
    }

    /// Whether a folder holds the journal of a sweep or of a shard, by its first record.
    pub(super) fn is_in(folder: &Path) -> bool {
        let begins = |path: &Path| {
            let mut line = Vec::new();
            let Ok(file) = File::open(path) else {
                return false;
            };
            let read = BufReader::new(file.take(MAX_RECORD)).read_until(b'\n', &mut line);
            let content = line.strip_suffix(b"\n");
            read.is_ok() && content.is_some_and(|content| checked(content).is_some())
        };
        let shards = shard_files(folder).unwrap_or_default();
        begins(&journal_file(folder)) || shards.iter().any(|file| begins(&file.path))
    }

    /// A journal of nothing, on no disk.
    pub fn empty() -> Self {
        Self {
            records: HashMap::new(),
            n_duplicates: 0,
            writer: None,
            notes: Vec::new(),
        }
    }

    /// Reads a file, if it is there, into the records; returns the length of its whole lines.
    fn read(&mut self, path: &Path, read: &mut Vec<String>) -> Result<u64, JournalError> {
        let file = File::open(path);
        let name = path.display().to_string();
        read.push(name.clone());
        let file = match file {
            Ok(file) => BufReader::new(file),
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(0),
            Err(error) => return Err(io(path, "read", error)),
        };
        let lengths = read_lines(file, &name, |mut record| {
            record.shrink();
            self.enter(record, read)
        })?;
        if lengths.torn > 0 {
            self.notes.push(format!(
                "{name}: the last record ends after {} bytes, as a kill leaves it; that chain is run again",
                lengths.torn
            ));
        }
        Ok(lengths.good)
    }

    /// What ended stands; of failures the last. Results of one chain must be the same.
    fn enter(&mut self, record: ChainRecord, read: &[String]) -> Result<(), JournalError> {
        let file = read.len() - 1;
        if let Some(held) = self.records.get_mut(&record.key)
            && let ChainStatus::Done(_) = held.record.status
        {
            if let ChainStatus::Done(_) = record.status {
                if record != held.record {
                    return Err(JournalError::Conflict {
                        key: record.key,
                        path: read[file].clone(),
                        other: read[held.file].clone(),
                    });
                }
                // What a merge has put into the sweep's own journal is no second run.
                if held.file > 0 {
                    self.n_duplicates += 1;
                } else {
                    held.file = file;
                }
            }
            return Ok(());
        }
        self.records
            .insert(record.key.clone(), Held { record, file });
        Ok(())
    }

    fn write_to(&mut self, path: &Path, file: File, length: u64) {
        self.writer = Some(Mutex::new(Writer {
            path: path.to_owned(),
            file,
            length,
            synced: Instant::now(),
            broken_by: None,
        }));
    }

    /// Replaces the folder's journal by one that holds every record once: those of `keys` in their order,
    /// then the rest. The files of shards stay: a machine that was thought dead may be writing one.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn rewrite<'a>(
        &self,
        folder: &Path,
        keys: impl Iterator<Item = &'a String>,
    ) -> Result<(), JournalError> {
        let mut left: BTreeMap<&String, &Held> = self.records.iter().collect();
        let first: Vec<&Held> = keys.filter_map(|key| left.remove(key)).collect();
        let lines = first.into_iter().chain(left.into_values());
        let text: String = lines.map(|held| line(&held.record)).collect();
        let path = journal_file(folder);
        write_durable(&path, text.as_bytes()).map_err(|source| io(&path, "written", source))
    }

    /// Chains that it has a record of.
    pub fn n_records(&self) -> usize {
        self.records.len()
    }

    /// The record of a chain, if the journal held it when it was opened.
    pub fn get(&self, key: &str) -> Option<&ChainRecord> {
        self.records.get(key).map(|held| &held.record)
    }

    /// All records by their keys.
    pub fn into_records(self) -> HashMap<String, ChainRecord> {
        let records = self.records.into_iter();
        records.map(|(key, held)| (key, held.record)).collect()
    }

    /// How many results were there more than once, the same each time.
    pub fn n_duplicates(&self) -> usize {
        self.n_duplicates
    }

    /// The file that it writes to.
    pub fn path(&self) -> Option<PathBuf> {
        let writer = self.writer.as_ref()?;
        Some(lock(writer).path.clone())
    }

    /// What was found amiss and mended, a line each.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Puts a record on disk.
    ///
    /// # Errors
    /// A file that cannot be written. It is left with whole lines only, and takes no more.
    ///
    /// # Panics
    /// On a journal that was opened to be read.
    pub fn append(&self, record: &ChainRecord) -> Result<(), JournalError> {
        self.writer().append(line(record).as_bytes())
    }

    /// Has everything on disk, beyond the end of the machine.
    ///
    /// # Errors
    /// A file that cannot be written.
    ///
    /// # Panics
    /// On a journal that was opened to be read.
    pub fn flush(&self) -> Result<(), JournalError> {
        self.writer().sync()
    }

    fn writer(&self) -> MutexGuard<'_, Writer> {
        let writer = self.writer.as_ref().expect("a journal that is written to");
        lock(writer)
    }
}

/// Another thread may have panicked while it held the lock; the file itself is as good as before.
fn lock(writer: &Mutex<Writer>) -> MutexGuard<'_, Writer> {
    writer
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

impl Writer {
    fn append(&mut self, line: &[u8]) -> Result<(), JournalError> {
        if let Some(cause) = &self.broken_by {
            return Err(io(&self.path, "written", same_error(cause)));
        }
        if let Err(error) = self.file.write_all(line) {
            // A full disk takes half a line; the next record must not follow it.
            let _ = self.file.set_len(self.length);
            let cause = self.broken_by.insert(error);
            return Err(io(&self.path, "written", same_error(cause)));
        }
        self.length += line.len() as u64;
        if self.synced.elapsed() >= SYNC_INTERVAL {
            self.sync()?;
        }
        Ok(())
    }

    fn sync(&mut self) -> Result<(), JournalError> {
        self.synced = Instant::now();
        self.file
            .sync_data()
            .map_err(|source| io(&self.path, "written", source))
    }
}

/// The error once more: whichever chain is heard, the user reads what the machine said.
fn same_error(cause: &std::io::Error) -> std::io::Error {
    match cause.raw_os_error() {
        Some(code) => std::io::Error::from_raw_os_error(code),
        None => std::io::Error::new(cause.kind(), cause.to_string()),
    }
}

/// The journal of a folder.
fn journal_file(folder: &Path) -> PathBuf {
    folder.join("journal.jsonl")
}

/// A journal that cannot be read or written.
pub(super) fn io(path: &Path, verb: &'static str, source: std::io::Error) -> JournalError {
    JournalError::Io {
        path: path.display().to_string(),
        verb,
        source,
    }
}

#[cfg(test)]
#[path = "journal_tests.rs"]
mod tests;
