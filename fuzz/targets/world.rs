//! World files: a world whose text reads back, or refused in one line.
#![no_main]

use topometric::world::World;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes);
    match World::from_toml(&text, "f.toml") {
        Ok(world) => {
            for corner in world.waypoints() {
                let _ = world.is_free(*corner);
            }
            assert!(!world.canonical_text().is_empty());
        }
        Err(error) => assert!(!error.to_string().contains('\n'), "{error}"),
    }
});
