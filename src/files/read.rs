//! Files that are read up to a limit: what has no end, as /dev/zero, must not fill the memory.

use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// The bytes of a file of at most `most` bytes.
///
/// # Errors
/// What the file system says; [`ErrorKind::FileTooLarge`] for a file that has more.
pub fn read_at_most(path: &Path, most: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut file = File::open(path)?.take(most.saturating_add(1));
    file.read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        let what = format!("it has more than {} MB", most.div_ceil(1_000_000));
        return Err(Error::new(ErrorKind::FileTooLarge, what));
    }
    Ok(bytes)
}

/// As [`read_at_most`], of a text.
///
/// # Errors
/// As [`read_at_most`]; [`ErrorKind::InvalidData`] for bytes that are not UTF-8.
pub fn read_text_at_most(path: &Path, most: u64) -> Result<String> {
    let not_utf8 = |_| Error::new(ErrorKind::InvalidData, "it is not UTF-8");
    String::from_utf8(read_at_most(path, most)?).map_err(not_utf8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_the_limit_and_no_further() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a");
        std::fs::write(&path, [b'a'; 100]).expect("written");
        assert_eq!(read_at_most(&path, 100).expect("100 bytes").len(), 100);
        let error = read_at_most(&path, 99).expect_err("100 bytes");
        assert_eq!(error.kind(), ErrorKind::FileTooLarge);
        std::fs::write(&path, b"\xff").expect("written");
        let error = read_text_at_most(&path, 99).expect_err("no text");
        assert_eq!(error.kind(), ErrorKind::InvalidData);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_without_end_is_left_in_time() {
        let error = read_at_most(Path::new("/dev/zero"), 1_000_000).expect_err("no end");
        assert_eq!(error.to_string(), "it has more than 1 MB");
    }
}
