//! Combines octs into blocks: octs that fill a larger cube of their level become one block, so that a uniform part of a grid needs one block for
//! each such cube. Octs are sorted along Morton's curve, on which every cube is a contiguous range.

use super::info::Info;
use super::octs::Octs;
use super::schema::NAME;
use crate::error::{FormatError, Result};
use crate::refined::RefinedBlock;
use std::path::Path;

/// The box in coarse cells: the first along each axis, and the one behind the last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Box {
    pub lo: [u64; 3],
    pub hi: [u64; 3],
}

impl Box {
    /// That of the octs of level 1, of which every coarse cell within the boundaries has one; `None` where there are none.
    pub fn of(first_level: &Octs) -> Option<Self> {
        let start = first_level.first.first()?;
        let grow = |b: Self, x: &[u64; 3]| Self {
            lo: std::array::from_fn(|k| b.lo[k].min(x[k])),
            hi: std::array::from_fn(|k| b.hi[k].max(x[k] + 1)),
        };
        Some(first_level.first.iter().fold(Self { lo: *start, hi: start.map(|x| x + 1) }, grow))
    }
}

/// Appends the blocks of a level and the values of their cells.
///
/// # Errors
/// [`FormatError::Input`] where an oct is outside of the box or in two files.
pub fn append(
    path: &Path,
    info: &Info,
    within: &Box,
    level: usize,
    octs: &Octs,
    (blocks, values): (&mut Vec<RefinedBlock>, &mut [Vec<f64>]),
) -> Result<()> {
    let sorted = Sorted::new(path, info, within, level, octs)?;
    let d = info.dimension;
    let mut i = 0;
    while i < sorted.octs.len() {
        let doublings = sorted.cube(i, d);
        let (oct, edge) = (sorted.octs[i], 1_u64 << doublings);
        let first: [u64; 3] = std::array::from_fn(|k| if k < d { 2 * sorted.place(oct, k) } else { 0 });
        let block = |number, first, edge| RefinedBlock {
            number,
            level: level as u8,
            first,
            cells: std::array::from_fn(|k| if k < d { edge } else { 1 }),
        };
        if sorted.is_whole(i) {
            let whole = block(blocks.len(), first, 2 * edge);
            blocks.push(whole);
            sorted.cells(i, whole.cells, |value| (0..values.len()).for_each(|v| values[v].push(octs.values[v][value])));
        } else {
            for cell in (0..1_usize << d).filter(|cell| octs.leaves[oct as usize] >> cell & 1 == 1) {
                let shifted = std::array::from_fn(|k| first[k] + (cell as u64 >> k & 1));
                blocks.push(block(blocks.len(), shifted, 1));
                let value = ((oct as usize) << d) + cell;
                values.iter_mut().zip(&octs.values).for_each(|(to, from)| to.push(from[value]));
            }
        }
        i += 1 << (d as u32 * doublings);
    }
    Ok(())
}

/// Octs in the order of Morton's curve.
struct Sorted<'a> {
    octs: Vec<u32>,
    keys: Vec<u128>,
    /// How many of those before are leaves in all their cells.
    whole_before: Vec<u32>,
    all: &'a Octs,
    corner: [u64; 3],
    dimension: usize,
}

impl<'a> Sorted<'a> {
    fn new(path: &Path, info: &Info, within: &Box, level: usize, all: &'a Octs) -> Result<Self> {
        let dimension = info.dimension;
        let per_coarse = 1_u64 << (level - 1);
        let corner = within.lo.map(|x| x * per_coarse);
        for (i, first) in all.first.iter().enumerate() {
            if (0..dimension).any(|k| first[k] < corner[k] || first[k] >= within.hi[k] * per_coarse) {
                let problem = format!(
                    "an oct of level {level} lies at {first:?} in octs of its level, outside of the box of the octs of level 1"
                );
                return Err(FormatError::input(&info.file("amr", all.process[i] as usize)?, NAME, "octs", problem));
            }
        }
        let place = |oct: u32| -> [u64; 3] {
            std::array::from_fn(|k| all.first[oct as usize][k] - if k < dimension { corner[k] } else { 0 })
        };
        let mut octs: Vec<(u128, u32)> = (0..all.first.len() as u32).map(|i| (key(place(i), dimension), i)).collect();
        octs.sort_unstable();
        if let Some(pair) = octs.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            let [a, b] = [pair[0].1, pair[1].1].map(|oct| all.process[oct as usize] as usize);
            let problem = format!(
                "an oct of level {level} at {:?} in octs of its level is in file {a} and again in '{}'",
                place(pair[0].1),
                info.file("amr", b)?.display()
            );
            return Err(FormatError::input(
                &info.file("amr", a).unwrap_or_else(|_| path.into()),
                NAME,
                "octs",
                problem,
            ));
        }
        let is_whole = |oct: u32| all.leaves[oct as usize] == whole(dimension);
        let mut whole_before = vec![0];
        for &(_, oct) in &octs {
            whole_before.push(whole_before[whole_before.len() - 1] + u32::from(is_whole(oct)));
        }
        let (keys, octs) = octs.into_iter().unzip();
        Ok(Self { octs, keys, whole_before, all, corner, dimension })
    }

    /// Place of an oct along an axis from the lower end of the box.
    fn place(&self, oct: u32, axis: usize) -> u64 {
        self.all.first[oct as usize][axis] - self.corner[axis]
    }

    fn is_whole(&self, i: usize) -> bool {
        self.whole_before[i + 1] > self.whole_before[i]
    }

    /// How often the octs from `i` on double along each axis while all of them are there and whole.
    fn cube(&self, i: usize, d: usize) -> u32 {
        let fits = |doublings: u32| {
            let count = 1_usize.checked_shl(d as u32 * doublings).filter(|n| i + n <= self.octs.len());
            count.is_some_and(|n| {
                self.keys[i].is_multiple_of(n as u128)
                    && self.keys[i + n - 1] == self.keys[i] + (n as u128 - 1)
                    && (self.whole_before[i + n] - self.whole_before[i]) as usize == n
            })
        };
        (1..).take_while(|&doublings| d as u32 * doublings < usize::BITS && fits(doublings)).last().unwrap_or(0)
    }

    /// The numbers of the values of a cube's cells, x fastest.
    fn cells(&self, i: usize, size: [u64; 3], mut take: impl FnMut(usize)) {
        let d = self.dimension;
        for z in 0..size[2] {
            for y in 0..size[1] {
                for x in 0..size[0] {
                    let run = i + key([x / 2, y / 2, z / 2], d) as usize;
                    let cell = (x & 1) | (y & 1) << 1 | (z & 1) << 2;
                    take(((self.octs[run] as usize) << d) + cell as usize);
                }
            }
        }
    }
}

/// All cells of an oct are leaves.
fn whole(dimension: usize) -> u8 {
    match dimension {
        1 => 0b11,
        2 => 0b1111,
        _ => 0xff,
    }
}

/// Morton's key: the bits of the places in turn.
fn key(place: [u64; 3], dimension: usize) -> u128 {
    let bits = u64::BITS - place.iter().fold(0, |all, x| all | x).leading_zeros();
    let bit = |n: u32| (0..dimension).map(move |k| u128::from(place[k] >> n & 1) << (n as usize * dimension + k));
    (0..bits).flat_map(bit).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubes_are_runs_of_keys() {
        let keys: Vec<u128> = (0..8).map(|i| key([4 + (i & 1), 2 + (i >> 1 & 1), 6 + (i >> 2)], 3)).collect();
        assert!(keys.windows(2).all(|w| w[1] == w[0] + 1) && keys[0].is_multiple_of(8), "{keys:?}");
        assert_eq!(key([5, 0, 0], 1), 5);
        assert_eq!(key([3, 1, 0], 2), 0b0111);
        // The farthest of 42 bits.
        assert_eq!(key([(1 << 42) - 1; 3], 3), (1 << 126) - 1);
    }
}
