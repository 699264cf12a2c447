//! Who may write into a report's folder, kept by locks on two files that are never renamed.
//!
//! - `.lock` belongs to the one process that writes the sweep's journal and its report: `ptm
//!   sweep`, `report` and `merge` hold it from before their first change until their last file is
//!   written.
//! - `shards/.lock` is shared by all shards while they run. Whoever replaces the sweep of the
//!   folder, or removes temporary files that may be a shard's, holds it alone for that moment.
//!
//! A shard never waits for the first lock, so `merge` may run beside shards. Locks end with their
//! process, however it ends. Where a file system has no locks nobody is refused; records are safe
//! even then, because every start of a shard writes a file of its own.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Result};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::FolderError;
use super::shard_files::{SHARDS, shard_files};

/// The file of both locks, each in its folder.
pub(super) const LOCK: &str = ".lock";
/// How long a shard waits for somebody who tidies the folder up, which takes a moment.
const PATIENCE: Duration = Duration::from_secs(10);
const PAUSE: Duration = Duration::from_millis(10);

/// A lock that is given back when it is dropped.
#[derive(Debug)]
pub(super) struct Lock {
    /// None where the file system has no locks.
    _file: Option<File>,
}

impl Lock {
    /// The lock of the one process that writes the journal and the report.
    ///
    /// # Errors
    /// A folder that cannot be written, or where another process is at work.
    pub(super) fn of_writer(folder: &Path) -> std::result::Result<Self, FolderError> {
        let path = folder.join(LOCK);
        let unwritable = |source| FolderError::io(&path, "written", source);
        let file = open(&path).map_err(unwritable)?;
        match file.try_lock() {
            Ok(()) => Ok(Self { _file: Some(file) }),
            Err(TryLockError::WouldBlock) => Err(FolderError::in_use(folder)),
            Err(TryLockError::Error(_)) => Ok(Self { _file: None }),
        }
    }

    /// The lock that all shards share.
    ///
    /// # Errors
    /// A folder that cannot be written, or whose sweep another process replaces.
    pub(super) fn of_shard(folder: &Path) -> std::result::Result<Self, FolderError> {
        let path = folder.join(SHARDS).join(LOCK);
        let unwritable = |source| FolderError::io(&path, "written", source);
        let started = Instant::now();
        while started.elapsed() < PATIENCE {
            let Some(file) = open_in_new_folder(&path).map_err(unwritable)? else {
                continue;
            };
            match file.try_lock_shared() {
                Ok(()) if is_at(&file, &path) => return Ok(Self { _file: Some(file) }),
                // The file was removed before it was locked; there is another, or none.
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => std::thread::sleep(PAUSE),
                Err(TryLockError::Error(_)) => return Ok(Self { _file: None }),
            }
        }
        Err(FolderError::in_use(folder))
    }
}

/// That no shard runs in a folder, and that none starts while this is held.
#[derive(Debug)]
pub(super) struct NoShards {
    folder: PathBuf,
    /// Whether that is certain: not where the file system has no locks.
    pub is_certain: bool,
    _file: File,
}

impl NoShards {
    /// `None` where a shard runs.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub(super) fn take(folder: &Path) -> Result<Option<Self>> {
        let path = folder.join(SHARDS).join(LOCK);
        loop {
            let Some(file) = open_in_new_folder(&path)? else {
                continue;
            };
            let is_certain = match file.try_lock() {
                Ok(()) if is_at(&file, &path) => true,
                Ok(()) => continue,
                Err(TryLockError::WouldBlock) => return Ok(None),
                Err(TryLockError::Error(_)) => false,
            };
            return Ok(Some(Self {
                folder: folder.to_owned(),
                is_certain,
                _file: file,
            }));
        }
    }
}

impl Drop for NoShards {
    /// A sweep that never had shards keeps no folder for them.
    fn drop(&mut self) {
        if self.is_certain && shard_files(&self.folder).is_ok_and(|files| files.is_empty()) {
            let shards = self.folder.join(SHARDS);
            let _ = std::fs::remove_file(shards.join(LOCK));
            let _ = std::fs::remove_dir(shards);
        }
    }
}

fn open(path: &Path) -> Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    options.open(path)
}

/// `None` if the folder was removed in between.
fn open_in_new_folder(path: &Path) -> Result<Option<File>> {
    if let Some(folder) = path.parent() {
        match std::fs::create_dir(folder) {
            Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(error),
            _ => {}
        }
    }
    match open(path) {
        Ok(file) => Ok(Some(file)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

/// Whether the file that was opened is the one at its path still.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |metadata: std::fs::Metadata| (metadata.dev(), metadata.ino());
    let (ours, there) = (file.metadata(), std::fs::metadata(path));
    ours.map(identity).ok() == there.map(identity).ok()
}

/// Windows removes no file that is open.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_writes_and_shards_run_beside() {
        let folder = tempfile::tempdir().expect("a folder");
        let writer = Lock::of_writer(folder.path()).expect("the first");
        let second = Lock::of_writer(folder.path()).expect_err("the second");
        assert!(matches!(second, FolderError::InUse { .. }), "{second}");
        let shards = [1, 2].map(|_| Lock::of_shard(folder.path()).expect("beside"));
        assert!(NoShards::take(folder.path()).expect("ours").is_none());
        drop((writer, shards));
        Lock::of_writer(folder.path()).expect("free again");
        assert!(NoShards::take(folder.path()).expect("ours").is_some());
    }

    #[test]
    fn a_shard_waits_while_the_folder_is_tidied_up_and_finds_the_new_lock() {
        let folder = tempfile::tempdir().expect("a folder");
        let alone = NoShards::take(folder.path()).expect("ours");
        assert!(alone.as_ref().is_some_and(|alone| alone.is_certain));
        std::thread::scope(|scope| {
            let shard = scope.spawn(|| Lock::of_shard(folder.path()));
            std::thread::sleep(Duration::from_millis(50));
            assert!(!shard.is_finished());
            drop(alone);
            let _shard = shard.join().expect("a thread").expect("a lock");
            assert!(NoShards::take(folder.path()).expect("ours").is_none());
        });
        drop(NoShards::take(folder.path()).expect("ours"));
        assert!(!folder.path().join(SHARDS).exists());
    }
}
