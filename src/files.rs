//! Files that are written whole or not at all: beside their place first, then renamed onto it.

use std::io::Write;
use std::path::Path;

/// Replaces the file at `path`. Nobody ever reads half of it, whatever happens in between.
///
/// # Errors
/// What the file system says.
pub fn write_whole(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    replace(path, bytes, false)
}

/// As [`write_whole`], for what cannot be made again: it survives the end of the machine too.
///
/// # Errors
/// What the file system says.
pub fn write_durable(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    replace(path, bytes, true)
}

/// What the names of files begin with that are not in their place yet.
pub const TEMPORARY: &str = ".ptm-";

fn replace(path: &Path, bytes: &[u8], is_durable: bool) -> std::io::Result<()> {
    let folder = path.parent().filter(|folder| *folder != Path::new(""));
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY);
    // A temporary file is private by default; what replaces a report is to be read by whoever the
    // user's umask lets read it.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder.unwrap_or(Path::new(".")))?;
    file.write_all(bytes)?;
    if is_durable {
        file.as_file().sync_all()?;
    }
    file.persist(path).map(drop).map_err(|error| error.error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_and_readable_as_any_other() {
        let folder = tempfile::tempdir().expect("a folder");
        let (ours, plain) = (folder.path().join("ours"), folder.path().join("plain"));
        std::fs::write(&plain, "old").expect("written");
        for text in ["first", "second"] {
            write_whole(&ours, text.as_bytes()).expect("written");
            assert_eq!(std::fs::read_to_string(&ours).expect("read"), text);
        }
        let mode = |path: &Path| std::fs::metadata(path).expect("there").permissions();
        assert_eq!(mode(&ours), mode(&plain));
        assert_eq!(std::fs::read_dir(folder.path()).expect("read").count(), 2);
    }
}
