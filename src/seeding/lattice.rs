//! Lattices: cubic, body-centered cubic, cubic close packed and hexagonal close packed, fitted to a box.
//!
//! All are repetitions of one rectangular cell. In a box the numbers of cells along the axes are chosen so that
//! whole cells fill it; the cells are stretched along the axes by what is left over. Where no such arrangement has exactly N
//! sites, a periodic box holds the lattice askew ([`super::sublattice`]). Between walls its planes stay parallel to them, and the
//! sites in columns along one axis, some columns with one site less than others, evenly spaced. In two dimensions all but the
//! cubic one are the hexagonal lattice, in one all are equidistant points.

use super::kronecker;
use super::pattern::{Pattern, tile};
use super::sublattice::Bravais;

/// The kinds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Lattice {
    Cubic,
    BodyCenteredCubic,
    CubicClosePacked,
    HexagonalClosePacked,
}

/// A rectangular cell of number density 1 and the sites in it.
#[derive(Debug, Clone)]
pub(super) struct UnitCell<const D: usize> {
    pub edges: [f64; D],
    /// As fractions of the edges, in [0, 1).
    pub sites: Vec<[f64; D]>,
}

impl Lattice {
    /// The same as what a periodic box can hold.
    pub fn bravais(self) -> Bravais {
        match self {
            Self::Cubic => Bravais::Cubic,
            Self::BodyCenteredCubic => Bravais::BodyCentered,
            Self::CubicClosePacked => Bravais::FaceCentered,
            Self::HexagonalClosePacked => Bravais::ClosePackedLayers,
        }
    }

    /// The cell, in units of the mean spacing.
    pub fn cell<const D: usize>(self) -> UnitCell<D> {
        let (edges, sites): ([f64; 3], &[[f64; 3]]) = match (self, D) {
            (Self::Cubic, _) | (_, 1) => ([1.0; 3], &CUBIC),
            (_, 2) => ([1.0, 3.0_f64.sqrt(), 1.0], &HEXAGONAL),
            (Self::BodyCenteredCubic, _) => ([1.0; 3], &BODY_CENTERED),
            (Self::CubicClosePacked, _) => ([1.0; 3], &FACE_CENTERED),
            // Layers of touching spheres of diameter 1 lie sqrt(2/3) apart.
            (Self::HexagonalClosePacked, _) => ([1.0, 3.0_f64.sqrt(), (8.0 / 3.0_f64).sqrt()], &LAYERED),
        };
        let volume: f64 = edges[..D].iter().product();
        let scale = (sites.len() as f64 / volume).powf(1.0 / D as f64);
        UnitCell {
            edges: sph::array(|k| edges[k] * scale),
            sites: sites.iter().map(|s| sph::array(|k| s[k])).collect(),
        }
    }
}

/// Sites lie symmetric about the cell's middle, so that none falls on a face of the box.
const CUBIC: [[f64; 3]; 1] = [[0.5, 0.5, 0.5]];
const HEXAGONAL: [[f64; 3]; 2] = [[0.25, 0.25, 0.5], [0.75, 0.75, 0.5]];
const BODY_CENTERED: [[f64; 3]; 2] = [[0.25, 0.25, 0.25], [0.75, 0.75, 0.75]];
const FACE_CENTERED: [[f64; 3]; 4] = [[0.25, 0.25, 0.25], [0.75, 0.75, 0.25], [0.75, 0.25, 0.75], [0.25, 0.75, 0.75]];
const LAYERED: [[f64; 3]; 4] =
    [[0.25, 1.0 / 6.0, 0.25], [0.75, 2.0 / 3.0, 0.25], [0.75, 1.0 / 3.0, 0.75], [0.25, 5.0 / 6.0, 0.75]];

impl<const D: usize> Pattern<D> for UnitCell<D> {
    fn visit(&self, lo: &[f64; D], hi: &[f64; D], out: &mut dyn FnMut([f64; D])) {
        tile(&self.edges, &self.sites, lo, hi, out);
    }
}

/// Whole cells along each axis of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fit<const D: usize> {
    pub cells: [usize; D],
    /// Longest over shortest stretch of the cell along the axes.
    pub distortion: f64,
    /// Along which sites in excess are taken out of columns.
    pub free: usize,
}

impl<const D: usize> Fit<D> {
    fn sites(&self, per_cell: usize) -> usize {
        per_cell * self.cells.iter().product::<usize>()
    }

    /// Whether it has `count` sites.
    pub fn is_exact(&self, per_cell: usize, count: usize) -> bool {
        self.sites(per_cell) == count
    }

    /// What a user should know of a lattice that is not perfect.
    pub fn note(&self, per_cell: usize, count: usize) -> Option<String> {
        let sites = self.sites(per_cell);
        let cells = self.cells.map(|c| c.to_string()).join(" x ");
        let mut parts = Vec::new();
        if sites > count {
            let axis = ["x", "y", "z"][self.free];
            parts.push(format!(
                "its {} columns along {axis} hold {} sites less in all, evenly spaced in each",
                sites / self.cells[self.free],
                sites - count
            ));
        }
        if self.distortion > WORTH_A_NOTE {
            parts.push(format!("its cells are distorted by a factor of {:.3} to fit the box", self.distortion));
        }
        (!parts.is_empty()).then(|| format!("the lattice has {cells} cells; {}", parts.join("; ")))
    }
}

/// Distortions below are what any fit to a box needs.
const WORTH_A_NOTE: f64 = 1.02;
/// What sites in excess cost, as a fraction of all, in units of the logarithm of the distortion. A distorted lattice is
/// still one, with neither noise nor error, while a missing site disturbs the dozens of particles around it.
const VACANCY_COST: f64 = 20.0;
/// Numbers of cells along an axis that are tried on either side of the ideal one.
const MOST_TRIED: usize = 1000;

impl<const D: usize> UnitCell<D> {
    /// The numbers of cells that hold at least `count` sites with the least distortion and excess.
    pub fn fit(&self, extent: &[f64; D], count: usize) -> Fit<D> {
        let spacing = (extent.iter().product::<f64>() / count as f64).powf(1.0 / D as f64);
        let ideal: [f64; D] = sph::array(|k| extent[k] / (spacing * self.edges[k]));
        // The axis with the most cells has the finest choice and takes what the others leave.
        let free = (0..D).fold(0, |best, k| if ideal[k] > ideal[best] { k } else { best });
        let mut best: Option<(f64, Fit<D>)> = None;
        let mut cells = ideal.map(|c| tried(c).0);
        loop {
            let others: usize = (0..D).filter(|&k| k != free).map(|k| cells[k]).product();
            cells[free] = count.div_ceil(self.sites.len() * others).max(1);
            let stretch = (0..D).map(|k| ideal[k] / cells[k] as f64);
            let (least, most) = stretch.fold((f64::INFINITY, 0.0_f64), |(a, b), s| (a.min(s), b.max(s)));
            let sites = (self.sites.len() * others * cells[free]) as f64;
            let cost = (most / least).ln() + VACANCY_COST * (1.0 - count as f64 / sites);
            if best.as_ref().is_none_or(|(c, _)| cost < *c) {
                best = Some((cost, Fit { cells, distortion: most / least, free }));
            }
            if !advance(&mut cells, &ideal, free) {
                break;
            }
        }
        best.map_or(Fit { cells, distortion: 1.0, free }, |(_, fit)| fit)
    }

    /// `count` sites of the fitted lattice in the box from `lo`, at most as many as it has: columns along the free axis have them
    /// evenly spaced, the same number or one less in each.
    pub fn columns(&self, lo: &[f64; D], extent: &[f64; D], fit: &Fit<D>, count: usize) -> Vec<[f64; D]> {
        let (free, per_cell) = (fit.free, self.sites.len());
        let columns = per_cell * fit.cells.iter().product::<usize>() / fit.cells[free];
        // Sites that the first `c` columns have together.
        let before = |c: usize| (c as u128 * count as u128 / columns as u128) as usize;
        let mut points = Vec::with_capacity(count);
        for column in 0..columns {
            let site = self.sites[column % per_cell];
            let mut rest = column / per_cell;
            let foot: [usize; D] = sph::array(|k| {
                let cells = if k == free { 1 } else { fit.cells[k] };
                let index = rest % cells;
                rest /= cells;
                index
            });
            let held = before(column + 1) - before(column);
            points.extend((0..held).map(|i| -> [f64; D] {
                sph::array(|k| {
                    let (index, cells) = if k == free { (i, held) } else { (foot[k], fit.cells[k]) };
                    lo[k] + extent[k] * (index as f64 + site[k]) / cells as f64
                })
            }));
        }
        points
    }

    /// `count` sites of the fitted lattice in the box from `lo`; sites in excess are left out, evenly spread.
    pub fn fill(&self, lo: &[f64; D], extent: &[f64; D], fit: &Fit<D>, count: usize) -> Vec<[f64; D]> {
        let per_cell = self.sites.len();
        let total = per_cell * fit.cells.iter().product::<usize>();
        let empty = self.vacancies(fit, total, total.saturating_sub(count));
        let mut points = Vec::with_capacity(count);
        for i in (0..total).filter(|&i| !empty.get(i).copied().unwrap_or(false)) {
            let site = self.sites[i % per_cell];
            let mut rest = i / per_cell;
            points.push(sph::array(|k| {
                let index = rest % fit.cells[k];
                rest /= fit.cells[k];
                lo[k] + extent[k] * (index as f64 + site[k]) / fit.cells[k] as f64
            }));
        }
        points
    }

    /// Marks `excess` sites near the points of an evenly spread sequence.
    fn vacancies(&self, fit: &Fit<D>, total: usize, excess: usize) -> Vec<bool> {
        if excess == 0 {
            return Vec::new();
        }
        let mut empty = vec![false; total];
        let generator = kronecker::generator::<D>();
        for j in 0..excess {
            let x = kronecker::point(&generator, j);
            let cell = (0..D).rev().fold(0, |index, k| {
                index * fit.cells[k] + ((x[k] * fit.cells[k] as f64) as usize).min(fit.cells[k] - 1)
            });
            let mut site = cell * self.sites.len() + j % self.sites.len();
            while empty[site] {
                site = (site + 1) % total;
            }
            empty[site] = true;
        }
        empty
    }
}

/// First and last number of cells that is tried along an axis.
fn tried(ideal: f64) -> (usize, usize) {
    let reach = (0.6 * ideal).min(MOST_TRIED as f64);
    (((ideal - reach) as usize).max(1), (ideal + reach).ceil() as usize)
}

/// Counts through the combinations of the axes but `free`; false after the last.
fn advance<const D: usize>(cells: &mut [usize; D], ideal: &[f64; D], free: usize) -> bool {
    for k in (0..D).filter(|&k| k != free) {
        let (first, last) = tried(ideal[k]);
        if cells[k] < last {
            cells[k] += 1;
            return true;
        }
        cells[k] = first;
    }
    false
}
