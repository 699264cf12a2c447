//! Journals: what is read is what its lines say, and what follows the last whole line is no more than one line.
//!
//! Checksums keep random bytes out, so an input whose first byte is odd has them put in.
#![no_main]

use topometric::run::Contents;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some((first, rest)) = bytes.split_first() else {
        return;
    };
    let mut journal = Vec::new();
    for line in rest.split_inclusive(|&byte| byte == b'\n') {
        if first % 2 == 1 {
            let json = line.strip_suffix(b"\n").unwrap_or(line);
            journal.extend(format!("{:08x} ", crc32(json)).into_bytes());
        }
        journal.extend(line);
    }
    match Contents::parse(&journal, "f") {
        Ok(contents) => {
            assert!(contents.good_length <= journal.len());
            assert!(!journal[contents.good_length..].contains(&b'\n'));
            let whole = &journal[..contents.good_length];
            let n_lines = whole.iter().filter(|byte| **byte == b'\n').count();
            assert_eq!(contents.records.len(), n_lines);
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});

/// CRC-32 of IEEE 802.3, bit by bit: another one than the program's.
fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = !0_u32;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xEDB8_8320 & (crc & 1).wrapping_neg());
        }
    }
    !crc
}
