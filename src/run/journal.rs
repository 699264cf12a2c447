//! The journal: every finished chain, appended as one checked line.
//!
//! A line is the CRC-32 of the record in eight hexadecimal digits, a space, and the record as JSON.
//! A run that is killed leaves at most one broken line, the last one; it is cut off when the journal
//! is opened again. A broken line elsewhere means that the file was changed: it is refused.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use super::outcome::ChainRecord;

/// A journal that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// It cannot be read or written.
    #[error("{path}: cannot be {verb} ({source}); check the folder's rights and free space")]
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
}

/// An open journal.
pub struct Journal {
    path: PathBuf,
    records: HashMap<String, ChainRecord>,
    file: Mutex<File>,
    cut_off: bool,
}

impl Journal {
    /// Opens the journal, reads what it holds, and cuts off a last line that a killed run left
    /// incomplete.
    ///
    /// # Errors
    /// A file that cannot be opened, or that was damaged before its last line.
    pub fn open(path: &Path) -> Result<Self, JournalError> {
        let io = |verb| {
            move |source| JournalError::Io {
                path: path.display().to_string(),
                verb,
                source,
            }
        };
        let bytes = match std::fs::read(path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Vec::new(),
            Err(error) => return Err(io("read")(error)),
        };
        let mut records = HashMap::new();
        let mut good_length = 0;
        for (line, content) in bytes.split_inclusive(|&byte| byte == b'\n').enumerate() {
            match parse(content) {
                Some(record) => {
                    records.insert(record.key.clone(), record);
                    good_length += content.len();
                }
                None if good_length + content.len() == bytes.len() && !content.ends_with(b"\n") => {
                }
                None => {
                    return Err(JournalError::Damaged {
                        path: path.display().to_string(),
                        line: line + 1,
                    });
                }
            }
        }
        let file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(path)
            .map_err(io("written"))?;
        let cut_off = good_length < bytes.len();
        if cut_off {
            file.set_len(good_length as u64).map_err(io("written"))?;
        }
        Ok(Self {
            path: path.to_owned(),
            records,
            file: Mutex::new(file),
            cut_off,
        })
    }

    /// The record of a chain, if the journal held it when it was opened.
    pub fn get(&self, key: &str) -> Option<&ChainRecord> {
        self.records.get(key)
    }

    /// Whether an incomplete last line was cut off.
    pub fn was_cut_off(&self) -> bool {
        self.cut_off
    }

    /// Puts a record on disk.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn append(&self, record: &ChainRecord) -> Result<(), JournalError> {
        let io = |source| JournalError::Io {
            path: self.path.display().to_string(),
            verb: "written",
            source,
        };
        let json = serde_json::to_string(record).map_err(|error| io(error.into()))?;
        let line = format!("{:08x} {json}\n", crc32fast::hash(json.as_bytes()));
        let mut file = match self.file.lock() {
            Ok(file) => file,
            // Another thread panicked while it held the lock; the file itself is as good as before.
            Err(poisoned) => poisoned.into_inner(),
        };
        file.write_all(line.as_bytes()).map_err(io)
    }
}

fn parse(line: &[u8]) -> Option<ChainRecord> {
    let text = std::str::from_utf8(line).ok()?.strip_suffix('\n')?;
    let (checksum, json) = text.split_once(' ')?;
    if u32::from_str_radix(checksum, 16).ok()? != crc32fast::hash(json.as_bytes()) {
        return None;
    }
    serde_json::from_str(json).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::ChainStatus;

    fn record(key: &str) -> ChainRecord {
        let reason = "a µ and a \"quote\"".to_owned();
        ChainRecord {
            key: key.to_owned(),
            status: ChainStatus::Failed { reason },
        }
    }

    #[test]
    fn a_torn_last_line_is_cut_and_a_damaged_one_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("journal.jsonl");
        let journal = Journal::open(&path).expect("a new journal");
        for key in ["a", "b", "c"] {
            journal.append(&record(key)).expect("a write");
        }
        drop(journal);
        let bytes = std::fs::read(&path).expect("the file");
        let two_lines = bytes
            .iter()
            .enumerate()
            .filter(|(_, b)| **b == b'\n')
            .nth(1)
            .expect("three")
            .0
            + 1;
        for length in two_lines..bytes.len() {
            std::fs::write(&path, &bytes[..length]).expect("a write");
            let journal = Journal::open(&path).expect("a torn journal");
            assert_eq!(journal.get("b"), Some(&record("b")));
            assert_eq!(journal.get("c"), None);
            assert_eq!(journal.was_cut_off(), length > two_lines);
            journal.append(&record("c")).expect("a write");
            drop(journal);
            assert_eq!(std::fs::read(&path).expect("the file"), bytes);
        }
        for place in 0..two_lines {
            let mut damaged = bytes.clone();
            damaged[place] ^= 4;
            std::fs::write(&path, &damaged).expect("a write");
            assert!(
                matches!(Journal::open(&path), Err(JournalError::Damaged { .. })),
                "byte {place}"
            );
        }
    }
}
