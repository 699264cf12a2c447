//! Sweep files: checked and expanded, or refused in one line.
#![no_main]

use topometric::sweep::Sweep;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes);
    match Sweep::parse(&text, "f.toml", "f", None) {
        Ok(sweep) => {
            assert!(!sweep.cells.is_empty());
            let again = Sweep::parse(&text, "f.toml", "f", None).expect("it was read before");
            assert_eq!(sweep.key(), again.key());
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
