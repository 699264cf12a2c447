//! Detections: written and read back they are the same, or refused in one line.
#![no_main]

use topometric::detections::Detections;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    match Detections::from_csv_reader(bytes, "f.csv") {
        Ok(detections) => {
            let text = detections.to_csv_string();
            let back = Detections::from_csv_reader(text.as_bytes(), "g.csv").expect("our own file");
            assert_eq!(back, detections);
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
