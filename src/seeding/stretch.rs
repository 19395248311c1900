//! Stretching: a uniform pattern is mapped to the target by mass coordinates.
//!
//! A point keeps the fraction of the mass that lies before it: along each axis of a box where the target is a
//! product of functions of the coordinates (ALARIC eq. 27), along the radius of a ball where it is a function of
//! that (ALARIC eq. 26; Herant 1994; Rosswog et al. 2009; Diehl et al. 2015, sec. 3.2.2), along radius and axis of a
//! cylinder where it is a product of functions of both, by Newton's method on the enclosed mass. Densities come out
//! right to the order of the pattern; the pattern itself is sheared, which in
//! two and three dimensions makes its spacings uneven where the stretch varies much.

use super::cumulative::Cumulative;
use super::lattice::{Fit, Lattice, UnitCell};
use super::pattern::{self, Pattern};
use super::seeded::{Seeded, to_positions};
use super::sublattice::Sublattice;
use super::symmetry::{self, Symmetry};
use crate::error::Result;
use crate::target::Target;
use sph::domain::{Axis, Round};
use sph::geometry::distance;
use sph::parallel;

/// Fills the domain with a pattern and maps it to the target.
pub(super) fn place<const D: usize>(
    target: &Target<'_, D>,
    symmetry: &Symmetry<D>,
    pattern: &dyn Pattern<D>,
) -> Result<Seeded<D>> {
    let points = pattern::cut(target, pattern)?;
    Ok(Seeded { positions: to_positions(&map(target, symmetry, points)), notes: Vec::new() })
}

/// The same for a lattice, which in a box is fitted to it rather than cut.
pub(super) fn place_lattice<const D: usize>(
    target: &Target<'_, D>,
    symmetry: &Symmetry<D>,
    lattice: Lattice,
) -> Result<Seeded<D>> {
    let cell = lattice.cell::<D>();
    let (domain, count) = (target.domain, target.count);
    if !symmetry::fills_box(domain) {
        let mut seeded = place(target, symmetry, &cell)?;
        if domain.axes.contains(&Axis::Periodic) {
            seeded.notes.push("the lattice is cut to the region: at its periodic ends there is a seam".into());
        }
        return Ok(seeded);
    }
    let extent = domain.extent();
    let fit = cell.fit(&extent, count);
    let periodic = domain.axes.iter().all(|axis| *axis == Axis::Periodic);
    let upright = fit.is_exact(cell.sites.len(), count);
    let (points, notes) = if periodic && !(upright && fit.distortion.ln() <= SLIGHT) {
        let (askew, note) = askew(lattice, &extent, count);
        match askew {
            Some(askew) if !(upright && fit.distortion.ln() <= askew.strain) => {
                let edge = |f: f64, k: usize| domain.lo[k] + extent[k] * f;
                let fractions = askew.fractions();
                let note = note.into_iter().chain(strain_note(count, askew.strain)).collect();
                (parallel::map(count, |i| sph::array(|k| edge(fractions[i][k], k))), note)
            }
            _ => upright_points(&cell, target, &extent, &fit),
        }
    } else {
        upright_points(&cell, target, &extent, &fit)
    };
    Ok(Seeded { positions: to_positions(&map(target, symmetry, points)), notes })
}

/// A lattice whose axes are those of the box is kept if it is distorted by no more.
const SLIGHT: f64 = 0.01;

fn upright_points<const D: usize>(
    cell: &UnitCell<D>,
    target: &Target<'_, D>,
    extent: &[f64; D],
    fit: &Fit<D>,
) -> (Vec<[f64; D]>, Vec<String>) {
    let (lo, count, per_cell) = (&target.domain.lo, target.count, cell.sites.len());
    let exact = fit.is_exact(per_cell, count);
    let points = if exact { cell.fill(lo, extent, fit, count) } else { cell.columns(lo, extent, fit, count) };
    (points, fit.note(per_cell, count).into_iter().collect())
}

/// The lattice of exactly `count` points in a periodic box, and what is different about it.
fn askew<const D: usize>(lattice: Lattice, extent: &[f64; D], count: usize) -> (Option<Sublattice<D>>, Option<String>) {
    let wanted = lattice.bravais().fit(extent, count);
    if wanted.is_some() || count == 0 {
        return (wanted, None);
    }
    let note = format!(
        "hexagonal close packing has two points per cell, and {count} is odd: the layers are stacked ABCABC (cubic close packing)"
    );
    (Lattice::CubicClosePacked.bravais().fit(extent, count), Some(note))
}

fn strain_note(count: usize, strain: f64) -> Option<String> {
    /// What rounding leaves of none.
    const ROUNDING: f64 = 1e-9;
    let percent = 100.0 * strain.exp_m1();
    (strain > ROUNDING).then(|| {
        format!(
            "the lattice is turned and strained by {percent:.2} %, so that exactly {count} points fit the periodic box"
        )
    })
}

/// Moves points of uniform density to the target.
pub(super) fn map<const D: usize>(
    target: &Target<'_, D>,
    symmetry: &Symmetry<D>,
    mut points: Vec<[f64; D]>,
) -> Vec<[f64; D]> {
    let map = MassMap::with(target, symmetry);
    parallel::update(&mut points, |_, x| *x = map.apply(*x));
    points
}

/// The map from points of uniform density in a domain to a target there.
pub struct MassMap<'a, const D: usize>(Kind<'a, D>);

enum Kind<'a, const D: usize> {
    Same,
    Axes(Vec<Line<'a>>),
    Tubes { round: Round<D>, axis: usize, across: Line<'a>, along: Line<'a> },
    Shells { center: [f64; D], radius: Line<'a> },
}

impl<'a, const D: usize> MassMap<'a, D> {
    /// The map that the symmetry of the target allows.
    ///
    /// # Errors
    /// A target without a symmetry by which a uniform pattern can be mapped to it; `what` asks for it.
    pub fn new(target: &'a Target<'_, D>, what: &str) -> Result<Self> {
        Ok(Self::with(target, &symmetry::detect(target, what)?))
    }

    fn with(target: &'a Target<'_, D>, symmetry: &Symmetry<D>) -> Self {
        let domain = target.domain;
        Self(match symmetry.clone() {
            Symmetry::Uniform => Kind::Same,
            Symmetry::Separable { through } => {
                let line = |k: usize| {
                    let mass = move |x| symmetry::along(target, &through, k, x);
                    Line::along(domain.lo[k], domain.hi[k], mass)
                };
                Kind::Axes((0..D).map(line).collect())
            }
            Symmetry::Cylindrical { round, axis, through } => {
                let (middle, height) = (round.distance(&through), through[axis]);
                let tube = move |r: f64| r * symmetry::ring_mean(target, &round, r, height);
                let layer = move |z: f64| symmetry::ring_mean(target, &round, middle, z);
                Kind::Tubes {
                    across: Line::outwards(2, round.inner_radius, round.radius, tube),
                    along: Line::along(domain.lo[axis], domain.hi[axis], layer),
                    round,
                    axis,
                }
            }
            Symmetry::Radial { center, inner, outer } => {
                let shell = move |r: f64| r.powi(D as i32 - 1) * symmetry::spherical_mean(target, &center, r);
                Kind::Shells { center, radius: Line::outwards(D, inner, outer, shell) }
            }
        })
    }

    /// The same from tables, for many points: each takes nanoseconds, and differs by less than 2^-16 of the domain's size from
    /// where it belongs, even at a jump.
    pub fn tabulated(&self) -> MassMap<'static, D> {
        MassMap(match &self.0 {
            Kind::Same => Kind::Same,
            Kind::Axes(lines) => Kind::Axes(lines.iter().map(Line::tabulated).collect()),
            Kind::Tubes { round, axis, across, along } => {
                Kind::Tubes { round: *round, axis: *axis, across: across.tabulated(), along: along.tabulated() }
            }
            Kind::Shells { center, radius } => Kind::Shells { center: *center, radius: radius.tabulated() },
        })
    }

    /// Where a point of uniform density goes.
    pub fn apply(&self, mut x: [f64; D]) -> [f64; D] {
        match &self.0 {
            Kind::Same => {}
            Kind::Axes(lines) => lines.iter().enumerate().for_each(|(k, line)| x[k] = line.at(x[k])),
            Kind::Tubes { round, axis, across, along } => {
                x[*axis] = along.at(x[*axis]);
                let r = round.distance(&x);
                if r > 0.0 {
                    x = round.scaled(&x, across.at(r) / r);
                }
            }
            Kind::Shells { center, radius } => {
                let r = distance(center, &x);
                if r > 0.0 {
                    let factor = radius.at(r) / r;
                    x = sph::array(|k| center[k] + (x[k] - center[k]) * factor);
                }
            }
        }
        x
    }
}

/// A map of one coordinate.
enum Line<'a> {
    Exact { lo: f64, hi: f64, map: Box<dyn Fn(f64) -> f64 + Sync + 'a> },
    Table(Table),
}

impl<'a> Line<'a> {
    /// Along an axis: `density` is the mass per length.
    fn along(lo: f64, hi: f64, density: impl Fn(f64) -> f64 + Sync + 'a) -> Self {
        let mass = Cumulative::new(density, lo, hi);
        Self::Exact { lo, hi, map: Box::new(move |x| mass.inverse((x - lo) / (hi - lo)).clamp(lo, hi)) }
    }

    /// Outwards in `d` dimensions: `density` is the mass per length of radius.
    fn outwards(d: usize, inner: f64, outer: f64, density: impl Fn(f64) -> f64 + Sync + 'a) -> Self {
        let mass = Cumulative::new(density, inner, outer);
        let volume = move |r: f64| r.powi(d as i32) - inner.powi(d as i32);
        // Rounding must not carry a point beyond the surface.
        let largest = outer * (1.0 - 1e-12);
        let map = move |r: f64| mass.inverse(volume(r) / volume(outer)).min(largest);
        Self::Exact { lo: inner, hi: outer, map: Box::new(map) }
    }

    fn at(&self, x: f64) -> f64 {
        match self {
            Self::Exact { map, .. } => map(x),
            Self::Table(table) => table.at(x),
        }
    }

    fn tabulated(&self) -> Line<'static> {
        Line::Table(match self {
            Self::Exact { lo, hi, map } => Table::new(*lo, *hi, map),
            Self::Table(table) => table.clone(),
        })
    }
}

/// Intervals of a table: far finer than the spacing of any particles that a machine can hold.
const INTERVALS: usize = 1 << 16;

/// A map of one coordinate, between its values at equal steps.
#[derive(Clone)]
struct Table {
    lo: f64,
    step: f64,
    values: Vec<f64>,
}

impl Table {
    fn new(lo: f64, hi: f64, map: impl Fn(f64) -> f64 + Sync) -> Self {
        let step = (hi - lo) / INTERVALS as f64;
        let at = |i: usize| if i == INTERVALS { hi } else { lo + step * i as f64 };
        Self { lo, step, values: parallel::map(INTERVALS + 1, |i| map(at(i))) }
    }

    fn at(&self, x: f64) -> f64 {
        let t = ((x - self.lo) / self.step).clamp(0.0, INTERVALS as f64);
        let i = (t as usize).min(INTERVALS - 1);
        let (a, b) = (self.values[i], self.values[i + 1]);
        a + (t - i as f64) * (b - a)
    }
}
