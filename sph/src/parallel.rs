//! Loops over particles on all threads.
//!
//! What is generic here is a loop's result, not its body: the plumbing of threads is compiled once for every type, not for
//! every loop. Each result depends on its own index alone, so that the number of threads has no influence.

use rayon::prelude::*;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// Particles that a thread takes at once, at least: less is not worth handing over.
const SHARE: usize = 64;
/// Particles that are counted together.
const PIECE: usize = 1024;

/// `f(i)` for `i` in `0..n`.
pub fn map<T: Send>(n: usize, f: impl Fn(usize) -> T + Sync) -> Vec<T> {
    erased_map(n, &f)
}

/// `f(i)` for `i` in `0..n`, each long enough for a thread.
pub fn tasks<T: Send>(n: usize, f: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let results: Vec<Mutex<Option<T>>> = (0..n).map(|_| Mutex::new(None)).collect();
    run(n, &|i| put(&results[i], f(i)));
    results.into_iter().map(taken).collect()
}

fn put<T>(result: &Mutex<Option<T>>, value: T) {
    *result.lock().unwrap_or_else(PoisonError::into_inner) = Some(value);
}

fn taken<T>(result: Mutex<Option<T>>) -> T {
    match result.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some(value) => value,
        None => unreachable!("each has run"),
    }
}

/// `f(range)` for `0..n` in pieces of `size`, each long enough for a thread.
pub fn pieces<T: Send>(n: usize, size: usize, f: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
    tasks(n.div_ceil(size), |piece| f(piece * size..((piece + 1) * size).min(n)))
}

fn erased_map<T: Send>(n: usize, f: &(dyn Fn(usize) -> T + Sync)) -> Vec<T> {
    let mut results = Vec::new();
    // `collect` would compile a way for unknown lengths, too.
    (0..n).into_par_iter().with_min_len(SHARE).map(f).collect_into_vec(&mut results);
    results
}

/// Lets `f` see each of `0..n`.
fn run(n: usize, f: &(dyn Fn(usize) + Sync)) {
    (0..n).into_par_iter().for_each(f);
}

/// Lets `f(i, value)` change each of `values`.
pub fn update<T: Send>(values: &mut [T], f: impl Fn(usize, &mut T) + Sync) {
    erased_update(values, SHARE, &|share, values| {
        values.iter_mut().enumerate().for_each(|(i, value)| f(share * SHARE + i, value));
    });
}

/// Lets `f(i, row)` change each row of `width` values; the last may be shorter.
pub fn update_rows<T: Send>(values: &mut [T], width: usize, f: impl Fn(usize, &mut [T]) + Sync) {
    erased_update(values, SHARE * width, &|share, values| {
        values.chunks_mut(width).enumerate().for_each(|(i, row)| f(share * SHARE + i, row));
    });
}

fn erased_update<T: Send>(values: &mut [T], share: usize, f: &(dyn Fn(usize, &mut [T]) + Sync)) {
    // Each is locked once, by the thread that changes it.
    let shares: Vec<Mutex<&mut [T]>> = values.chunks_mut(share).map(Mutex::new).collect();
    run(shares.len(), &|i| f(i, &mut shares[i].lock().unwrap_or_else(PoisonError::into_inner)));
}

/// Values in a new order, which names the old place of each.
pub fn reordered<T: Copy + Send + Sync>(values: &[T], order: &[u32]) -> Vec<T> {
    map(order.len(), |place| values[order[place] as usize])
}

/// How many `i` in `0..n` have `f(i)`.
pub fn count(n: usize, f: impl Fn(usize) -> bool + Sync) -> usize {
    pieces(n, PIECE, |range| range.filter(|&i| f(i)).count()).into_iter().sum()
}

/// Both results, each found on a thread of its own where one is free.
pub fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    let (mut first, mut second) = ((Some(a), None), (Some(b), None));
    erased_join(&mut || first.1 = first.0.take().map(|a| a()), &mut || second.1 = second.0.take().map(|b| b()));
    match (first.1, second.1) {
        (Some(a), Some(b)) => (a, b),
        _ => unreachable!("both have run"),
    }
}

fn erased_join(a: &mut (dyn FnMut() + Send), b: &mut (dyn FnMut() + Send)) {
    rayon::join(a, b);
}
