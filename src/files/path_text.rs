//! Paths as text that gives the same path back, for settings and JSON, which hold text only.
//!
//! A path that is UTF-8 is its own text. On Unix a path may hold any bytes: a byte that is not part
//! of UTF-8 becomes the character U+EF00 + byte, of the private use area. A path that holds such a
//! character already has each of its bytes written that way, so no two paths have one text.

use std::path::{Path, PathBuf};

/// The character that stands for byte 0.
#[cfg(unix)]
const FIRST: u32 = 0xEF00;

/// A path as text.
pub fn text_of(path: &Path) -> String {
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStrExt;
        let mut text = String::new();
        for chunk in path.as_os_str().as_bytes().utf8_chunks() {
            for c in chunk.valid().chars() {
                if byte_of(c).is_some() {
                    let mut buffer = [0; 4];
                    text.extend(c.encode_utf8(&mut buffer).bytes().filter_map(char_of));
                } else {
                    text.push(c);
                }
            }
            text.extend(chunk.invalid().iter().copied().filter_map(char_of));
        }
        text
    }
    #[cfg(not(unix))]
    path.to_string_lossy().into_owned()
}

/// The path that a text stands for.
pub fn path_of(text: &str) -> PathBuf {
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStringExt;
        let mut bytes = Vec::new();
        for c in text.chars() {
            let mut buffer = [0; 4];
            match byte_of(c) {
                Some(byte) => bytes.push(byte),
                None => bytes.extend(c.encode_utf8(&mut buffer).bytes()),
            }
        }
        std::ffi::OsString::from_vec(bytes).into()
    }
    #[cfg(not(unix))]
    text.into()
}

/// Only bytes from 0x80 on: those below are ASCII, and part of UTF-8 wherever they stand.
#[cfg(unix)]
fn byte_of(c: char) -> Option<u8> {
    let byte = u8::try_from(u32::from(c).checked_sub(FIRST)?).ok()?;
    (byte >= 0x80).then_some(byte)
}

#[cfg(unix)]
fn char_of(byte: u8) -> Option<char> {
    char::from_u32(FIRST + u32::from(byte))
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    fn path(bytes: &[u8]) -> &Path {
        Path::new(OsStr::from_bytes(bytes))
    }

    #[test]
    fn utf8_is_its_own_text() {
        for text in ["", "a b/ü.csv", "C:\\data\\%FF", "\u{202e}x", "\u{ef7f}"] {
            assert_eq!(text_of(Path::new(text)), text);
            assert_eq!(path_of(text), Path::new(text));
        }
    }

    #[test]
    fn every_path_has_a_text_of_its_own() {
        let cases: [&[u8]; 7] = [
            b"data-\xff.csv",
            b"data-\xfe.csv",
            b"\xc3",
            b"\xed\xa0\x80",
            b"\x80\xbf\xf0\x9f",
            "\u{efff}".as_bytes(),
            "\u{ef80}\u{efff}x".as_bytes(),
        ];
        let mut texts = std::collections::HashSet::new();
        for bytes in cases {
            let text = text_of(path(bytes));
            assert_eq!(path_of(&text), path(bytes), "{bytes:?}");
            assert!(texts.insert(text));
        }
        // Pairs and triples of bytes at every edge of UTF-8.
        let edges = [
            0x00_u8, 0x2f, 0x7f, 0x80, 0xbe, 0xbf, 0xc2, 0xed, 0xee, 0xf4, 0xff,
        ];
        for a in edges {
            for b in edges {
                for c in edges {
                    let bytes = [a, b, c];
                    assert_eq!(path_of(&text_of(path(&bytes))), path(&bytes), "{bytes:?}");
                }
            }
        }
    }
}
