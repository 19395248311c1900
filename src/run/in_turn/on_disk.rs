//! Generates rows of the output file from blocks on disk.

use super::kept::Kept;
use crate::error::Result;
use crate::run::streamed::Places;
use crate::target::Positions;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

/// Particles by their numbers, as they are on disk.
pub(super) struct OnDisk<'a, const D: usize> {
    kept: &'a Kept,
    places: Recent<Positions<D>>,
    /// Support radii and densities.
    sums: Recent<[Vec<f64>; 2]>,
}

impl<'a, const D: usize> OnDisk<'a, D> {
    pub fn new(kept: &'a Kept) -> Self {
        Self { kept, places: Recent::new(), sums: Recent::new() }
    }

    /// Calls `with` for each block that has some of the particles, and their rows in it.
    fn each(&self, numbers: Range<usize>, mut with: impl FnMut(usize, Range<usize>) -> Result<()>) -> Result<()> {
        if numbers.is_empty() {
            return Ok(());
        }
        (self.kept.block_of(numbers.start)..=self.kept.block_of(numbers.end - 1)).try_for_each(|block| {
            let own = self.kept.own(block);
            let clamp = |i: usize| i.clamp(own.start, own.end) - own.start;
            with(block, clamp(numbers.start)..clamp(numbers.end))
        })
    }
}

impl<const D: usize> Places<D> for OnDisk<'_, D> {
    fn positions(&self, numbers: Range<usize>) -> Result<Positions<D>> {
        let mut found: Positions<D> = std::array::from_fn(|_| Vec::with_capacity(numbers.len()));
        self.each(numbers, |block, rows| {
            let positions = self.places.of(block, || Ok(self.kept.there(block)?.positions))?;
            found.iter_mut().zip(&*positions).for_each(|(all, x)| all.extend_from_slice(&x[rows.clone()]));
            Ok(())
        })?;
        Ok(found)
    }

    fn sums(&self, numbers: Range<usize>) -> Result<Option<(Vec<f64>, Vec<f64>)>> {
        let mut found: [Vec<f64>; 2] = std::array::from_fn(|_| Vec::with_capacity(numbers.len()));
        self.each(numbers, |block, rows| {
            let sums = self.sums.of(block, || self.kept.sums(block).map(|sums| [sums.support, sums.density]))?;
            found.iter_mut().zip(&*sums).for_each(|(all, x)| all.extend_from_slice(&x[rows.clone()]));
            Ok(())
        })?;
        let [support, density] = found;
        Ok(Some((support, density)))
    }
}

/// What was last read of blocks. Of two of them: a file's rows are made several at a time, on both sides of where a block ends.
struct Recent<T>(Mutex<Vec<(usize, Arc<T>)>>);

impl<T> Recent<T> {
    const KEPT: usize = 2;

    fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    fn of(&self, block: usize, read: impl FnOnce() -> Result<T>) -> Result<Arc<T>> {
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, found)) = last.iter().find(|(number, _)| *number == block) {
            return Ok(found.clone());
        }
        if last.len() == Self::KEPT {
            last.remove(0);
        }
        let found = Arc::new(read()?);
        last.push((block, found.clone()));
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows on both sides of where blocks end, in turn, as threads ask for them.
    #[test]
    fn each_block_is_read_once_where_rows_go_forward() {
        let (recent, mut reads) = (Recent::new(), Vec::new());
        for block in [0, 0, 1, 0, 1, 0, 1, 2, 1, 2, 2, 3] {
            let found = recent.of(block, || {
                reads.push(block);
                Ok(block * 10)
            });
            assert_eq!(*found.unwrap(), block * 10);
        }
        assert_eq!(reads, [0, 1, 2, 3]);
    }
}
