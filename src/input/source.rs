//! One file, read once from front to back: gzip unpacked, UTF-16 decoded, bounded.
//!
//! Lines end with `\n`, `\r\n` or `\r`. A file larger than [`MAX_BYTES`] when unpacked, of more
//! lines than [`MAX_LINES`] or with a line longer than [`MAX_LINE_BYTES`] is refused when that
//! much of it has been read, so that an endless file or a gzip bomb costs little.

use std::io::{Cursor, Read};
use std::path::{Path, PathBuf};

use flate2::read::MultiGzDecoder;

use super::error::{Content, InputError, Place};
use super::kind;
use super::utf16::Utf16;

/// A file may hold 256 MiB when unpacked.
pub const MAX_BYTES: u64 = 256 << 20;
/// A file may hold so many lines.
pub const MAX_LINES: u64 = 2_000_000;
/// A line, or a row of a table whose quoted cells span lines, may hold 1 MiB.
pub const MAX_LINE_BYTES: usize = 1 << 20;

/// The first two bytes of a gzip file (RFC 1952).
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];
/// What a UTF-8 file may start with and mean nothing by.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
/// Read at a time.
const BLOCK_BYTES: usize = 1 << 16;

/// How far the reading of a file has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadSoFar {
    /// Bytes read of the file as it is on disk.
    pub bytes: u64,
    /// All its bytes, where the system knows.
    pub of_bytes: Option<u64>,
}

/// A text that is being read.
pub struct Source<'a> {
    path: PathBuf,
    reader: Box<dyn Read + 'a>,
    utf16: Option<Utf16>,
    /// Decoded and not yet handed out.
    block: Vec<u8>,
    /// How much of the block was handed out.
    used: usize,
    n_bytes: u64,
    is_at_end: bool,
    /// Lines that were handed out or begun.
    line: u64,
    /// The last line ended with `\r`: a `\n` that follows belongs to it.
    after_return: bool,
}

impl<'a> Source<'a> {
    /// Opens a file.
    ///
    /// # Errors
    /// A file that cannot be read, or that is no text.
    pub fn open(path: &Path) -> Result<Source<'static>, InputError> {
        Source::open_watched(path, |_| ())
    }

    /// Opens a file and tells after every block how far the reading has come.
    ///
    /// # Errors
    /// As [`Source::open`].
    pub fn open_watched(
        path: &Path,
        mut watch: impl FnMut(ReadSoFar) + 'a,
    ) -> Result<Self, InputError> {
        let failed = |source| InputError::Read {
            path: path.to_owned(),
            source,
        };
        let file = std::fs::File::open(path).map_err(failed)?;
        let of_bytes = file.metadata().ok().filter(std::fs::Metadata::is_file);
        let of_bytes = of_bytes.map(|metadata| metadata.len());
        let reader = Watched {
            reader: file,
            bytes: 0,
            watch: move |bytes| watch(ReadSoFar { bytes, of_bytes }),
        };
        Self::from_reader(reader, path)
    }

    /// Reads anything readable; `path_for_messages` is what errors call it.
    ///
    /// # Errors
    /// As [`Source::open`].
    pub fn from_reader(
        reader: impl Read + 'a,
        path_for_messages: &Path,
    ) -> Result<Self, InputError> {
        let mut source = Self {
            path: path_for_messages.to_owned(),
            reader: Box::new(reader),
            utf16: None,
            block: Vec::new(),
            used: 0,
            n_bytes: 0,
            is_at_end: false,
            line: 0,
            after_return: false,
        };
        let head = source.head(GZIP_MAGIC.len())?;
        let rest = std::mem::replace(&mut source.reader, Box::new(std::io::empty()));
        let is_gzip = head == GZIP_MAGIC;
        let whole = Cursor::new(head).chain(rest);
        source.reader = if is_gzip {
            Box::new(MultiGzDecoder::new(whole))
        } else {
            Box::new(whole)
        };
        let head = source.head(512)?;
        if let Some(kind) = kind::of(&head) {
            return Err(source.fault(
                kind.name,
                "text, plain or compressed with gzip",
                kind.change,
            ));
        }
        source.utf16 = Utf16::of_mark(&head);
        let mark = match source.utf16 {
            Some(_) => 2,
            None if head.starts_with(BYTE_ORDER_MARK) => BYTE_ORDER_MARK.len(),
            None => 0,
        };
        source.take_in(&head[mark..])?;
        Ok(source)
    }

    /// What errors call it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The beginning of the text, without taking it: at least 4 KiB where there is so much.
    ///
    /// # Errors
    /// A file that cannot be read, or that is no text.
    pub fn start(&mut self) -> Result<&[u8], InputError> {
        while self.block.len() - self.used < 4096 && self.refill()? {}
        Ok(&self.block[self.used..])
    }

    /// Appends the next line, without its end, and gives its number from 1; `None` at the end.
    ///
    /// # Errors
    /// A file that cannot be read, is no text, or is larger than a limit.
    pub fn next_line(&mut self, line: &mut Vec<u8>) -> Result<Option<u64>, InputError> {
        let before = line.len();
        let mut is_begun = false;
        loop {
            if self.used == self.block.len() && !self.refill()? {
                return Ok(is_begun.then_some(self.line));
            }
            if std::mem::take(&mut self.after_return) && self.block[self.used] == b'\n' {
                self.used += 1;
                continue;
            }
            if !is_begun {
                is_begun = true;
                self.line += 1;
                if self.line > MAX_LINES {
                    let got = format!("more than {MAX_LINES} lines");
                    return Err(self.too_large(None, got, format!("at most {MAX_LINES}")));
                }
            }
            let rest = &self.block[self.used..];
            let end = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
            line.extend_from_slice(&rest[..end.unwrap_or(rest.len())]);
            if line.len() - before > MAX_LINE_BYTES {
                let expected = "at most that, as in text of rows".to_owned();
                let got = "more than 1 MiB in one line".to_owned();
                return Err(self.too_large(Some(self.line), got, expected));
            }
            match end {
                None => self.used = self.block.len(),
                Some(end) => {
                    self.after_return = rest[end] == b'\r';
                    self.used += end + 1;
                    return Ok(Some(self.line));
                }
            }
        }
    }

    /// All the rest as one text with `\n` at the ends of lines; bytes that are not UTF-8 become
    /// U+FFFD.
    ///
    /// # Errors
    /// As [`Source::next_line`].
    pub fn read_lossy(mut self) -> Result<String, InputError> {
        let mut bytes = Vec::new();
        while self.next_line(&mut bytes)?.is_some() {
            bytes.push(b'\n');
        }
        Ok(String::from_utf8(bytes)
            .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned()))
    }

    /// Refuses the file.
    pub fn fault(
        &self,
        got: impl Into<String>,
        expected: impl Into<String>,
        change: impl Into<String>,
    ) -> InputError {
        Content {
            place: self.place(None),
            got: got.into(),
            expected: expected.into(),
            change: change.into(),
        }
        .into()
    }

    /// The file, or one of its lines.
    pub fn place(&self, line: Option<u64>) -> Place {
        Place {
            path: self.path.clone(),
            line,
            column: None,
        }
    }

    fn too_large(&self, line: Option<u64>, got: String, expected: String) -> InputError {
        Content {
            place: self.place(line),
            got,
            expected,
            change: "check that it is the right file, or cut it into parts".to_owned(),
        }
        .into()
    }

    /// The first bytes of the reader, fewer at its end.
    fn head(&mut self, length: usize) -> Result<Vec<u8>, InputError> {
        let mut head = vec![0; length];
        let mut n = 0;
        while n < length {
            match self.read(&mut head[n..])? {
                0 => break,
                more => n += more,
            }
        }
        head.truncate(n);
        Ok(head)
    }

    fn read(&mut self, into: &mut [u8]) -> Result<usize, InputError> {
        loop {
            match self.reader.read(into) {
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Ok(n) => return Ok(n),
                // The system's own errors have a number, those of the unpacker have none.
                Err(source) if source.raw_os_error().is_some() => {
                    return Err(InputError::Read {
                        path: self.path.clone(),
                        source,
                    });
                }
                Err(error) => {
                    let got = format!(
                        "broken gzip ({})",
                        crate::excerpt::message(&error.to_string())
                    );
                    return Err(self.fault(got, "a whole file", "copy or download it again"));
                }
            }
        }
    }

    /// Reads another block after what is left; false at the end.
    fn refill(&mut self) -> Result<bool, InputError> {
        if self.is_at_end {
            return Ok(false);
        }
        let mut raw = vec![0; BLOCK_BYTES];
        let n = self.read(&mut raw)?;
        self.is_at_end = n == 0;
        self.take_in(&raw[..n])?;
        // A block of UTF-16 may hold half a character and no whole one.
        Ok(self.used < self.block.len() || !self.is_at_end && self.refill()?)
    }

    fn take_in(&mut self, raw: &[u8]) -> Result<(), InputError> {
        self.n_bytes += raw.len() as u64;
        if self.n_bytes > MAX_BYTES {
            let mib = MAX_BYTES >> 20;
            let got = format!("more than {mib} MiB (unpacked)");
            return Err(self.too_large(None, got, "at most that".to_owned()));
        }
        self.block.drain(..self.used);
        self.used = 0;
        let from = self.block.len();
        match &mut self.utf16 {
            Some(utf16) => self.block.extend(utf16.decode(raw)),
            None => self.block.extend_from_slice(raw),
        }
        if self.block[from..].contains(&0) {
            let change = "save it as plain text in UTF-8";
            return Err(self.fault("bytes of value 0", "text in UTF-8", change));
        }
        Ok(())
    }
}

/// A reader that tells how much was read.
struct Watched<R, F> {
    reader: R,
    bytes: u64,
    watch: F,
}

impl<R: Read, F: FnMut(u64)> Read for Watched<R, F> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        let n = self.reader.read(into)?;
        self.bytes += n as u64;
        (self.watch)(self.bytes);
        Ok(n)
    }
}
