//! Parts of a piecewise smooth field along a line.

use crate::field::{Level, Trace};
use std::ops::Range;

/// Parts of a line, at most: where there are more, cells are halved instead.
const MOST_PARTS: usize = 8;
/// Points of a line at which hidden ends of parts are sought, at most.
const MOST_SAMPLES: usize = 48;
/// How well ends of parts are placed, as a share of the domain.
pub(super) const ACCURACY: f64 = 1e-14;
/// Where a line is looked at between its ends, as a share of it.
const GOLDEN: f64 = 0.381_966_011_250_105_1;
/// Stretches without levels are halved this often.
const BLIND_HALVINGS: u32 = 1;

/// One part along a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stretch {
    pub from: f64,
    pub to: f64,
    pub piece: u64,
    pub part: u64,
}

/// What is known at a point of the line. Its levels are the line's, which keeps those of all points.
#[derive(Clone, Copy)]
struct Sample {
    t: f64,
    piece: u64,
    part: u64,
    is_complete: bool,
    first_level: usize,
    levels: usize,
}

impl Sample {
    fn is_with(&self, other: &Self) -> bool {
        self.part == other.part
    }

    fn levels(&self) -> Range<usize> {
        self.first_level..self.first_level + self.levels
    }
}

/// The parts of the line `at` between two places, in their order; `None` if there are too many. Where a single discontinuity ends a part, its end
/// need not be placed better than to `accuracy`, and a line whose levels all say so by far has but one part: a first look at few points does.
pub(crate) fn stretches(at: &dyn Fn(f64) -> Trace, [lo, hi]: [f64; 2], accuracy: f64) -> Option<Vec<Stretch>> {
    let (levels, found) = (Vec::with_capacity(MOST_SAMPLES), Vec::with_capacity(4));
    let mut line = Line { at, accuracy, samples: 0, levels, found, start: lo };
    let (left, right) = (line.sample(lo), line.sample(hi));
    if !(accuracy > 0.0 && line.is_one_part(&left, &right)) {
        let middle = line.sample(0.5 * (lo + hi));
        line.walk(&left, &middle, 0)?;
        line.walk(&middle, &right, 0)?;
    }
    line.end(hi, &right)?;
    Some(line.found)
}

struct Line<'a> {
    at: &'a dyn Fn(f64) -> Trace,
    accuracy: f64,
    samples: usize,
    levels: Vec<Level>,
    found: Vec<Stretch>,
    /// Where the stretch begins that is not ended yet.
    start: f64,
}

impl Line<'_> {
    fn sample(&mut self, t: f64) -> Sample {
        self.samples += 1;
        let trace = (self.at)(t);
        let first_level = self.levels.len();
        self.levels.extend_from_slice(trace.levels());
        let Trace { piece, part, .. } = trace;
        Sample { t, piece, part, is_complete: trace.is_complete(), first_level, levels: trace.levels().len() }
    }

    fn end(&mut self, to: f64, within: &Sample) -> Option<()> {
        self.found.push(Stretch { from: self.start, to, piece: within.piece, part: within.part });
        self.start = to;
        (self.found.len() <= MOST_PARTS).then_some(())
    }

    /// Ends the stretches that end between two points.
    fn walk(&mut self, left: &Sample, right: &Sample, halvings: u32) -> Option<()> {
        if left.is_with(right) {
            return self.search(left, right, halvings);
        }
        let (a, b, end) = self.bracket(left, right);
        self.search(left, &a, halvings)?;
        self.end(end, &a)?;
        self.walk(&b, right, halvings)
    }

    /// Ends the stretches that hide between two points of the same part.
    fn search(&mut self, left: &Sample, right: &Sample, halvings: u32) -> Option<()> {
        if right.t - left.t < 4.0 * ACCURACY || self.samples >= MOST_SAMPLES {
            return Some(());
        }
        let middle = self.sample(0.5 * (left.t + right.t));
        let is_clear = if left.is_complete {
            middle.is_with(left) && self.is_clear(left, &middle, right)
        } else {
            middle.is_with(left) && halvings >= BLIND_HALVINGS
        };
        if is_clear {
            return Some(());
        }
        self.walk(left, &middle, halvings + 1)?;
        self.walk(&middle, right, halvings + 1)
    }

    /// Whether the levels at a point between two of a part say that all between them is of it, by far: parabolas through the three stay as far
    /// from the levels' bounds as they depart from straight lines. The point is none that periods have in common.
    fn is_one_part(&mut self, left: &Sample, right: &Sample) -> bool {
        if !(left.is_with(right) && left.is_complete) {
            return false;
        }
        let between = self.sample(left.t + GOLDEN * (right.t - left.t));
        let [l, m, r] = [left, &between, right].map(|sample| self.levels_of(sample));
        between.is_with(left)
            && l.iter().zip(m).zip(r).all(|((l, m), r)| {
                let straight = l.value + GOLDEN * (r.value - l.value);
                let margin = 0.5 * ((m.value - straight) / (GOLDEN * (1.0 - GOLDEN))).abs();
                let (least, most) = (l.value.min(r.value), l.value.max(r.value));
                least - margin >= l.lo && most + margin <= l.hi
            })
    }

    /// Points on both sides of the first end of `left`'s part that is found, and the end: the ITP method of Oliveira and
    /// Takahashi (2020, doi 10.1145/3423597) on the level that is left, halving where none is known.
    fn bracket(&mut self, left: &Sample, right: &Sample) -> (Sample, Sample, f64) {
        let (mut a, mut b) = (*left, *right);
        let mut last = f64::INFINITY;
        let width = b.t - a.t;
        let most = (width / ACCURACY).log2().ceil().max(0.0) as i32 + 1;
        for step in 0..=most + 2 {
            if b.t - a.t <= ACCURACY {
                break;
            }
            let half = 0.5 * (a.t + b.t);
            let t = match self.crossing(&a, &b) {
                Some(share) => {
                    let root = a.t + share * (b.t - a.t);
                    if (root - last).abs() < self.accuracy && self.is_single(&a, &b) {
                        return (a, b, root);
                    }
                    last = root;
                    let toward = (half - root).signum();
                    let truncated = root + toward * (0.2 * (b.t - a.t).powi(2) / width).min((half - root).abs());
                    let radius = (0.5 * ACCURACY * 2f64.powi(most - step) - 0.5 * (b.t - a.t)).max(0.0);
                    // At least as far from the secant's root as the root is accurate, so that it is bracketed.
                    let nudged = truncated + toward * 0.4 * ACCURACY;
                    nudged.clamp(half - radius, half + radius).clamp(a.t + 0.1 * ACCURACY, b.t - 0.1 * ACCURACY)
                }
                None => half,
            };
            let middle = self.sample(t);
            self.samples -= 1;
            if middle.is_with(&a) {
                a = middle;
            } else {
                b = middle;
            }
        }
        (a, b, 0.5 * (a.t + b.t))
    }

    /// Whether all that is known to lie between two points is one discontinuity.
    fn is_single(&self, a: &Sample, b: &Sample) -> bool {
        let left = self.levels_of(a).iter().zip(self.levels_of(b)).filter(|(p, q)| p.lo != q.lo || p.hi != q.hi);
        a.is_complete && b.is_complete && a.piece != b.piece && a.levels == b.levels && left.count() == 1
    }

    fn levels_of(&self, sample: &Sample) -> &[Level] {
        &self.levels[sample.levels()]
    }

    /// Where the level that ends `a`'s part does so, as a share of the way to `b`, by linear interpolation.
    fn crossing(&self, a: &Sample, b: &Sample) -> Option<f64> {
        let mut levels = self.levels_of(a).iter().zip(self.levels_of(b));
        let (from, to) = levels.find(|(p, q)| p.lo != q.lo || p.hi != q.hi)?;
        let bound = if to.value >= from.hi { from.hi } else { from.lo };
        let share = (bound - from.value) / (to.value - from.value);
        (0.0..=1.0).contains(&share).then_some(share)
    }

    /// Whether parabolas through the levels of three equidistant points of a part stay within the part.
    fn is_clear(&self, left: &Sample, middle: &Sample, right: &Sample) -> bool {
        let [left, middle, right] = [left, middle, right].map(|sample| self.levels_of(sample));
        left.iter().zip(middle).zip(right).all(|((l, m), r)| {
            let (rise, bend) = (0.5 * (r.value - l.value), 0.5 * (r.value + l.value) - m.value);
            if rise.abs() >= 2.4 * bend.abs() {
                return true;
            }
            let extreme = m.value - rise * rise / (4.0 * bend) - 0.1 * bend;
            if bend > 0.0 { extreme >= m.lo } else { !(bend < 0.0) || extreme <= m.hi }
        })
    }
}
