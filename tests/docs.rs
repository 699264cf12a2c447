//! What the documents say of the program is what the program says of itself.

#[test]
fn the_documented_keys_are_the_keys() {
    let documented = include_str!("../docs/sweep.md");
    let table = topometric::settings::keys_table();
    assert!(
        documented.ends_with(&table),
        "docs/sweep.md ends with an old table: replace it by what `ptm sweep --print-keys` prints"
    );
}
