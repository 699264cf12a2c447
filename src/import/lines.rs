//! Text files as lines of numbers, and the one way in which they are refused.

use std::io::Read;
use std::path::Path;

use super::error::ImportError;

/// The first two bytes of a gzip file (RFC 1952).
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];
/// What a UTF-8 file may start with and mean nothing by.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
/// No recording of landmarks is larger; what unpacks to more is a slip or a trap.
const MAX_BYTES: u64 = 1 << 30;

/// The bytes of a file, unpacked if it is gzip, without a byte order mark.
pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>, ImportError> {
    let shown = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|source| ImportError::Read {
        path: shown.clone(),
        source,
    })?;
    unpacked(bytes, &shown)
}

fn unpacked(bytes: Vec<u8>, path: &str) -> Result<Vec<u8>, ImportError> {
    let malformed = |what: String| ImportError::Malformed {
        path: path.to_owned(),
        what,
    };
    let bytes = if bytes.starts_with(&GZIP_MAGIC) {
        let mut plain = Vec::new();
        flate2::read::MultiGzDecoder::new(bytes.as_slice())
            .take(MAX_BYTES + 1)
            .read_to_end(&mut plain)
            .map_err(|error| malformed(format!("got broken gzip ({error})")))?;
        if plain.len() as u64 > MAX_BYTES {
            return Err(malformed("got more than 1 GiB when unpacked".to_owned()));
        }
        plain
    } else {
        bytes
    };
    Ok(match bytes.strip_prefix(BYTE_ORDER_MARK) {
        Some(rest) => rest.to_vec(),
        None => bytes,
    })
}

/// A whole number; some programs write it as 14.000.
pub(super) fn whole(text: &str) -> Option<i64> {
    if let Ok(value) = text.parse::<i64>() {
        return Some(value);
    }
    let value = text.parse::<f64>().ok()?;
    // Above 2⁵³ a float no longer says which whole number is meant.
    (value.fract() == 0.0 && value.abs() < 9e15).then_some(value as i64)
}

/// One line of fields between white space.
#[derive(Clone, Debug)]
pub(super) struct Line<'a> {
    path: &'a str,
    /// From 1.
    pub number: u64,
    pub fields: Vec<&'a str>,
}

/// The lines that hold something, comments (`#` or `%` to the end of the line) taken off.
pub(super) fn lines<'a>(text: &'a str, path: &'a str) -> impl Iterator<Item = Line<'a>> {
    text.lines().enumerate().filter_map(move |(ix, line)| {
        let line = line.split(['#', '%']).next().unwrap_or_default();
        let fields: Vec<&str> = line.split_whitespace().collect();
        (!fields.is_empty()).then_some(Line {
            path,
            number: ix as u64 + 1,
            fields,
        })
    })
}

impl Line<'_> {
    /// Refuses a line of another number of fields.
    pub fn expect_fields(&self, counts: &[usize], names: &'static str) -> Result<(), ImportError> {
        if counts.contains(&self.fields.len()) {
            return Ok(());
        }
        Err(ImportError::Fields {
            path: self.path.to_owned(),
            line: self.number,
            got: self.fields.len(),
            expected: names,
        })
    }

    /// Refuses the field of this place.
    pub fn bad(&self, place: usize, column: &'static str, expected: &'static str) -> ImportError {
        let got = self.fields.get(place).copied().unwrap_or_default();
        ImportError::Value {
            path: self.path.to_owned(),
            line: self.number,
            column,
            got: got.chars().take(40).collect(),
            expected,
        }
    }

    /// A finite number.
    pub fn number(&self, place: usize, column: &'static str) -> Result<f64, ImportError> {
        let field = self.fields.get(place).copied().unwrap_or_default();
        match field.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(self.bad(place, column, "a finite number")),
        }
    }

    /// A whole number.
    pub fn whole(&self, place: usize, column: &'static str) -> Result<i64, ImportError> {
        let field = self.fields.get(place).copied().unwrap_or_default();
        whole(field).ok_or_else(|| self.bad(place, column, "a whole number"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn comments_tabs_and_blank_lines_are_no_fields() {
        let text = "# a\r\n 1 \t 2.50 \r\n\r\n% b\n3\t4 # five\n";
        let found: Vec<_> = lines(text, "a.dat").map(|l| (l.number, l.fields)).collect();
        assert_eq!(found, [(2, vec!["1", "2.50"]), (5, vec!["3", "4"])]);
    }

    #[test]
    fn whole_numbers_may_wear_a_fraction_of_nothing() {
        let whole = |text: &'static str| {
            let line = lines(text, "a").next().expect("a line");
            line.whole(0, "id").map_err(|error| error.to_string())
        };
        assert_eq!(whole("14"), Ok(14));
        assert_eq!(whole("14.000"), Ok(14));
        assert_eq!(whole("-9223372036854775808"), Ok(i64::MIN));
        for bad in ["14.5", "1e300", "nan", "inf", "x"] {
            let expected = format!(
                "a, line 1, column id: got {bad:?}, expected a whole number; correct the row"
            );
            assert_eq!(whole(bad), Err(expected));
        }
    }

    #[test]
    fn gzip_and_byte_order_marks_come_off_and_broken_gzip_is_refused() {
        let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        encoder.write_all(b"\xef\xbb\xbfabc").expect("compressed");
        let packed = encoder.finish().expect("compressed");
        assert_eq!(unpacked(packed.clone(), "a").expect("good"), b"abc");
        assert_eq!(unpacked(b"abc".to_vec(), "a").expect("good"), b"abc");
        let error = unpacked(packed[..packed.len() - 4].to_vec(), "a").expect_err("cut short");
        assert!(
            error.to_string().starts_with("a: got broken gzip ("),
            "{error}"
        );
    }
}
