//! Bounds of a field over a region of space, in contrast to values at points.

use super::trace::MOST_LEVELS;
use std::f64::consts::{PI, TAU};

/// A box that holds a part of space and, where that is known, the distances of its points from a center.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch<const D: usize> {
    pub lo: [f64; D],
    pub hi: [f64; D],
    /// A point of it.
    pub middle: [f64; D],
    /// The center, with the least and the largest distance from it.
    pub distance: Option<([f64; D], [f64; 2])>,
}

/// Bounds of a field within a [`Patch`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Enclosure {
    /// No value is below, and none above.
    pub least: f64,
    pub most: f64,
    /// Whether it certainly has no discontinuity.
    pub is_continuous: bool,
    /// Of the levels that the trace of the patch's middle has, as far as they are kept.
    levels: [[f64; 2]; MOST_LEVELS],
    level_count: usize,
}

impl Enclosure {
    pub fn new(least: f64, most: f64, is_continuous: bool) -> Self {
        Self { least, most, is_continuous, levels: [[0.0; 2]; MOST_LEVELS], level_count: 0 }
    }

    /// Adds the bounds of a level, in the order of the levels of [`super::Trace`].
    pub(crate) fn push(&mut self, level: [f64; 2]) {
        if let Some(place) = self.levels.get_mut(self.level_count) {
            *place = level;
            self.level_count += 1;
        }
    }

    /// With bounds of its values that are better.
    pub(crate) fn within(self, least: f64, most: f64) -> Self {
        Self { least, most, ..self }
    }

    /// Of both patches, which have the same middle.
    pub(crate) fn union(self, other: Self) -> Self {
        let is_continuous = self.is_continuous && other.is_continuous;
        let mut all = Self::new(self.least.min(other.least), self.most.max(other.most), is_continuous);
        let both = self.levels().iter().zip(other.levels());
        both.for_each(|(a, b)| all.push([a[0].min(b[0]), a[1].max(b[1])]));
        all
    }

    /// Of values alone: points have met what is discontinuous.
    pub(crate) fn with_met_jumps(self) -> Self {
        Self { is_continuous: true, ..self }
    }

    /// Within a hull, whose levels come before those of the field; where that cuts the patch the field jumps to nothing.
    pub(crate) fn within_hull(self, levels: &[[f64; 2]], is_cut: bool) -> Self {
        let least = if is_cut { self.least.min(0.0) } else { self.least };
        let mut all = Self::new(least, self.most, self.is_continuous && !is_cut);
        levels.iter().chain(self.levels()).for_each(|level| all.push(*level));
        all
    }

    /// Bounds of levels.
    pub(crate) fn levels(&self) -> &[[f64; 2]] {
        &self.levels[..self.level_count]
    }
}

/// What masses of particles need to be known to, relatively: files with single precision have no more digits.
pub(crate) const ENOUGH: f64 = 1e-6;
/// Relative part of an integral that may lie where no point of a rule does: a tenth of that.
pub(crate) const UNSEEN: f64 = 1e-7;

impl Enclosure {
    /// Whether there may be a pole.
    pub(crate) fn has_pole(&self) -> bool {
        !self.range().is_finite()
    }

    /// Of the field times a factor that is not negative and between two bounds.
    pub(crate) fn times(self, [a, b]: [f64; 2]) -> Self {
        // 0 times what has no bound is 0 wherever that is a number.
        let most = if b == 0.0 { 0.0 } else { self.most * b };
        Self { least: self.least * a, most, ..self }
    }

    pub(crate) fn range(&self) -> f64 {
        self.most - self.least
    }

    /// How much of an integral over a `volume`, taken from values within `seen`, may lie between the points: nothing
    /// where these have met values about as different as there are. A continuous function counts as met from half of its largest value on.
    ///
    /// About a pole, where there is no bound, all is in doubt that was found, or that should be there.
    pub(crate) fn unseen(&self, seen: [f64; 2], volume: f64, about_pole: f64) -> f64 {
        let range = self.range();
        let met = 2.0 * (seen[1] - seen[0]) + if self.is_continuous { seen[1] } else { 0.0 };
        match range {
            _ if !range.is_finite() => about_pole,
            _ if range > met * (1.0 + ROUNDING) => range * volume,
            _ => 0.0,
        }
    }
}

/// What half of a cell may hold about a pole: what was found there, or what a power law has there that has the other half's integral
/// beyond, and falls as that from the whole to the half.
pub(crate) fn about_pole(whole: f64, half: f64, other: f64) -> f64 {
    let fall = (half / whole).abs().min(STEEPEST);
    half.abs().max(fall / (1.0 - fall) * other.abs())
}

/// Largest share of a cell's integral that half of it has about a pole: where it is larger, hardly anything of it is ever met.
const STEEPEST: f64 = 0.999;

/// Bounds of the same values come out this different, relatively.
const ROUNDING: f64 = 1e-9;

impl<const D: usize> Patch<D> {
    pub(crate) fn of_box(lo: [f64; D], hi: [f64; D]) -> Self {
        Self { lo, hi, middle: sph::array(|k| 0.5 * (lo[k] + hi[k])), distance: None }
    }

    /// Between two distances from `center`, two heights over it per distance (its polar axis is the last one), and two turns about it;
    /// in one dimension `turns` are those of -1 or 1.
    pub(crate) fn of_shell(center: [f64; D], radii: [f64; 2], heights: [f64; 2], turns: [f64; 2]) -> Self {
        let rings = heights.map(|z| (1.0 - z * z).max(0.0).sqrt());
        // The ring is widest at the equator.
        let widest = if heights[0] <= 0.0 && heights[1] >= 0.0 { 1.0 } else { rings[0].max(rings[1]) };
        let rings = [rings[0].min(rings[1]), widest];
        let [x, y] = around(turns);
        let sides = match D {
            1 => vec![turns],
            2 => vec![x, y],
            _ => vec![product(rings, x), product(rings, y), heights],
        };
        let along = |k: usize| sides.get(k).map_or([0.0; 2], |&side| product(radii, side));
        let lo = sph::array(|k| center[k] + along(k)[0]);
        let hi = sph::array(|k| center[k] + along(k)[1]);
        Self { distance: Some((center, radii)), ..Self::of_box(lo, hi) }
    }

    /// Between two distances from the line through `center` along `axis`, two coordinates along it, and two turns about it.
    pub(crate) fn of_tube(
        (center, axis): (&[f64; D], usize),
        radii: [f64; 2],
        ends: [f64; 2],
        turns: [f64; 2],
    ) -> Self {
        let mut across = around(turns).into_iter().map(|side| product(radii, side));
        let sides: [[f64; 2]; D] = sph::array(|k| match k == axis {
            true => ends,
            false => across.next().unwrap_or([0.0; 2]).map(|v| center[k] + v),
        });
        Self::of_box(sides.map(|s| s[0]), sides.map(|s| s[1]))
    }
}

/// Bounds of a product, of which the first factor is not negative.
fn product([a, b]: [f64; 2], [lo, hi]: [f64; 2]) -> [f64; 2] {
    [(a * lo).min(b * lo), (a * hi).max(b * hi)]
}

/// Bounds of cosine and sine between two turns.
fn around([from, to]: [f64; 2]) -> [[f64; 2]; 2] {
    let bounds = |crest: f64, f: fn(f64) -> f64| {
        let holds = |place: f64| (to - place).floor() >= (from - place).ceil();
        let (a, b) = (f(TAU * from), f(TAU * to));
        let least = if holds(crest + 0.5) { -1.0 } else { a.min(b) };
        [least, if holds(crest) { 1.0 } else { a.max(b) }]
    };
    [bounds(0.0, f64::cos), bounds(0.25, f64::sin)]
}

/// Bounds of the sine between two angles from 0 to pi.
pub(crate) fn sine_of_polar_angles([a, b]: [f64; 2]) -> [f64; 2] {
    let (p, q) = (a.sin(), b.sin());
    [p.min(q), if a <= 0.5 * PI && b >= 0.5 * PI { 1.0 } else { p.max(q) }]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_hold_their_points() {
        let center = [1.0, -2.0, 0.5];
        for i in 0..64 {
            let side = |k: u32| f64::from(i / 4_i32.pow(k) % 4);
            let (radii, heights) = ([0.3 * side(0), 0.3 * side(0) + 0.3], [0.5 * side(1) - 1.0, 0.5 * side(1) - 0.5]);
            let turns = [0.25 * side(2) - 0.1, 0.25 * side(2) + 0.15];
            let shell = Patch::of_shell(center, radii, heights, turns);
            let tube = Patch::of_tube((&center, 1), radii, heights, turns);
            for j in 0..1000 {
                let share = |k: u32, [a, b]: [f64; 2]| a + (b - a) * f64::from(j / 10_i32.pow(k) % 10) / 9.0;
                let (r, z, turn) = (share(0, radii), share(1, heights), TAU * share(2, turns));
                let ring = (1.0 - z * z).sqrt();
                let x = [r * ring * turn.cos(), r * ring * turn.sin(), r * z];
                let y = [center[0] + r * turn.cos(), z, center[2] + r * turn.sin()];
                for k in 0..3 {
                    let at = center[k] + x[k];
                    assert!(shell.lo[k] <= at + 1e-12 && at <= shell.hi[k] + 1e-12, "{i} {j} {k}");
                    assert!(tube.lo[k] <= y[k] + 1e-12 && y[k] <= tube.hi[k] + 1e-12, "{i} {j} {k}");
                }
            }
        }
    }
}
