//! Counts the bytes that each thread holds, so that a chain that takes too much can be ended alone.
//!
//! A chain stays on one thread from its start to its record, so what that thread holds beyond what it
//! held before is the chain's. What is freed on another thread than the one that asked for it counts
//! on the wrong side; chains do not do that.

// An allocator cannot be written without it. This one calls the system's and counts.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    // Neither lazily made nor dropped, so that counting allocates nothing itself.
    static HELD: Cell<i64> = const { Cell::new(0) };
}

/// Bytes that this thread holds.
pub fn bytes_held() -> u64 {
    HELD.with(|held| held.get().max(0) as u64)
}

fn count(change: i64) {
    // A thread that ends has no counter any more, and no chain.
    let _ = HELD.try_with(|held| held.set(held.get().wrapping_add(change)));
}

/// The system's allocator, with a count.
pub struct Counting;

// SAFETY: every call is passed on to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as i64);
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size() as i64);
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(-(layout.size() as i64));
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        count(new_size as i64 - layout.size() as i64);
        unsafe { System.realloc(pointer, layout, new_size) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[global_allocator]
    static ALLOCATOR: Counting = Counting;

    #[test]
    fn a_thread_counts_what_it_holds_and_no_other() {
        // The first thread that is started leaves something behind here.
        std::thread::spawn(|| ()).join().expect("it ends");
        let before = bytes_held();
        let mut values = vec![0_u8; 1 << 20];
        assert_eq!(bytes_held() - before, 1 << 20);
        values.truncate(10);
        values.shrink_to_fit();
        assert_eq!(bytes_held() - before, 10);
        drop(values);
        assert_eq!(bytes_held(), before);
        // What another thread holds is not ours, but for the little that a thread itself needs.
        let other = std::thread::spawn(|| {
            let values = std::hint::black_box(vec![0_u8; 1 << 20]);
            (bytes_held(), values.len())
        });
        let (held, _) = other.join().expect("it ends");
        assert!(held > (1 << 20) - 4096);
        assert!(bytes_held().abs_diff(before) < 4096);
    }
}
