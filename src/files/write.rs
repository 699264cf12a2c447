//! Files that are written whole or not at all: beside their place first, then renamed onto it.
//!
//! Links are followed: the file that a link leads to is replaced, and the link stays. What is no
//! regular file (a FIFO, a device, an open stream such as /dev/stdout) is written in place. So is a
//! regular file that cannot be replaced, because its folder is closed or it is a mount of its own.

use std::fs::{File, OpenOptions, Permissions};
use std::io::{Error, ErrorKind, Result, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// What the names of files begin with that are not in their place yet.
pub const TEMPORARY: &str = ".ptm-";
/// As many links as Linux follows.
const MAX_LINKS: usize = 40;
/// Another process may take a temporary file for one that a kill left behind, and remove it.
const MAX_ATTEMPTS: usize = 3;

/// Replaces the file at `path`. Nobody ever reads half of it, whatever happens in between.
///
/// # Errors
/// What the file system says.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    write(path, bytes, false)
}

/// As [`write_whole`], for what cannot be made again: it survives the end of the machine too.
///
/// # Errors
/// What the file system says.
pub fn write_durable(path: &Path, bytes: &[u8]) -> Result<()> {
    write(path, bytes, true)
}

/// As [`write_durable`], unless there is a file at `path` already: of several processes one makes
/// it. Returns whether this one has.
///
/// # Errors
/// What the file system says.
pub fn write_new(path: &Path, bytes: &[u8]) -> Result<bool> {
    match temporary(path, bytes, None, true)?.persist_noclobber(path) {
        Ok(_) => {
            sync_folder(path);
            Ok(true)
        }
        Err(error) if error.error.kind() == ErrorKind::AlreadyExists => Ok(false),
        // A file system that has neither hard links nor a rename that replaces nothing.
        Err(error) if !path.exists() => {
            error.file.persist(path).map_err(|error| error.error)?;
            Ok(true)
        }
        Err(error) => Err(error.error),
    }
}

/// Whether `path` can be written, as far as can be told without changing anything: no file is made,
/// and a FIFO is not opened, whose reader would see its end.
///
/// # Errors
/// What the file system says.
pub fn check_writable(path: &Path) -> Result<()> {
    match place_of(path)? {
        Place::File(path, Some(_)) => OpenOptions::new().append(true).open(path).map(drop),
        Place::File(path, None) => tempfile::tempfile_in(folder_of(&path))
            .map(drop)
            .map_err(|error| plain(&error)),
        Place::Open(path) if is_fifo(&path) => Ok(()),
        Place::Open(path) => OpenOptions::new().append(true).open(path).map(drop),
        Place::Output | Place::ErrorOutput => Ok(()),
    }
}

/// Whether what is written to `path` is a file, and neither a device nor a FIFO nor an open stream.
pub fn is_for_a_file(path: &Path) -> bool {
    let place = place_of(path);
    !matches!(
        place,
        Ok(Place::Open(_) | Place::Output | Place::ErrorOutput)
    )
}

/// Where a path leads.
#[derive(Debug, PartialEq)]
enum Place {
    /// A regular file, with its permissions if it is there already.
    File(PathBuf, Option<Permissions>),
    /// What is written in place.
    Open(PathBuf),
    /// The standard output of this process, which has a position of its own.
    Output,
    /// Its standard error.
    ErrorOutput,
}

fn place_of(path: &Path) -> Result<Place> {
    let mut here = path.to_owned();
    for _ in 0..MAX_LINKS {
        match descriptor(&here) {
            Some("1") => return Ok(Place::Output),
            Some("2") => return Ok(Place::ErrorOutput),
            Some(_) => return Ok(Place::Open(here)),
            None => {}
        }
        let metadata = match std::fs::symlink_metadata(&here) {
            Ok(metadata) => metadata,
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Ok(Place::File(here, None));
            }
            Err(error) => return Err(error),
        };
        if !metadata.is_symlink() {
            return match metadata.is_file() {
                true => Ok(Place::File(here, Some(metadata.permissions()))),
                false if metadata.is_dir() => Err(ErrorKind::IsADirectory.into()),
                false => Ok(Place::Open(here)),
            };
        }
        here = folder_of(&here).join(std::fs::read_link(&here)?);
    }
    Err(Error::other("too many symbolic links"))
}

/// The number of an open file of this process, if the path is the name of one. The link of such a
/// name leads to the file's place, but what is open there is not the file that a rename would put
/// there.
fn descriptor(path: &Path) -> Option<&str> {
    let path = path.to_str()?;
    match path {
        "/dev/stdout" => return Some("1"),
        "/dev/stderr" => return Some("2"),
        _ => {}
    }
    let folders = ["/dev/fd/", "/proc/self/fd/", "/proc/thread-self/fd/"];
    let number = folders
        .iter()
        .find_map(|folder| path.strip_prefix(folder))?;
    number
        .bytes()
        .all(|byte| byte.is_ascii_digit())
        .then_some(number)
}

fn write(path: &Path, bytes: &[u8], is_durable: bool) -> Result<()> {
    match place_of(path)? {
        Place::Output => write_to(std::io::stdout().lock(), bytes),
        Place::ErrorOutput => write_to(std::io::stderr().lock(), bytes),
        Place::Open(path) => write_to(OpenOptions::new().append(true).open(path)?, bytes),
        Place::File(path, permissions) => {
            let exists = permissions.is_some();
            match replace(&path, bytes, permissions, is_durable) {
                Err(error) if exists && cannot_be_replaced(&error) => {
                    let file = OpenOptions::new().write(true).truncate(true).open(path);
                    write_to(file?, bytes)
                }
                done => done,
            }
        }
    }
}

fn write_to(mut place: impl Write, bytes: &[u8]) -> Result<()> {
    place.write_all(bytes)?;
    place.flush()
}

/// A closed folder, a folder where only owners may replace their files, or a file that is a mount.
fn cannot_be_replaced(error: &Error) -> bool {
    let kinds = [
        ErrorKind::PermissionDenied,
        ErrorKind::ReadOnlyFilesystem,
        ErrorKind::ResourceBusy,
        ErrorKind::CrossesDevices,
    ];
    kinds.contains(&error.kind())
}

fn replace(
    path: &Path,
    bytes: &[u8],
    permissions: Option<Permissions>,
    is_durable: bool,
) -> Result<()> {
    for attempt in 1.. {
        let file = temporary(path, bytes, permissions.clone(), is_durable)?;
        match file.persist(path).map_err(|error| error.error) {
            Err(error) if error.kind() == ErrorKind::NotFound && attempt < MAX_ATTEMPTS => {}
            done => {
                done?;
                break;
            }
        }
    }
    if is_durable {
        sync_folder(path);
    }
    Ok(())
}

/// A file beside `path` with these bytes. It has the permissions of the file that it replaces, or
/// those that the user's umask gives to any file: a temporary file is private by default.
fn temporary(
    path: &Path,
    bytes: &[u8],
    permissions: Option<Permissions>,
    is_durable: bool,
) -> Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let usual = Permissions::from_mode(0o666);
        builder.permissions(permissions.clone().unwrap_or(usual));
    }
    let made = builder.tempfile_in(folder_of(path));
    let mut file = made.map_err(|error| plain(&error))?;
    if let Some(permissions) = permissions {
        file.as_file().set_permissions(permissions)?;
    }
    file.as_file_mut().write_all(bytes)?;
    if is_durable {
        file.as_file().sync_all()?;
    }
    Ok(file)
}

/// A rename survives the end of the machine when its folder is on disk. Some file systems cannot do
/// that.
fn sync_folder(path: &Path) {
    let _ = File::open(folder_of(path)).and_then(|folder| folder.sync_all());
}

fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    folder.unwrap_or(Path::new("."))
}

#[cfg(unix)]
fn is_fifo(path: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    std::fs::metadata(path).is_ok_and(|metadata| metadata.file_type().is_fifo())
}

#[cfg(not(unix))]
fn is_fifo(_: &Path) -> bool {
    false
}

/// What the system said, without the name of a temporary file that nobody knows.
fn plain(error: &Error) -> Error {
    let inner = error.get_ref().and_then(|inner| inner.source());
    let inner = inner.and_then(|inner| inner.downcast_ref::<Error>());
    match inner.and_then(Error::raw_os_error).or(error.raw_os_error()) {
        Some(code) => Error::from_raw_os_error(code),
        None => Error::new(error.kind(), error.to_string()),
    }
}

#[cfg(test)]
mod tests;
