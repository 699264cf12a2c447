//! `ptm`
fn main() {}
