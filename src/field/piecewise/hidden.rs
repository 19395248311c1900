//! Boundaries of parts that may be hidden between the points of a cell's lattice.

use super::lattice::shares;
use crate::field::Level;

/// Share of the range of a level by which it may exceed a bound that it meets right at a face.
const AT_FACE: f64 = 4e-11;

/// Whether a level may leave its interval within a cell, from its values at the lattice: by how much, as a share of its
/// range, and where next to.
pub(super) fn hidden_end<const D: usize>(lattice: &[Level]) -> Option<(f64, [f64; D])> {
    let beyond = |e: Excess<D>| (!e.is_within()).then(|| (e.share(), e.place));
    let [above, below] = excesses(lattice, &[]);
    above.and_then(beyond).or_else(|| below.and_then(beyond))
}

/// The share of a cell in which a level may leave its interval: as much as it may exceed a bound by, or, where it just meets one, the little in
/// which it may exceed it by less than is told here.
pub(super) fn share_beyond<const D: usize>(lattice: &[Level], others: &[([f64; D], f64)]) -> f64 {
    let share = |e: Excess<D>| match (e.is_within(), e.meets()) {
        (false, _) => e.share(),
        (true, true) => AT_FACE.powf(e.room()),
        (true, false) => 0.0,
    };
    excesses(lattice, others).into_iter().flatten().map(share).fold(0.0, f64::max)
}

/// How far a level may exceed its bounds above and below; none of bounds that are infinite.
fn excesses<const D: usize>(lattice: &[Level], others: &[([f64; D], f64)]) -> [Option<Excess<D>>; 2] {
    let middle = lattice[lattice.len() / 2];
    let values: Vec<f64> = lattice.iter().map(|l| l.value).collect();
    let mirrored: Vec<([f64; D], f64)> = others.iter().map(|(s, v)| (*s, -v)).collect();
    let below = values.iter().map(|v| -v).collect::<Vec<_>>();
    [Excess::of(&values, others, middle.hi), Excess::of(&below, &mirrored, -middle.lo)]
}

/// How far a function may exceed a bound within a cell, and where.
#[derive(Clone, Copy)]
struct Excess<const D: usize> {
    excess: f64,
    /// Of the function.
    range: f64,
    place: [f64; D],
}

impl<const D: usize> Excess<D> {
    /// From the values at the lattice.
    ///
    /// Of the parabola through the lattice, plus twice what its corners and other places show beyond: bounded axis by axis, which is exact
    /// without mixed terms, or as a function linear along each axis, the largest at a corner, less its downward bends.
    fn of(values: &[f64], others: &[([f64; D], f64)], bound: f64) -> Option<Self> {
        if bound.is_infinite() {
            return None;
        }
        let q = Parabola::<D>::through(values);
        let place: [f64; D] = sph::array(|k| {
            if -2.0 * q.bend[k] > q.slope[k].abs() { -0.5 * q.slope[k] / q.bend[k] } else { q.slope[k].signum() }
        });
        let by_axes = q.middle + (0..D).map(|k| q.along(k, place[k])).sum::<f64>() + q.mixed_sum();
        let corner = (0..values.len())
            .filter(|&i| shares::<D>(i).iter().all(|s| *s != 0.0))
            .fold(f64::NEG_INFINITY, |most, i| most.max(values[i]));
        let by_corners = corner + q.bend.iter().map(|b| (-b).max(0.0)).sum::<f64>();
        let at_lattice = (0..values.len()).map(|i| (values[i] - q.at(&shares(i))).abs());
        let between = others.iter().map(|(s, v)| (v - q.at(s)).abs());
        let blur = 2.0 * at_lattice.chain(between).fold(0.0, f64::max);
        Some(Self { excess: by_axes.min(by_corners) + blur - bound, range: q.range() + blur, place })
    }

    /// Not where it is not a number: then anything may be.
    fn is_within(&self) -> bool {
        self.excess <= AT_FACE * self.range
    }

    fn meets(&self) -> bool {
        self.excess >= -AT_FACE * self.range
    }

    /// As a share of the range.
    fn share(&self) -> f64 {
        if self.excess.is_nan() { 1.0 } else { (self.excess / self.range).min(1.0) }
    }

    /// By what power of a small excess the volume goes in which there is one: half of the number of axes along which it is largest within the cell;
    /// at a face it goes by the excess itself.
    fn room(&self) -> f64 {
        let inner = self.place.iter().filter(|s| s.abs() < 1.0).count();
        if inner > 0 { 0.5 * inner as f64 } else { 1.0 }
    }
}

/// A function of degree 2 of coordinates that run from -1 to 1.
struct Parabola<const D: usize> {
    middle: f64,
    slope: [f64; D],
    bend: [f64; D],
    mixed: [[f64; D]; D],
}

impl<const D: usize> Parabola<D> {
    /// From values at the lattice: through those at the center, the faces' centers and, on average, the edges' middles.
    fn through(values: &[f64]) -> Self {
        let center = values.len() / 2;
        let middle = values[center];
        let step = |k: usize| 3_usize.pow(k as u32);
        let pair = |step: usize| [values[center + step], values[center - step]];
        let slope = sph::array(|k| 0.5 * (pair(step(k))[0] - pair(step(k))[1]));
        let bend = sph::array(|k| 0.5 * (pair(step(k))[0] + pair(step(k))[1]) - middle);
        let mixed = |k: usize, l: usize| {
            let (p, q) = (step(k.max(l)), step(k.min(l)));
            0.25 * (pair(p + q).iter().sum::<f64>() - pair(p - q).iter().sum::<f64>())
        };
        let mixed = std::array::from_fn(|k| std::array::from_fn(|l| if k == l { 0.0 } else { mixed(k, l) }));
        Self { middle, slope, bend, mixed }
    }

    fn along(&self, k: usize, s: f64) -> f64 {
        self.slope[k] * s + self.bend[k] * s * s
    }

    fn at(&self, s: &[f64; D]) -> f64 {
        let mixed = |k: usize| (0..k).map(|l| self.mixed[k][l] * s[k] * s[l]).sum::<f64>();
        self.middle + (0..D).map(|k| self.along(k, s[k]) + mixed(k)).sum::<f64>()
    }

    fn mixed_sum(&self) -> f64 {
        0.5 * self.mixed.iter().flatten().map(|m| m.abs()).sum::<f64>()
    }

    fn range(&self) -> f64 {
        self.slope.iter().chain(&self.bend).map(|c| c.abs()).sum::<f64>() + self.mixed_sum()
    }
}
