//! Initial positions: exactly N of them, all where the target admits particles. [`METHODS`] lists the ways.

mod bisection;
mod cells;
mod cumulative;
mod glass;
mod gravity;
mod kronecker;
mod lattice;
mod low_discrepancy;
mod methods;
mod pattern;
mod quaquaversal;
mod random;
mod shells;
mod stretch;
mod symmetry;

pub use methods::{METHODS, Method, Targets};

use crate::error::{Error, Result};
use crate::random::{Purpose, keyed};
use crate::target::{Positions, Target, at};
use cells::Cell;
use glass::Repulsion;
use lattice::Lattice;
use quaquaversal::Quaquaversal;
use rand::RngExt;
use serde::{Deserialize, Serialize};
use shells::Covering;
use sph::domain::{Axis, Region};
use sph::kernel::support_over_spacing;
use sph::parallel;
use symmetry::Symmetry;

/// How the initial positions are made; [`METHODS`] tells what each can do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Seeding {
    /// Recursive bisection into equal masses, one particle per part: no long-wave error from the start.
    #[default]
    MassBisection,
    /// Independent random positions with probability proportional to the target.
    Random,
    /// Simple cubic (square) lattice.
    Cubic,
    /// Face-centered cubic (hexagonal) lattice.
    CubicClosePacked,
    /// Hexagonal close packing: layers in the order ABAB.
    HexagonalClosePacked,
    /// Points of a Kronecker sequence, carried over by mass: more even than random ones.
    LowDiscrepancy,
    /// Centroids of the tiles of an aperiodic tiling by prisms.
    Quaquaversal,
    /// Concentric shells with particles on a spiral (rings in two dimensions).
    Shells,
    /// Concentric shells with particles in regions of equal area.
    EqualAreaShells,
    /// Irregular but even: a relaxed periodic box, tiled.
    Glass,
    /// The same, relaxed by reversed gravity.
    GravitationalGlass,
    /// A simple cubic lattice of one spacing everywhere; its masses carry the density.
    VariableMasses,
}

impl Seeding {
    /// Whether neighbors are evenly spaced in what it makes.
    pub fn is_in_order(self) -> bool {
        !matches!(self, Self::MassBisection | Self::Random | Self::LowDiscrepancy | Self::Quaquaversal)
    }
}

/// The share of the domain that is within reach of a jump of the target with `neighbors` kernel neighbors.
pub fn jump_share<const D: usize>(target: &Target<'_, D>, neighbors: f64) -> f64 {
    symmetry::jump_share(target, support_over_spacing(D, neighbors))
}

/// Whether the target is a function of the radius alone in a three-dimensional ball or shell, so that concentric
/// shells can have its density.
pub fn is_radial<const D: usize>(target: &Target<'_, D>) -> bool {
    D == 3 && matches!(target.domain.region, Region::Ball { .. }) && symmetry::detect(target, "shells").is_ok()
}

/// A seed and what should be known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Seeded<const D: usize> {
    pub positions: Positions<D>,
    /// Decisions of the method, for the report.
    pub notes: Vec<String>,
}

impl<const D: usize> From<Positions<D>> for Seeded<D> {
    fn from(positions: Positions<D>) -> Self {
        Self { positions, notes: Vec::new() }
    }
}

/// Places `target.count` particles.
///
/// # Errors
/// A target without mass in its domain, a dimension or a target that the method is not made for.
pub fn seed<const D: usize>(target: &Target<'_, D>, seeding: Seeding, seed: u64) -> Result<Seeded<D>> {
    let method = seeding.method();
    method.check_dimension(D)?;
    let lattice = |kind: Lattice| {
        let symmetry = symmetry::detect(target, method.name)?;
        stretch::place_lattice(target, &symmetry, &kind.cell())
    };
    let a_glass = |repulsion| glass::place(target, &symmetry::detect(target, method.name)?, repulsion, seed);
    let on_shells = |covering: Covering| shells::place(target, covering, method, seed);
    let seeded = match seeding {
        Seeding::MassBisection => {
            let mut positions = bisection::place(target, massive_cells(target)?);
            jitter(target, &mut positions, seed);
            positions.into()
        }
        Seeding::Random => random::place(target, &massive_cells(target)?, seed).into(),
        Seeding::LowDiscrepancy => low_discrepancy::place(target, massive_cells(target)?).into(),
        Seeding::Quaquaversal => {
            let symmetry = symmetry::detect(target, method.name)?;
            let mut seeded = stretch::place(target, &symmetry, &Quaquaversal::covering(pattern::reach(target)))?;
            if target.domain.axes.contains(&Axis::Periodic) {
                seeded.notes.push("the quaquaversal tiling does not repeat: the periodic box has a seam".into());
            }
            seeded
        }
        Seeding::Shells => on_shells(Covering::Spiral)?,
        Seeding::EqualAreaShells => on_shells(Covering::EqualArea)?,
        Seeding::Glass => a_glass(Repulsion::Short)?,
        Seeding::GravitationalGlass => a_glass(Repulsion::Gravity)?,
        Seeding::VariableMasses => {
            check_evenness(target)?;
            stretch::place_lattice(target, &Symmetry::Uniform, &Lattice::Cubic.cell())?
        }
        Seeding::Cubic => lattice(Lattice::Cubic)?,
        Seeding::CubicClosePacked => lattice(Lattice::CubicClosePacked)?,
        Seeding::HexagonalClosePacked => lattice(Lattice::HexagonalClosePacked)?,
    };
    check(target, method, seeded)
}

/// Whether a lattice of one spacing is what is wanted: the resolution uniform, and mass everywhere.
fn check_evenness<const D: usize>(target: &Target<'_, D>) -> Result<()> {
    let name = Seeding::VariableMasses.method().name;
    if !matches!(symmetry::detect(target, name), Ok(Symmetry::Uniform)) {
        let problem = format!(
            "'{name}' has one spacing everywhere, but the resolution varies; leave it out, or use {}",
            methods::for_any_target(name)
        );
        return Err(Error::scene("seeding", problem));
    }
    Ok(())
}

/// The target as cells of known mass.
fn massive_cells<const D: usize>(target: &Target<'_, D>) -> Result<Vec<Cell<D>>> {
    let cells = cells::partition(target);
    if cells.iter().map(|c| c.mass).sum::<f64>() > 0.0 {
        return Ok(cells);
    }
    Err(Error::Numeric { stage: "seed", problem: "the target is zero everywhere in the domain".into() })
}

/// A pattern that was mapped may meet a hole that sampling did not show; that is told, not passed on.
fn check<const D: usize>(target: &Target<'_, D>, method: &Method, seeded: Seeded<D>) -> Result<Seeded<D>> {
    let n = seeded.positions[0].len();
    // The resolution may ask for particles where there is no matter for their masses.
    let empty = |x: &[f64; D]| !target.has_equal_masses() && !(target.density.value(x) > 0.0);
    let misplaced = |x: [f64; D]| !target.admits(&x) || method.seeding == Seeding::VariableMasses && empty(&x);
    let outside = parallel::count(n, |i| misplaced(at(&seeded.positions, i)));
    if n == target.count && outside == 0 {
        return Ok(seeded);
    }
    Err(Error::Numeric {
        stage: "seed",
        problem: format!(
            "'{}' made {n} positions, {outside} of them where the target is zero, instead of {} inside it; use {}",
            method.name,
            target.count,
            methods::for_any_target(method.name),
        ),
    })
}

fn to_positions<const D: usize>(points: &[[f64; D]]) -> Positions<D> {
    std::array::from_fn(|k| points.iter().map(|x| x[k]).collect())
}

/// Jitter as a fraction of the local spacing. Bisection of a symmetric target gives a lattice, an unstable
/// equilibrium that relaxation leaves late and unevenly; a tenth of the spacing is enough to leave it at once.
const JITTER: f64 = 0.1;

fn jitter<const D: usize>(target: &Target<'_, D>, positions: &mut Positions<D>, seed: u64) {
    let moved = parallel::map(positions[0].len(), |i| {
        let x = at(positions, i);
        let spacing = target.spacing(target.number_density(&x));
        let mut rng = keyed(seed, Purpose::SeedJitter, i as u64);
        let mut y = x.map(|v| v + JITTER * spacing * (2.0 * rng.random::<f64>() - 1.0));
        target.domain.wrap(&mut y);
        if target.admits(&y) { y } else { x }
    });
    *positions = to_positions(&moved);
}
