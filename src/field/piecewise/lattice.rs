//! The points of a cell at which its parts are identified: at the faces and in the middle along each axis.

use crate::field::Trace;

/// Coordinates of the i-th point of the lattice: -1, 0 or 1.
pub(super) fn shares<const D: usize>(i: usize) -> [f64; D] {
    sph::array(|k| (i / 3_usize.pow(k as u32) % 3) as f64 - 1.0)
}

/// The number of the point at coordinates -1, 0 or 1.
pub(super) fn index<const D: usize>(shares: [f64; D]) -> usize {
    (0..D).map(|k| (shares[k] + 1.0) as usize * 3_usize.pow(k as u32)).sum()
}

/// How many parts there are.
pub(super) fn part_count(lattice: &[Trace]) -> usize {
    let mut parts: Vec<u64> = lattice.iter().map(|t| t.part).collect();
    parts.sort_unstable();
    parts.dedup();
    parts.len()
}

/// The axes, the one along which the part changes most often last, ties from the last to the first.
pub(super) fn axes_across<const D: usize>(lattice: &[Trace]) -> [usize; D] {
    let changes = |k: usize| {
        let step = 3_usize.pow(k as u32);
        let has_next = |i: &usize| i / step % 3 < 2;
        (0..lattice.len()).filter(has_next).filter(|&i| lattice[i].part != lattice[i + step].part).count()
    };
    let mut axes: [usize; D] = sph::array(|k| D - 1 - k);
    axes.sort_by_key(|&k| changes(k));
    axes
}
