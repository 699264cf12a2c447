//! Graphs without an ending that tells their format: iSAM, TORO, g2o's tutorial.
#![no_main]

mod shared;

use topometric::import::{Choices, Format, Opened};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let path = shared::file("f.txt", bytes);
    let opened = Opened::new(&path, None, |_| ());
    let is_graph = opened.as_ref().is_ok_and(|opened| opened.format() == Format::G2o);
    let opened = if is_graph { opened } else { Opened::new(&path, Some(Format::G2o), |_| ()) };
    shared::follow(opened.and_then(|opened| opened.read(Choices::default())));
});
