//! g2o graphs.
#![no_main]

mod shared;

use topometric::import::read_g2o;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    shared::follow(read_g2o(&shared::file("f.g2o", bytes)));
});
