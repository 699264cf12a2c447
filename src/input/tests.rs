//! Files as users have them: packed, encoded, separated and named in many ways, and too large.

use std::io::{Read, Write};
use std::path::Path;

use super::*;

const LAYOUT: Layout = Layout {
    rows: "points",
    columns: &[
        Column::required("x", "m"),
        Column::required("y", "m"),
        Column::optional("cov_xx"),
        Column::optional("last_seen"),
        Column::optional("landmark"),
    ],
    max_rows: 100_000,
};

fn source<'a>(reader: impl Read + 'a) -> Result<Source<'a>, InputError> {
    Source::from_reader(reader, Path::new("a.csv"))
}

/// The first two columns and the notes, or the refusal.
fn read(bytes: &[u8]) -> Result<(Vec<[f64; 2]>, Vec<String>), String> {
    let inner = || -> Result<_, InputError> {
        let mut table = Table::new(source(bytes)?, LAYOUT)?;
        let mut rows = Vec::new();
        while let Some(mut row) = table.next_row()? {
            rows.push([row.number(0)?, row.number(1)?]);
        }
        let notes = table.notes().iter().map(ToString::to_string).collect();
        Ok((rows, notes))
    };
    inner().map_err(|error| error.to_string())
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).expect("compressed");
    encoder.finish().expect("compressed")
}

fn utf16(text: &str, is_big_endian: bool) -> Vec<u8> {
    let units = std::iter::once('\u{feff}').chain(text.chars());
    let mut buffer = [0; 2];
    let mut bytes = Vec::new();
    for c in units {
        for unit in c.encode_utf16(&mut buffer) {
            bytes.extend(if is_big_endian {
                unit.to_be_bytes()
            } else {
                unit.to_le_bytes()
            });
        }
    }
    bytes
}

#[test]
fn one_table_in_many_guises() {
    let plain = "x,y\n1.5,-2\n3,4\n";
    let with_mark = format!("\u{feff}{plain}");
    let packed_twice = [gzip(b"x,y\n1.5,-2\n"), gzip(b"3,4\n")].concat();
    let guises: [(&str, Vec<u8>); 13] = [
        ("plain", plain.into()),
        ("byte order mark", with_mark.clone().into()),
        ("gzip", gzip(plain.as_bytes())),
        ("gzip with mark", gzip(with_mark.as_bytes())),
        ("gzip of two members", packed_twice),
        ("UTF-16, little end first", utf16(plain, false)),
        ("UTF-16, big end first", utf16(plain, true)),
        ("UTF-16 in gzip", gzip(&utf16(plain, false))),
        (
            "ends of lines of Windows",
            plain.replace('\n', "\r\n").into(),
        ),
        (
            "ends of lines of old Macs",
            plain.replace('\n', "\r").into(),
        ),
        (
            "no last end, blank lines",
            b"\n\nx,y\n\n1.5,-2\n \n3,4".to_vec(),
        ),
        (
            "quotes and spaces",
            b"\"X\" , Y\n \"1.5\",\"-2\"\n3, 4 \n".to_vec(),
        ),
        ("numpy", b"# x,y\n1.5,-2\n3,4\n".to_vec()),
    ];
    for (name, bytes) in guises {
        let expected = (vec![[1.5, -2.0], [3.0, 4.0]], vec![]);
        assert_eq!(read(&bytes), Ok(expected), "{name}");
    }
}

#[test]
fn other_separators_are_read_and_named_once() {
    for (separator, name) in [(';', "semicolons"), ('\t', "tabs"), ('|', "\"|\"")] {
        let text = "x,y,note\n1.5,-2,\"a;b\tc|d\"\n3,4,\n".replace(',', &separator.to_string());
        let (rows, notes) = read(text.as_bytes()).expect("good");
        assert_eq!(rows, [[1.5, -2.0], [3.0, 4.0]]);
        assert_eq!(
            notes,
            [
                "1 column left out: note".to_owned(),
                format!("fields separated by {name}")
            ]
        );
        let text = "x;y\n1,5;-2\n3;4,0e1\n".replace(';', &separator.to_string());
        let (rows, notes) = read(text.as_bytes()).expect("good");
        assert_eq!(rows, [[1.5, -2.0], [3.0, 40.0]]);
        assert_eq!(
            notes,
            [format!("fields separated by {name}, decimals with commas")]
        );
    }
    assert_eq!(read(b"sep=;\nx;y\n1;2\n").expect("good").0, [[1.0, 2.0]]);
    assert_eq!(
        read(b"x;y\n1,234;2\n1.5;2\n"),
        Err("a.csv, line 3, column x: got \"1.5\", expected a decimal comma as on line 2; write all \
             numbers with a decimal point and without separators of thousands"
            .to_owned())
    );
    for bad in ["x;y\n1.234,5;2\n", "x;y\n1,234,567;2\n", "x,y\n\"1,5\",2\n"] {
        let refused = read(bad.as_bytes()).expect_err("two readings");
        assert!(
            refused.contains("a number without separators of thousands"),
            "{refused}"
        );
    }
    assert_eq!(
        read(b"x y\n1 2\n"),
        Err(
            "a.csv, line 1: got x y in the header, separated by spaces, expected the columns x,y; \
             separate the fields by commas"
                .to_owned()
        )
    );
}

#[test]
fn columns_are_left_out_with_hints_only_where_one_is_near() {
    let notes = |header: &str| {
        let row = vec!["1"; header.split(',').count()].join(",");
        read(format!("{header}\n{row}\n").as_bytes())
            .expect("good")
            .1
            .join("; ")
    };
    assert_eq!(notes("x,y"), "");
    assert_eq!(notes(",x,y"), "1 column left out: one without a name");
    assert_eq!(
        notes("X,Y,score,notes,score"),
        "3 columns left out: score, notes, score"
    );
    assert_eq!(
        notes("x,y,landmrak,Lastseen"),
        "2 columns left out: landmrak (rename it to landmark if that is meant), Lastseen (rename it \
         to last_seen if that is meant)"
    );
    assert_eq!(
        notes("X,Y,Landmark_ID"),
        "1 column left out: Landmark_ID (rename it to landmark if that is meant)"
    );
    let broken = read(b"x,y,\"a\nb\"\n1,2,3\n").expect("good").1;
    assert_eq!(broken, ["1 column left out: a b"]);
    let broken = read(b"\"x\n(m)\",y\n").expect_err("no x");
    assert!(broken.ends_with("rename x (m) to x"), "{broken:?}");
    // Far names, and near ones of columns that are there.
    assert_eq!(notes("x,y,lat,id"), "2 columns left out: lat, id");
    assert_eq!(notes("x,y,cov_xx,cov_yx"), "1 column left out: cov_yx");
    let many = format!("x,y,{}", vec!["z"; 30].join(","));
    assert!(
        notes(&many).ends_with("z, z and 20 more"),
        "{}",
        notes(&many)
    );
}

#[test]
fn headers_that_will_not_do_say_what_to_change() {
    for (text, expected) in [
        (
            "",
            "a blank file, expected a header with the columns x,y; add one",
        ),
        (
            "lat,lon\n48.1,11.5\n",
            "lat,lon in the header, which are degrees of latitude and longitude, expected the \
             columns x,y in metres; project the positions to metres first, for example to UTM",
        ),
        (
            "GPS_Latitude;GPS_Longitude\n48.1;11.5\n",
            "GPS_Latitude,GPS_Longitude in the header, which are degrees of latitude and longitude, \
             expected the columns x,y in metres; project the positions to metres first, for example \
             to UTM",
        ),
        (
            "x,X,y\n",
            "x twice in the header, expected each column once; keep one column x",
        ),
        (
            "pos_x,pos_y\n",
            "pos_x,pos_y in the header, expected the columns x,y; rename pos_x to x",
        ),
        (
            "x [m],y\n",
            "x [m],y in the header, expected the columns x,y; rename x [m] to x",
        ),
        (
            "easting,northing\n",
            "easting,northing in the header, expected the columns x,y; add the \
          column x (m)",
        ),
        (
            "1,2\n",
            "the number 1 in the header, expected names of columns; put the header x,y above the \
             first row",
        ),
    ] {
        assert_eq!(
            read(text.as_bytes()),
            Err(format!("a.csv, line 1: got {expected}")),
            "{text}"
        );
    }
}

#[test]
fn rows_may_span_lines_and_quotes_must_close() {
    let (rows, _) = read(b"x,y,note\n1,2,\"a\nb \"\"c\"\"\"\n3,4,5\" pipe\n").expect("good");
    assert_eq!(rows, [[1.0, 2.0], [3.0, 4.0]]);
    let quote =
        "got a quote that is not closed, expected both quotes of a field; close it or remove it";
    assert_eq!(
        read(b"x,y\n1,2\n\"3,4\n5,6\n"),
        Err(format!("a.csv, line 3: {quote}"))
    );
    let mut endless = b"x,y\n\"1,2\n".to_vec();
    endless.extend(b"1,2,3,4,5,6,7,8\n".repeat(100_000));
    assert_eq!(read(&endless), Err(format!("a.csv, line 2: {quote}")));
    let fields = "got 3 fields, expected 2 as in the header; write one field per column, each \
                  followed by the separator of the header";
    assert_eq!(
        read(b"x;y\n1;2;3\n"),
        Err(format!("a.csv, line 2: {fields}"))
    );
}

#[test]
fn files_that_are_no_text_are_called_what_they_are() {
    for (bytes, name) in [
        (&b"PK\x03\x04\x14\0"[..], "a zip archive"),
        (b"\xfd7zXZ\0\0", "xz"),
        (b"\x28\xb5\x2f\xfd\x04", "zstd"),
        (b"BZh91AY", "bzip2"),
        (b"PAR1\x15\x04", "a Parquet file"),
        (b"\x93NUMPY\x01\0", "a NumPy array"),
        (b"<!DOCTYPE html>\n<html>", "a page of HTML"),
        (b"version https://git-lfs.github.com/spec/v1\n", "Git LFS"),
    ] {
        for bytes in [bytes.to_vec(), gzip(bytes)] {
            let refused = read(&bytes).expect_err(name);
            assert!(refused.starts_with("a.csv: got a"), "{refused}");
            assert!(
                refused.contains(name) && !refused.contains('\n'),
                "{refused}"
            );
        }
    }
    assert!(
        read(&gzip(&gzip(b"x,y\n")))
            .expect_err("twice")
            .contains("gzip inside gzip")
    );
    let cut = gzip(b"x,y\n1,2\n");
    assert!(
        read(&cut[..cut.len() - 6])
            .expect_err("cut")
            .starts_with("a.csv: got broken gzip (")
    );
    assert!(
        read(b"x,y\n1,\xff\n")
            .expect_err("latin")
            .contains("line 2: got bytes that are not UTF-8")
    );
    assert!(
        read(b"x\0,\0y\0")
            .expect_err("no mark")
            .contains("bytes of value 0")
    );
}

/// Hands out the same bytes for ever, and counts them.
struct Endless<'a> {
    bytes: &'a [u8],
    n_read: &'a std::cell::Cell<u64>,
}

impl Read for Endless<'_> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        let n = self.bytes.len().min(into.len());
        into[..n].copy_from_slice(&self.bytes[..n]);
        self.n_read.set(self.n_read.get() + n as u64);
        Ok(n)
    }
}

#[test]
fn endless_files_are_refused_early() {
    let read_endless = |bytes: &[u8]| {
        let n_read = std::cell::Cell::new(0);
        let endless = Endless {
            bytes,
            n_read: &n_read,
        };
        let head = std::io::Cursor::new(b"x,y\n");
        let lines = source(head.chain(endless)).and_then(|mut source| {
            let mut line = Vec::new();
            while source.next_line(&mut line)?.is_some() {
                line.clear();
            }
            Ok(())
        });
        (lines.expect_err("endless").to_string(), n_read.get())
    };
    let (zeros, n_read) = read_endless(&[0; 100]);
    assert!(
        zeros.contains("bytes of value 0") && n_read < 1 << 20,
        "{zeros}"
    );
    let (one_line, n_read) = read_endless(b"1,2,3,4,");
    assert!(
        one_line.contains("line 2: got more than 1 MiB in one line"),
        "{one_line}"
    );
    assert!(n_read < 2 << 20);
    let rows = b"1.5,2.5\n".repeat(1000);
    let (many, n_read) = read_endless(&rows);
    assert!(
        many.contains("got more than 2000000 lines, expected at most 2000000"),
        "{many}"
    );
    assert!(n_read < 8 * 2_100_000);
    let table = read(&[b"x,y\n".to_vec(), rows.repeat(200)].concat());
    assert!(
        table
            .expect_err("long")
            .contains("a.csv: got more than 100000 points, expected")
    );
    let wide = format!("{}\n", "1.5,".repeat(10_000)).into_bytes();
    let (large, n_read) = read_endless(&wide);
    assert!(
        large.contains("got more than 256 MiB (unpacked)"),
        "{large}"
    );
    assert!(n_read < MAX_BYTES + (2 << 20));
}

#[test]
fn reading_is_watched_and_goes_once_over_the_file() {
    let file = tempfile::NamedTempFile::new().expect("a file");
    let text = format!("x,y\n{}", "1.5,2.5\n".repeat(50_000));
    std::fs::write(file.path(), &text).expect("written");
    let heard = std::cell::RefCell::new(Vec::new());
    let watch = |so_far: ReadSoFar| heard.borrow_mut().push(so_far.bytes);
    let source = Source::open_watched(file.path(), watch).expect("a file");
    let mut table = Table::new(source, LAYOUT).expect("a header");
    let mut n_rows = 0;
    while table.next_row().expect("good rows").is_some() {
        n_rows += 1;
    }
    assert_eq!(n_rows, 50_000);
    let heard = heard.borrow();
    assert!(heard.len() > 5 && heard.is_sorted());
    assert_eq!(heard.last(), Some(&(text.len() as u64)));
}

#[test]
fn identities_are_numbers_unless_one_is_a_name() {
    let finish = |cells: &[&str]| {
        let mut identities = Identities::default();
        let keys: Vec<_> = cells.iter().map(|cell| identities.key(cell)).collect();
        (keys, identities.finish())
    };
    let (keys, numbered) = finish(&["7", "-1", "7.0", "", "3", "NaN"]);
    assert_eq!(
        keys,
        [
            Ok(Some(0)),
            Ok(None),
            Ok(Some(0)),
            Ok(None),
            Ok(Some(1)),
            Ok(None)
        ]
    );
    assert_eq!((numbered.numbers, numbered.names), (vec![7, 3], vec![]));
    let (_, numbered) = finish(&["7", "oak", "7.0"]);
    assert_eq!(numbered.names, ["7", "oak"]);
    assert_eq!(numbered.numbers, [0, 1]);
    assert_eq!(finish(&["1.5"]).0, [Err(())]);
}
