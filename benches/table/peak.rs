//! How many operations on doubles a core does in a second at best: what bounds a kernel that has nothing to wait for.

// `multiversion` checks what the CPU has and then calls the version compiled for it.
#![allow(unsafe_code)]

use std::hint::black_box;
use std::time::Instant;

use multiversion::multiversion;
use multiversion::target::match_target;

const N_ROUNDS: usize = 200_000;

/// ns for one multiplication, of as many as fit into eight registers that do not wait for one another: two for every
/// cycle of four that one of them takes. The best of many, since whatever disturbs it makes it longer.
pub fn operation_ns() -> f64 {
    let times = (0..31).map(|_| {
        let before = Instant::now();
        let n = multiply(black_box(1.0), black_box(0.999_999_999));
        before.elapsed().as_secs_f64() * 1e9 / n as f64
    });
    times.fold(f64::INFINITY, f64::min)
}

#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl", "x86_64+avx2", "aarch64+neon"))]
fn multiply(start: f64, factor: f64) -> usize {
    match_target! {
        "x86_64+avx512f+avx512dq+avx512vl" => in_registers::<64>(start, factor),
        "x86_64+avx2" => in_registers::<32>(start, factor),
        _ => in_registers::<16>(start, factor),
    }
}

#[inline(always)]
fn in_registers<const N: usize>(start: f64, factor: f64) -> usize {
    let mut values = [start; N];
    for _ in 0..N_ROUNDS {
        for value in &mut values {
            *value *= factor;
        }
    }
    black_box(values);
    N * N_ROUNDS
}
