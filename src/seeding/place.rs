//! Computes positions from a target and a method.

use super::glass::{self, Repulsion};
use super::lattice::Lattice;
use super::methods::{self, Method};
use super::name::Seeding;
use super::quaquaversal::Quaquaversal;
use super::seeded::Seeded;
use super::shells::{Covering, Shells};
use super::symmetry::{self, Symmetry};
use super::{bisection, low_discrepancy, pattern, random, stretch};
use crate::error::{Error, Result};
use crate::target::{Regions, Selected, Target, at};
use sph::domain::Axis;
use sph::parallel;

/// Places `target.count` particles; `seed` is that of the random numbers.
///
/// # Errors
/// A target without mass in its domain, a dimension or a target that the method is not made for.
pub fn seed<const D: usize>(target: &Target<'_, D>, seeding: Seeding, seed: u64) -> Result<Seeded<D>> {
    let method = seeding.method();
    method.check_dimension(D)?;
    match target.regions().filter(|_| seeding.goes_by_region()) {
        Some(regions) => by_region(target, regions, seeding, seed),
        None => check(target, method, in_one(target, seeding, seed)?),
    }
}

/// Seeds each region by itself, the whole number of particles that is due to it; refused where the method can map to none of them.
fn by_region<const D: usize>(
    target: &Target<'_, D>,
    regions: &Regions<'_, D>,
    seeding: Seeding,
    seed: u64,
) -> Result<Seeded<D>> {
    let mut all = Seeded { positions: std::array::from_fn(|_| Vec::with_capacity(target.count)), notes: Vec::new() };
    let (mut is_any_mapped, mut refused) = (false, None);
    for (region, count) in regions.counts(target.count).into_iter().enumerate().filter(|(_, count)| *count > 0) {
        let target = target.selected(regions, Selected::Region(region), count);
        let mapped = in_one(&target, seeding, seed).and_then(|seeded| check(&target, seeding.method(), seeded));
        // A region need not have the symmetry of the whole, nor be where samples are.
        let Seeded { positions, notes } = match mapped {
            Ok(seeded) => {
                is_any_mapped = true;
                seeded
            }
            Err(why) => {
                refused.get_or_insert(why);
                let mut seeded = in_one(&target, Seeding::MassBisection, seed)?;
                let title = seeding.method().name;
                seeded.notes.push(format!(
                    "region {}: its {count} particles are placed by mass bisection, as '{title}' cannot map to it",
                    region + 1
                ));
                check(&target, Seeding::MassBisection.method(), seeded)?
            }
        };
        all.positions.iter_mut().zip(positions).for_each(|(all, one)| all.extend(one));
        all.notes.extend(notes);
    }
    match refused {
        Some(why) if !is_any_mapped => Err(why),
        _ => Ok(all),
    }
}

/// Places the particles of a target that is one body.
fn in_one<const D: usize>(target: &Target<'_, D>, seeding: Seeding, seed: u64) -> Result<Seeded<D>> {
    let method = seeding.method();
    let lattice = |kind: Lattice| {
        let symmetry = symmetry::detect(target, method.name)?;
        stretch::place_lattice(target, &symmetry, kind)
    };
    let a_glass = |repulsion| glass::place(target, &symmetry::detect(target, method.name)?, repulsion, seed);
    let on_shells = |covering: Covering| Ok::<_, Error>(Shells::new(target, covering, method, seed)?.seeded());
    Ok(match seeding {
        Seeding::MassBisection => bisection::place(target, seed)?.into(),
        Seeding::Random => random::place(target, seed)?.into(),
        Seeding::LowDiscrepancy => low_discrepancy::place(target)?.into(),
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
            stretch::place_lattice(target, &Symmetry::Uniform, Lattice::Cubic)?
        }
        Seeding::Cubic => lattice(Lattice::Cubic)?,
        Seeding::CubicClosePacked => lattice(Lattice::CubicClosePacked)?,
        Seeding::HexagonalClosePacked => lattice(Lattice::HexagonalClosePacked)?,
        Seeding::BodyCenteredCubic => lattice(Lattice::BodyCenteredCubic)?,
    })
}

/// Refuses a resolution that varies, which a lattice of one spacing cannot follow.
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

/// Refuses positions where the target is zero: a mapped pattern may meet a hole that sampling did not show.
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
