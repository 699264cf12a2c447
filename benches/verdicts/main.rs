//! How often a verdict on convergence is wrong: `docs/verdicts.md` and its picture.
//!
//! `cargo bench --bench verdicts -- FOLDER [TARGETS [LONGEST]]` writes `verdicts.md`, `verdicts.png`
//! and `verdicts-mapped.png` into a folder; 1,000 targets and chains of up to 10,000 proposals unless
//! said otherwise.
#![allow(
    missing_docs,
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a program of its own"
)]

mod mapped;
mod page;
mod proximity;
mod rates;
mod study;
mod target;
mod truth;

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use study::{LENGTHS, Row, SAMPLERS, study};
use target::Target;

fn main() {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with("--"))
        .collect();
    let n: u64 = arguments
        .get(1)
        .map_or(1000, |n| n.parse().expect("a number of targets"));
    let longest: u64 = arguments
        .get(2)
        .map_or(LENGTHS[3], |n| n.parse().expect("proposals"));
    let lengths: Vec<u64> = LENGTHS
        .into_iter()
        .filter(|length| *length <= longest)
        .collect();
    let n_done = AtomicUsize::new(0);
    // Targets whose posterior cannot be known are replaced by later ones.
    let of_target = |number: u64| -> Option<(Vec<Row>, target::Kind, bool)> {
        let target = Target::new(number)?;
        let rows = (0..SAMPLERS.len()).flat_map(|sampler| study(&target, sampler, &lengths));
        let rows: Vec<Row> = rows.collect();
        let n_done = 1 + n_done.fetch_add(1, Ordering::Relaxed);
        if n_done.is_multiple_of(50) {
            eprintln!("{n_done} of {n} targets");
        }
        Some((rows, target.kind, target.is_covariance()))
    };
    let (mut found, mut next) = (Vec::new(), 0);
    while (found.len() as u64) < n {
        let end = next + n - found.len() as u64;
        found.extend(
            (next..end)
                .into_par_iter()
                .filter_map(of_target)
                .collect::<Vec<_>>(),
        );
        next = end;
    }
    let kinds: Vec<(target::Kind, bool)> = found.iter().map(|own| (own.1, own.2)).collect();
    let rows: Vec<Row> = found.into_iter().flat_map(|own| own.0).collect();
    let text = page::page(&rows, &kinds, &lengths);
    match arguments.first() {
        None => println!("{text}"),
        Some(folder) => {
            let folder = Path::new(folder);
            std::fs::write(folder.join("verdicts.md"), text).expect("a folder to write to");
            for (name, rules) in [
                ("verdicts", &page::RULES_OF_FIGURE[..]),
                ("verdicts-mapped", &mapped::RULES_OF_FIGURE),
            ] {
                let png = page::figure(&rows, &lengths, rules);
                std::fs::write(folder.join(format!("{name}.png")), png).expect("the same");
            }
        }
    }
}
