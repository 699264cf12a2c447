//! What a file is that is not plain text, by the bytes that it begins with.

/// A kind of file, and what to do with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Kind {
    /// Its name, with an article.
    pub name: &'static str,
    /// What the user should do.
    pub change: &'static str,
}

const UNPACK: &str = "unpack it first, or compress the CSV with gzip";
const TABLE: &str =
    "write it as CSV, in Python with pandas: pandas.read_parquet(FILE).to_csv(OUT, index=False)";
const FEATHER: &str =
    "write it as CSV, in Python with pandas: pandas.read_feather(FILE).to_csv(OUT, index=False)";
const ARRAY: &str = "write it as CSV, in Python: numpy.savetxt(OUT, array, delimiter=\",\", \
                     header=\"x,y\", comments=\"\")";
const EXPORT: &str = "export the table as CSV";
const BAG: &str = "export the topic as CSV, for example with rosbags or PlotJuggler";

/// The first bytes, where they stand, and the kind.
const MAGIC: [(usize, &[u8], &str, &str); 24] = [
    (
        0,
        b"PK\x03\x04",
        "a zip archive (zip, xlsx, ods or npz)",
        UNPACK,
    ),
    (0, b"PK\x05\x06", "an empty zip archive", UNPACK),
    (0, b"\xfd7zXZ\0", "a file compressed with xz", UNPACK),
    (
        0,
        b"\x28\xb5\x2f\xfd",
        "a file compressed with zstd",
        UNPACK,
    ),
    (0, b"BZh", "a file compressed with bzip2", UNPACK),
    (0, b"\x04\x22\x4d\x18", "a file compressed with lz4", UNPACK),
    (
        0,
        b"\x1f\x9d",
        "a file compressed with compress (.Z)",
        UNPACK,
    ),
    (0, b"\x1f\x8b", "gzip inside gzip", "unpack it once"),
    (0, b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive", UNPACK),
    (0, b"Rar!\x1a\x07", "a RAR archive", UNPACK),
    (257, b"ustar", "a tar archive", UNPACK),
    (0, b"PAR1", "a Parquet file", TABLE),
    (0, b"ARROW1", "an Arrow (Feather) file", FEATHER),
    (0, b"\x89HDF\r\n", "an HDF5 file", EXPORT),
    (0, b"MATLAB 5.0", "a MATLAB file", EXPORT),
    (0, b"\x93NUMPY", "a NumPy array", ARRAY),
    (0, b"SQLite format 3\0", "an SQLite database", EXPORT),
    (0, b"\xd0\xcf\x11\xe0", "an old Excel workbook", EXPORT),
    (0, b"#ROSBAG V", "a ROS bag", BAG),
    (0, b"\x89MCAP", "an MCAP recording", BAG),
    (0, b"%PDF-", "a PDF", "give the table itself"),
    (0, b"\x89PNG", "a picture", "give the table itself"),
    (
        0,
        b"version https://git-lfs",
        "a pointer of Git LFS",
        "fetch the file itself with git lfs pull",
    ),
    (0, b"\x7fELF", "a program", "give the table itself"),
];

/// The kind of a file that begins so; `None` if that may be text.
pub(super) fn of(start: &[u8]) -> Option<Kind> {
    let found = MAGIC.iter().find(|(place, magic, ..)| {
        start
            .get(*place..)
            .is_some_and(|rest| rest.starts_with(magic))
    });
    if let Some((_, _, name, change)) = found {
        return Some(Kind { name, change });
    }
    let text = start.trim_ascii_start();
    let is_page = [&b"<!doctype html"[..], b"<html"]
        .iter()
        .any(|tag| text.len() >= tag.len() && text[..tag.len()].eq_ignore_ascii_case(tag));
    is_page.then_some(Kind {
        name: "a page of HTML",
        change: "download the file itself, not the page that shows it",
    })
}
