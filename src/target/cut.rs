//! Cells of mass, cut in two by a plane.

use super::cells::{Cell, Rule};
use super::matter::Matter;
use super::refinement::halve;

/// Cells on both sides of a plane.
pub(crate) struct Cut<const D: usize> {
    pub axis: usize,
    pub plane: f64,
    pub left: Vec<Cell<D>>,
    pub right: Vec<Cell<D>>,
}

/// Splits cells by a plane across the axis along which their mass is spread most, with `fraction` of the mass on the
/// left. Cells that the plane crosses are divided.
pub(crate) fn cut<const D: usize>(cells: Vec<Cell<D>>, fraction: f64) -> Cut<D> {
    let along = Along::of(&cells);
    let axis = along.parting_axis(&cells, fraction);
    let plane = plane_across(axis, &cells, fraction, along.about(axis, fraction));
    cut_at(axis, plane, cells)
}

/// [`cut`] through as few particles as may be, with the cells at the plane sliced until what of their mass is on either side is known well, and not by
/// what part of them is.
pub(crate) fn cut_closely<const D: usize>(
    target: &dyn Matter<D>,
    mut cells: Vec<Cell<D>>,
    fraction: f64,
    rule: Rule,
) -> Cut<D> {
    let along = Along::of(&cells);
    // Beside a jump what is thin is another region.
    let axis = if target.may_jump() { along.widest } else { along.least_met_axis(&cells, fraction) };
    let about = along.about(axis, fraction);
    for _ in 0..SLICINGS {
        let plane = plane_across(axis, &cells, fraction, about);
        let crossed = (0..cells.len()).filter(|&i| cells[i].lo[axis] < plane && cells[i].hi[axis] > plane).collect();
        halve(&mut cells, crossed, |cell| cell.halves_sharing(axis, target, rule));
    }
    let plane = plane_across(axis, &cells, fraction, about);
    cut_at(axis, plane, cells)
}

/// Halvings of the cells at a plane: each leaves a quarter of the error.
const SLICINGS: usize = 2;

/// Part of a cell that is not cut off: a plane that far from its face is at the face but for rounding, and what was cut off there would be a cell like
/// others in all that is asked of it but its size.
const SLIVER: f64 = 1e-6;

pub(super) fn cut_at<const D: usize>(axis: usize, plane: f64, cells: Vec<Cell<D>>) -> Cut<D> {
    let mut left = Vec::with_capacity(cells.len() / 2 + 8);
    let mut right = Vec::with_capacity(cells.len() / 2 + 8);
    for cell in cells {
        let (before, edge) = (plane - cell.lo[axis], cell.hi[axis] - cell.lo[axis]);
        if before >= (1.0 - SLIVER) * edge {
            left.push(cell);
        } else if before <= SLIVER * edge {
            right.push(cell);
        } else {
            let share = before / edge;
            let (mut a, mut b) = (cell, cell);
            a.hi[axis] = plane;
            b.lo[axis] = plane;
            a.mass *= share;
            b.mass *= 1.0 - share;
            left.push(a);
            right.push(b);
        }
    }
    Cut { axis, plane, left, right }
}

/// How mass is spread along each axis.
struct Along<const D: usize> {
    bins: [Binned; D],
    total: f64,
    /// The axis along which halves of the mass are thickest: of a uniform box that of its longest edge. What a thin tail covers
    /// says little about where the mass is, and a cut across a steep slope leaves one half thin.
    widest: usize,
}

impl<const D: usize> Along<D> {
    fn of(cells: &[Cell<D>]) -> Self {
        let (mut total, mut moment) = (0.0, [0.0; D]);
        for cell in cells {
            total += cell.mass;
            let center = cell.center();
            (0..D).for_each(|k| moment[k] += cell.mass * center[k]);
        }
        let mean = moment.map(|m| m / total);
        let mut square = [0.0; D];
        for cell in cells {
            let center = cell.center();
            for k in 0..D {
                let edge = cell.hi[k] - cell.lo[k];
                square[k] += cell.mass * ((center[k] - mean[k]).powi(2) + edge.powi(2) / 12.0);
            }
        }
        let width = square.map(|s| (12.0 * s / total).sqrt());
        let mut bins: [Binned; D] = std::array::from_fn(|k| Binned::around(mean[k], width[k]));
        for cell in cells {
            let (center, share) = (cell.center(), cell.mass / total);
            bins.iter_mut().zip(center).for_each(|(bins, center)| bins.add(center, share));
        }
        let thickness: [f64; D] = sph::array(|k| width[k] * bins[k].evenness(width[k]));
        // Equal but for rounding is equal.
        let is_thicker = |k: usize, best: usize| thickness[k] > thickness[best] * (1.0 + 1e-9);
        Self { bins, total, widest: (0..D).fold(0, |best, k| if is_thicker(k, best) { k } else { best }) }
    }

    /// About where `fraction` of the mass lies to the left.
    fn about(&self, axis: usize, fraction: f64) -> About {
        self.bins[axis].about(fraction)
    }

    /// The widest axis, but not where halves were thinner than the spacing of some particles, and another parts those from the rest: of a stratified
    /// box the sparse layers have few particles across. Nor is a layer parted along itself for what few particles are beside it.
    fn parting_axis(&self, cells: &[Cell<D>], fraction: f64) -> usize {
        let axis = parting_axis(cells, self.widest);
        let is_layer = || met(cells, axis, self.about(axis, fraction).place) > LAYER * self.total;
        if axis == self.widest || is_layer() { self.widest } else { axis }
    }

    /// The same, or the axis that a plane across goes through far fewer particles of: those that belong to both sides.
    fn least_met_axis(&self, cells: &[Cell<D>], fraction: f64) -> usize {
        let met: [f64; D] = sph::array(|k| met(cells, k, self.about(k, fraction).place));
        let first = parting_axis(cells, self.widest);
        (0..D).fold(first, |best, k| if met[k] < FAR_FEWER * met[best] { k } else { best })
    }
}

/// Part of the particles that a plane goes through from which on they are one layer, of which no half is to be a part.
const LAYER: f64 = 0.75;
/// Part of the particles that a plane goes through that is far fewer.
const FAR_FEWER: f64 = 0.5;

/// Particles, and by what factor there are fewer of them along another axis, from which on it is the better one.
const SOME: f64 = 1.0;
const FEWER: f64 = 0.5;

/// `axis`, or one along which far fewer particles have a spacing of more than half the extent.
fn parting_axis<const D: usize>(cells: &[Cell<D>], axis: usize) -> usize {
    let thin = thinner_than_spacing(cells);
    let least = (0..D).fold(axis, |best, k| if thin[k] < thin[best] { k } else { best });
    if thin[axis] > SOME && thin[least] < FEWER * thin[axis] { least } else { axis }
}

/// How many particles have a spacing of more than half the extent along each axis.
fn thinner_than_spacing<const D: usize>(cells: &[Cell<D>]) -> [f64; D] {
    let (mut lo, mut hi) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for cell in cells {
        lo = sph::array(|k| lo[k].min(cell.lo[k]));
        hi = sph::array(|k| hi[k].max(cell.hi[k]));
    }
    // To the power of D, as volumes of particles are.
    let most: [f64; D] = sph::array(|k| (0.5 * (hi[k] - lo[k])).powi(D as i32));
    let mut thin = [0.0; D];
    for cell in cells {
        let volume = cell.volume();
        (0..D).filter(|k| volume > cell.mass * most[*k]).for_each(|k| thin[k] += cell.mass);
    }
    thin
}

/// How many particles a plane goes through: of these it is less than half a spacing away.
fn met<const D: usize>(cells: &[Cell<D>], axis: usize, plane: f64) -> f64 {
    let of = |cell: &Cell<D>| {
        let (lo, hi) = (cell.lo[axis], cell.hi[axis]);
        let reach = 0.5 * (cell.volume() / cell.mass).powf(1.0 / D as f64);
        let within = (hi.min(plane + reach) - lo.max(plane - reach)).max(0.0);
        cell.mass * within / (hi - lo)
    };
    cells.iter().map(of).sum()
}

/// Shares of the mass in bins along an axis, by the centers of cells.
struct Binned {
    start: f64,
    step: f64,
    shares: [f64; BINS],
}

impl Binned {
    fn around(mean: f64, width: f64) -> Self {
        Self { start: mean - 0.5 * REACH * width, step: REACH * width / BINS as f64, shares: [0.0; BINS] }
    }

    fn add(&mut self, center: f64, share: f64) {
        // What is equal but for rounding falls into the same bin.
        let place = ((center - self.start) / self.step + 1e-6).clamp(0.0, (BINS - 1) as f64);
        self.shares[place as usize] += share;
    }

    /// How many bins have this share of the mass together.
    fn quantile(&self, share: f64) -> f64 {
        let mut before = 0.0;
        for (i, bin) in self.shares.iter().enumerate() {
            if before + bin >= share - 1e-9 {
                return i as f64 + (share - before) / bin;
            }
            before += bin;
        }
        BINS as f64
    }

    /// Where they end.
    fn about(&self, share: f64) -> About {
        About { place: self.start + self.step * self.quantile(share), bin: self.step }
    }

    /// Thickness of the thinner half of the mass over that of half a uniform layer of this width; 1 where it is nearly as much.
    fn evenness(&self, width: f64) -> f64 {
        if !(self.step > 0.0) {
            return 1.0;
        }
        let [first, middle, third] = [0.25, 0.5, 0.75].map(|share| self.quantile(share));
        let thinner = 4.0 * self.step * (middle - first).min(third - middle) / width;
        if thinner > NEARLY { 1.0 } else { thinner }
    }
}

/// Bins about the mean, and how far they reach in widths.
const BINS: usize = 48;
const REACH: f64 = 2.0;
/// Evenness from which on it counts as even.
const NEARLY: f64 = 0.75;

/// A place that is known to a bin.
#[derive(Clone, Copy)]
pub(super) struct About {
    pub place: f64,
    pub bin: f64,
}

impl About {
    fn is_near(self, x: f64) -> bool {
        (x - self.place).abs() <= self.bin
    }

    fn is_between(self, lo: f64, hi: f64) -> bool {
        self.place > lo && self.place < hi
    }
}

/// Where `fraction` of the mass lies to the left: Newton on the piecewise linear cumulative mass, bracketed, from `about` there.
pub(super) fn plane_across<const D: usize>(axis: usize, cells: &[Cell<D>], fraction: f64, about: About) -> f64 {
    let (mut lo, mut hi, mut total) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
    for cell in cells {
        lo = f64::min(lo, cell.lo[axis]);
        hi = f64::max(hi, cell.hi[axis]);
        total += cell.mass;
    }
    let left = fraction * total;
    let (mut a, mut b) = (lo, hi);
    // Where mass is even this is it, and on a face of cells that should stay whole.
    let if_even = lo + fraction * (hi - lo);
    let mut x = if about.is_near(if_even) || !about.is_between(lo, hi) { if_even } else { about.place };
    for _ in 0..100 {
        let (mut mass, mut slope) = (0.0, 0.0);
        for c in cells {
            if c.hi[axis] <= x {
                mass += c.mass;
            } else if c.lo[axis] < x {
                let rate = c.mass / (c.hi[axis] - c.lo[axis]);
                mass += rate * (x - c.lo[axis]);
                slope += rate;
            }
        }
        if (mass - left).abs() <= 1e-12 * total {
            break;
        }
        if mass > left {
            b = x
        } else {
            a = x
        }
        if b - a <= 1e-14 * (hi - lo) {
            break;
        }
        let newton = x + (left - mass) / slope;
        x = if newton > a && newton < b { newton } else { 0.5 * (a + b) };
    }
    x
}
