//! Reductions whose result does not depend on the number of threads: fixed chunks, combined in order.

use crate::parallel::pieces;

const CHUNK: usize = 4096;

/// Particles whose sums are not compensated.
const SHORT_CHUNK: usize = 512;

/// Sums within a chunk that do not wait for each other.
const LANES: usize = 4;

/// Sum of `f(i)` for `i` in `0..n`, compensated (Neumaier) within and across chunks.
pub fn sum(n: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
    let partial = pieces(n, CHUNK, |range| chunk(range.start, range.end, &f));
    let mut total = Compensated::default();
    partial.into_iter().for_each(|part| total.join(part));
    total.value()
}

fn chunk(from: usize, to: usize, f: &impl Fn(usize) -> f64) -> Compensated {
    let mut lanes = [Compensated::default(); LANES];
    let even = to - (to - from) % LANES;
    for i in (from..even).step_by(LANES) {
        (0..LANES).for_each(|l| lanes[l].add(f(i + l)));
    }
    (even..to).for_each(|i| lanes[0].add(f(i)));
    let mut total = Compensated::default();
    lanes.into_iter().for_each(|lane| total.join(lane));
    total
}

/// Several sums over `0..n` at once, as good as [`sum`] but for what is within chunks.
pub fn sums<const K: usize>(n: usize, f: impl Fn(usize) -> [f64; K] + Sync) -> [f64; K] {
    chunk_sums(n, SHORT_CHUNK, |range| {
        let mut lanes = [[0.0; K]; LANES];
        for (i, lane) in range.zip((0..LANES).cycle()) {
            let values = f(i);
            (0..K).for_each(|k| lanes[lane][k] += values[k]);
        }
        crate::array(|k| lanes.iter().map(|lane| lane[k]).sum())
    })
}

/// Sums over `0..n` of what `f` makes of chunks of it; compensated across chunks, within them as `f` sums.
pub fn chunk_sums<const K: usize>(
    n: usize,
    chunk: usize,
    f: impl Fn(std::ops::Range<usize>) -> [f64; K] + Sync,
) -> [f64; K] {
    let parts = pieces(n, chunk, f);
    crate::array(|k| {
        let mut total = Compensated::default();
        parts.iter().for_each(|p| total.add(p[k]));
        total.value()
    })
}

/// Largest of `f(i)`, or negative infinity for `n` = 0. NaN is passed over.
pub fn max(n: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
    let parts = pieces(n, CHUNK, |range| range.fold(f64::NEG_INFINITY, |m, i| m.max(f(i))));
    parts.into_iter().fold(f64::NEG_INFINITY, f64::max)
}

/// Running sum that carries its rounding error along.
#[derive(Debug, Clone, Copy, Default)]
pub struct Compensated {
    sum: f64,
    correction: f64,
}

impl Compensated {
    pub fn add(&mut self, x: f64) {
        let total = self.sum + x;
        self.correction += if self.sum.abs() >= x.abs() { (self.sum - total) + x } else { (x - total) + self.sum };
        self.sum = total;
    }

    fn join(&mut self, other: Self) {
        self.add(other.sum);
        self.add(other.correction);
    }

    pub fn value(self) -> f64 {
        self.sum + self.correction
    }
}
