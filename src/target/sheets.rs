//! Where the cells of particles that are a sheet are cut in two, so that those of both sides are far apart: never along the sheet, which boxes around
//! cells do, where it has a tail.

use super::cells::Cell;
use super::cut::{About, Cut, cut_at, plane_across};
use super::matter::Matter;

/// Splits the cells of `n` particles that are a sheet along some axis by a plane with half of them on the left, and one more on the right where they
/// are odd, across the axis along which the middles of both sides are farthest apart. The cells, where they are none.
pub(crate) fn cut_sheet<const D: usize>(
    target: &dyn Matter<D>,
    cells: Vec<Cell<D>>,
    n: usize,
) -> Result<Cut<D>, Vec<Cell<D>>> {
    // A sheet's density falls by as much over less than a spacing.
    if falls_by(FALL.max((n as f64).powf(1.0 / D as f64)), target, &cells) { cut_thin(cells, n) } else { Err(cells) }
}

fn cut_thin<const D: usize>(cells: Vec<Cell<D>>, n: usize) -> Result<Cut<D>, Vec<Cell<D>>> {
    let share = (n / 2) as f64 / n as f64;
    let spreads = spreads(cells.iter(), [0.5 * share, share, 0.5 * (1.0 + share)]);
    if !is_thin(&cells, &spreads) {
        return Err(cells);
    }
    let is_wider = |k: usize, best: usize| spreads[k].apart > spreads[best].apart * (1.0 + EVEN);
    let axis = (0..D).fold(0, |best, k| if is_wider(k, best) { k } else { best });
    let plane = plane_across(axis, &cells, share, spreads[axis].about);
    Ok(cut_at(axis, plane, cells))
}

/// Whether the density changes so much within a part that the centers of its cells do not show where its mass is: in one that is a sheet. In a
/// cell of edge L along a slope g of ln n the mass is L^2 g / 12 from the center; the cells of a part of size s have an edge of s/3, so that with
/// g s = 3 this is a fortieth of its size, a fourth of the jitter.
pub(crate) fn is_sheet<const D: usize>(target: &dyn Matter<D>, cells: &[Cell<D>]) -> bool {
    falls_by(FALL, target, cells) && is_thin(cells, &spreads(cells.iter(), QUARTERS))
}

/// Whether the logarithm of the density differs by more than `fall` between the cells of a part; never where the target may jump: between cells that
/// have a jump and others there is no slope.
fn falls_by<const D: usize>(fall: f64, target: &dyn Matter<D>, cells: &[Cell<D>]) -> bool {
    // What a surface cuts off is no slope; where it is takes longer to find.
    let is_whole =
        |cell: &&Cell<D>| !(cell.is_crossed_by_lines() || cell.is_pencil || cell.is_cut_by_region(target.domain()));
    !target.may_jump() && differ_by(fall, cells.iter()) && differ_by(fall, cells.iter().filter(is_whole))
}

/// Whether the logarithms of the densities of cells differ by more than `fall`.
fn differ_by<'a, const D: usize>(fall: f64, cells: impl Iterator<Item = &'a Cell<D>>) -> bool {
    let (mut least, mut most) = (f64::INFINITY, 0.0);
    for cell in cells {
        let density = cell.mass / cell.volume();
        least = if density < least { density } else { least };
        most = if density > most { density } else { most };
    }
    most > least && (most / least).ln() > fall
}

/// Logarithm of the ratio of the densities of a part's cells from which on it is steep.
const FALL: f64 = 3.0;

/// Whether the particles of a part are a sheet along some axis: the middles of halves are less far apart than in what has one particle across it. A
/// sheet is all that is there: of what has others about it, halves of the whole say nothing.
fn is_thin<const D: usize>(cells: &[Cell<D>], spreads: &[Spread; D]) -> bool {
    let densest = cells.iter().fold(f64::INFINITY, |least, cell| least.min(cell.volume() / cell.mass));
    let thinnest = (0..D).fold(0, |best, k| if spreads[k].apart < spreads[best].apart { k } else { best });
    let apart = spreads[thinnest].apart;
    apart < THIN * densest.powf(1.0 / D as f64)
        && self::spreads(cells.iter(), [TAIL, 0.5, 1.0 - TAIL])[thinnest].apart < LONG * apart
}

/// Where the middles of halves are, and where these meet.
const QUARTERS: [f64; 3] = [0.25, 0.5, 0.75];

/// Equal but for the digits to which fields are known is equal.
const EVEN: f64 = 1e-6;

/// What is uniform and has one particle across it is a spacing thick, and the middles of its sides are half of that apart.
const THIN: f64 = 0.5;
/// Nine tenths of the mass are within 2.7 times what a half is within in an exponential layer and in one of sech^2, and 2.4 in a Gaussian one.
const TAIL: f64 = 0.05;
const LONG: f64 = 4.0;

/// How mass is spread along an axis.
#[derive(Clone, Copy)]
struct Spread {
    /// How far the middles of two sides are apart: half the width of what is uniform.
    apart: f64,
    /// Where the sides meet.
    about: About,
}

/// Along each axis, by where three shares of the mass end, in their order: the outer ones are apart, the middle one is where sides meet.
fn spreads<'a, const D: usize>(cells: impl Iterator<Item = &'a Cell<D>> + Clone, shares: [f64; 3]) -> [Spread; D] {
    // About any of them, so that places that are large lose no digits.
    let origin = cells.clone().next().map_or([0.0; D], Cell::center);
    let (mut total, mut moment, mut square) = (0.0, [0.0; D], [0.0; D]);
    for cell in cells.clone() {
        total += cell.mass;
        let center = cell.center();
        for k in 0..D {
            let (place, edge) = (center[k] - origin[k], cell.hi[k] - cell.lo[k]);
            moment[k] += cell.mass * place;
            square[k] += cell.mass * (place * place + edge * edge / 12.0);
        }
    }
    std::array::from_fn(|k| {
        let mean = moment[k] / total;
        let width = (12.0 * (square[k] / total - mean * mean)).max(0.0).sqrt();
        let range = [origin[k] + mean - width, origin[k] + mean + width];
        spread(cells.clone(), k, range, shares.map(|share| share * total))
    })
}

/// Along one axis, by ever finer bins about the middles of the sides: what a few particles far off say of the width of all is little.
fn spread<'a, const D: usize>(
    cells: impl Iterator<Item = &'a Cell<D>> + Clone,
    k: usize,
    mut range: [f64; 2],
    masses: [f64; 3],
) -> Spread {
    let mut finer = 0;
    loop {
        let mut bins = Bins::new(range);
        cells.clone().for_each(|cell| bins.add(cell.lo[k], cell.hi[k], cell.mass));
        let [left, middle, right] = bins.places_of(masses);
        if right - left >= FINE * bins.step || finer == FINER {
            return Spread { apart: right - left, about: About { place: middle, bin: bins.step } };
        }
        finer += 1;
        range = [left - bins.step, right + bins.step];
    }
}

/// Bins, how many of them are between the middles of two sides at least, and how often they are made finer for that.
const BINS: usize = 48;
const FINE: f64 = 4.0;
const FINER: usize = 8;

/// Mass in bins along an axis, with that of a cell all along it: of few particles cells are longer than bins.
struct Bins {
    start: f64,
    step: f64,
    per_length: f64,
    /// What is before them, and in each.
    before: f64,
    masses: [f64; BINS + 1],
    /// By how much more is in a bin than in the one before it of what goes through all of it.
    through: [f64; BINS + 1],
}

impl Bins {
    fn new([start, end]: [f64; 2]) -> Self {
        let step = (end - start) / BINS as f64;
        Self { start, step, per_length: step.recip(), before: 0.0, masses: [0.0; BINS + 1], through: [0.0; BINS + 1] }
    }

    fn add(&mut self, lo: f64, hi: f64, mass: f64) {
        let (from, to) = ((lo - self.start) * self.per_length, (hi - self.start) * self.per_length);
        let rate = mass / (to - from);
        let (first, last) = (from.clamp(0.0, BINS as f64), to.clamp(0.0, BINS as f64));
        if from < 0.0 {
            self.before += rate * (to.min(0.0) - from);
        }
        let (i, j) = (first as usize, last as usize);
        if i == j {
            self.masses[i] += rate * (last - first);
            return;
        }
        self.masses[i] += rate * ((i + 1) as f64 - first);
        self.masses[j] += rate * (last - j as f64);
        self.through[i + 1] += rate;
        self.through[j] -= rate;
    }

    /// Where so much mass ends, for masses that ascend.
    fn places_of(&self, masses: [f64; 3]) -> [f64; 3] {
        let (mut before, mut through, mut i) = (self.before, self.through[0], 0);
        masses.map(|mass| {
            while i < BINS && before + self.masses[i] + through < mass {
                before += self.masses[i] + through;
                i += 1;
                through += self.through[i];
            }
            let bin = self.masses[i] + through;
            let part = if bin > 0.0 { ((mass - before) / bin).clamp(0.0, 1.0) } else { 0.0 };
            self.start + self.step * (i as f64 + part)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, keyed};
    use rand::RngExt;

    fn cell(lo: [f64; 2], hi: [f64; 2], mass: f64) -> Cell<2> {
        Cell { mass, ..Cell::new(lo, hi) }
    }

    /// Bins hold the mass of cells as it is spread along them: places between them are off by what is uneven within a bin.
    #[test]
    fn bins_say_where_shares_of_the_mass_end() {
        let mut rng = keyed(1, Purpose::SeedJitter, 0);
        let mut random = || rng.random::<f64>();
        let cells: Vec<Cell<2>> = (0..200)
            .map(|_| {
                let (lo, edge) = (random(), 0.3 * random());
                cell([lo, 0.0], [lo + edge, 1.0], random())
            })
            .collect();
        let total: f64 = cells.iter().map(|c| c.mass).sum();
        let mut bins = Bins::new([0.3, 0.9]);
        cells.iter().for_each(|c| bins.add(c.lo[0], c.hi[0], c.mass));
        for place in bins.places_of([0.35, 0.5, 0.65].map(|share| share * total)).iter().zip([0.35, 0.5, 0.65]) {
            let exact = plane_across(0, &cells, place.1, About { place: *place.0, bin: 0.0 });
            assert!((place.0 - exact).abs() < 0.1 * bins.step, "{} is at {exact}, not at {}", place.1, place.0);
        }
    }

    fn layers(edges: &[f64], density: impl Fn(f64) -> f64) -> Vec<Cell<2>> {
        let rows = edges.windows(2).flat_map(|z| (0..4).map(move |i| (f64::from(i), z[0], z[1])));
        rows.map(|(x, low, high)| cell([x, low], [x + 1.0, high], (high - low) * density(0.5 * (low + high)))).collect()
    }

    fn is_one(cells: &[Cell<2>]) -> bool {
        is_thin(cells, &spreads(cells.iter(), QUARTERS))
    }

    /// Two columns of an exponential layer that is far thinner than they are wide, whose tail reaches farther than that.
    #[test]
    fn a_sheet_is_cut_into_columns_whatever_its_tail() {
        let edges: Vec<f64> = (0..=400).map(|i| 0.05 * f64::from(i)).collect();
        let cells = layers(&edges, |z| 2.0 * (-z / 0.25).exp());
        assert!(is_one(&cells));
        let half: f64 = 0.5 * cells.iter().map(|c| c.mass).sum::<f64>();
        let Ok(Cut { axis, left, .. }) = cut_thin(cells, 2) else { panic!("no sheet") };
        let mass: f64 = left.iter().map(|c| c.mass).sum();
        assert!(axis == 0 && (mass / half - 1.0).abs() < 1e-9, "{axis} {mass}");
    }

    /// Neither a thick layer nor a thin one in the middle of as much that is about it.
    #[test]
    fn what_is_thick_or_has_others_about_it_is_no_sheet() {
        let edges: Vec<f64> = (0..=400).map(|i| 0.05 * f64::from(i)).collect();
        assert!(!is_one(&layers(&edges, |_| 1.0)));
        let within = |z: f64| if (10.0..10.1).contains(&z) { 2.5 } else { 0.0125 };
        assert!(!is_one(&layers(&edges, within)));
        assert!(cut_thin(layers(&edges, within), 2).is_err());
    }
}
