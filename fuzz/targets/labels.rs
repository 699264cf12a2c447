//! Chains of label vectors: read and judged, or refused in one line.
#![no_main]

use std::path::Path;

use topometric::input::Source;
use topometric::labels::{Collector, read};
use topometric::results::labels::diagnose_labels;
use topometric::settings::BurnInRule;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let mut collector = Collector::new(50);
    let source = Source::from_reader(bytes, Path::new("f.csv"));
    match source.and_then(|source| read(source, &mut collector)) {
        Ok(()) => {
            let Ok(found) = collector.finish() else {
                return;
            };
            if !found.chains.is_empty() {
                diagnose_labels(found.chains, BurnInRule::Auto, &|_| ());
            }
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
