//! Loops over particles on all threads.
//!
//! What is generic here is a loop's result, not its body: the plumbing of threads is compiled once for every type, not for
//! every loop. Each result depends on its own index alone, so that the number of threads has no influence.

use rayon::prelude::*;
use std::ops::Range;

/// Particles that a thread takes at once, at least: less is not worth handing over.
const SHARE: usize = 64;
/// Particles that are counted together.
const PIECE: usize = 1024;

/// `f(i)` for `i` in `0..n`.
pub fn map<T: Send>(n: usize, f: impl Fn(usize) -> T + Sync) -> Vec<T> {
    erased_map(n, SHARE, &f)
}

/// `f(range)` for `0..n` in pieces of `size`, each long enough for a thread.
pub fn pieces<T: Send>(n: usize, size: usize, f: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
    erased_map(n.div_ceil(size), 1, &|piece| f(piece * size..((piece + 1) * size).min(n)))
}

fn erased_map<T: Send>(n: usize, share: usize, f: &(dyn Fn(usize) -> T + Sync)) -> Vec<T> {
    (0..n).into_par_iter().with_min_len(share).map(f).collect()
}

/// Lets `f(i, value)` change each of `values`.
pub fn update<T: Send>(values: &mut [T], f: impl Fn(usize, &mut T) + Sync) {
    erased_update(values, &|first, share| share.iter_mut().enumerate().for_each(|(i, value)| f(first + i, value)));
}

fn erased_update<T: Send>(values: &mut [T], f: &(dyn Fn(usize, &mut [T]) + Sync)) {
    values.par_chunks_mut(SHARE).enumerate().for_each(|(share, values)| f(share * SHARE, values));
}

/// Values in a new order, which names the old place of each.
pub fn reordered<T: Copy + Send + Sync>(values: &[T], order: &[u32]) -> Vec<T> {
    order.par_iter().with_min_len(SHARE).map(|&i| values[i as usize]).collect()
}

/// How many `i` in `0..n` have `f(i)`.
pub fn count(n: usize, f: impl Fn(usize) -> bool + Sync) -> usize {
    pieces(n, PIECE, |range| range.filter(|&i| f(i)).count()).into_iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_index_is_visited_once_and_in_its_place() {
        for n in [0, 1, SHARE - 1, SHARE, SHARE + 1, 10_000] {
            let squares = map(n, |i| i * i);
            assert!(squares.len() == n && squares.iter().enumerate().all(|(i, s)| *s == i * i), "{n}");
            let mut values = vec![1; n];
            update(&mut values, |i, v| *v += i);
            assert!(values.iter().enumerate().all(|(i, v)| *v == i + 1), "{n}");
            let backward: Vec<u32> = (0..n as u32).rev().collect();
            assert!(reordered(&values, &backward).iter().rev().eq(&values), "{n}");
            assert_eq!(count(n, |i| i % 3 == 0), n.div_ceil(3), "{n}");
        }
    }
}
