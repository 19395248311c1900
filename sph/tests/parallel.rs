//! Parallel loops give what plain ones do.

use sph_core::parallel::{count, join, map, reordered, tasks, update, update_rows};

/// Around the lengths that are no, one and two shares of a thread, and many.
const LENGTHS: [usize; 9] = [0, 1, 63, 64, 65, 127, 128, 129, 10_000];

#[test]
fn both_sides_of_a_join_are_returned() {
    fn size(n: u64) -> u64 {
        if n < 2 {
            return n;
        }
        let (a, b) = join(|| size(n / 2), || size(n - n / 2));
        a + b
    }
    assert_eq!(size(1000), 1000);
    assert_eq!(join(|| "left", || 2), ("left", 2));
}

#[test]
fn every_index_is_visited_once_and_in_its_place() {
    for n in LENGTHS {
        let squares = map(n, |i| i * i);
        assert!(squares.len() == n && squares.iter().enumerate().all(|(i, s)| *s == i * i), "{n}");
        let mut values = vec![1; n];
        update(&mut values, |i, v| *v += i);
        assert!(values.iter().enumerate().all(|(i, v)| *v == i + 1), "{n}");
        let backward: Vec<u32> = (0..n as u32).rev().collect();
        assert!(reordered(&values, &backward).iter().rev().eq(&values), "{n}");
        assert_eq!(count(n, |i| i % 3 == 0), n.div_ceil(3), "{n}");
        assert_eq!(tasks(n, |i| i * i), squares, "{n}");
        let mut rows = vec![0; 3 * n];
        update_rows(&mut rows, 3, |i, row| row.iter_mut().enumerate().for_each(|(k, v)| *v = 3 * i + k));
        assert!(rows.iter().enumerate().all(|(i, v)| *v == i), "{n}");
    }
}
