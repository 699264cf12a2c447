//! Range-bearing CSVs, plain and packed, and their truth.
#![no_main]

mod shared;

use topometric::import::{Format, read_range_bearing, read_truth};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let path = shared::file("f.csv", bytes);
    let _ = Format::of(&path);
    shared::follow(read_range_bearing(&path).map(|(recording, _)| recording));
    if let Err(error) = read_truth(&path, &[(0.0, Some(1)), (1.0, None)]) {
        assert!(!error.to_string().contains('\n'), "{error}");
    }
});
