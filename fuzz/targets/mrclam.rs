//! Folders of UTIAS MRCLAM: the input is its five files, one after another, with a zero byte between.
#![no_main]

mod shared;

use topometric::import::read_mrclam;

const FILES: [&str; 5] = [
    "Robot1_Odometry.dat",
    "Robot1_Measurement.dat",
    "Barcodes.dat",
    "Landmark_Groundtruth.dat",
    "Robot1_Groundtruth.dat",
];

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let mut parts = bytes.split(|&byte| byte == 0);
    let mut folder = None;
    for name in FILES {
        let path = shared::file(name, parts.next().unwrap_or_default());
        folder = path.parent().map(std::path::Path::to_owned);
    }
    shared::follow(read_mrclam(&folder.expect("a file lies in a folder"), Some(1)));
});
