//! Evolves the placed particles in time with the velocities that they were given, if a scene asks for it (`certify`) and nothing is settled
//! before.

use super::assembly::{cross, row};
use super::plan::Held;
use super::stages::Setting;
use crate::error::{Error, Result};
use crate::input::hydrostatics::Hydrostatics;
use crate::relaxation::{CERTIFICATE, Certificate, Event, Field, HeldBy, Matter, Step, certify, opened, too_few};
use crate::scene::Scene;
use crate::target::{Equilibrium, Positions, Target, at};
use sph::domain::Axis;
use sph::geometry::distance;
use sph::{parallel, reduce};
use sph_formats::common::particle_names as names;
use sph_formats::{Column, ParticleTable, UnitDimension, UnitSystem};

/// Twice a kinetic energy over that of the support, below which nothing moves.
const NO_MOTION: f64 = 1e-12;

/// Refuses to follow what is not known to be held by anything, or is too little.
///
/// # Errors
/// That.
pub(super) fn refuse_certificate<const D: usize>(
    scene: &Scene,
    (target, is_known): (&Target<'_, D>, bool),
    held: &Held,
    (count, neighbors): (usize, f64),
) -> Result<()> {
    if scene.certify_at_once().is_none() {
        return Ok(());
    }
    let refuse = |problem: String| Err(Error::scene("certify", format!("{problem}; leave it out")));
    let is_by_field = is_known && *held == Held::Not && scene.balance.is_on() && opened(target.domain).is_some();
    if !is_by_field && *held != Held::ByItself {
        let why =
            if let Held::Unsure(why) | Held::Contradicted(why) = held { format!(" ({why})") } else { String::new() };
        return refuse(format!(
            "follows a body of equal masses that its own gravity holds, with a pressure that is known{why}, or, with balance.gravity, gas in a box or a ball that a field or nothing acts on"
        ));
    }
    too_few(count, neighbors).filter(|_| !target.domain.axes.contains(&Axis::Periodic)).map_or(Ok(()), refuse)
}

/// Part of the extent of a body that its gas may be moved as a whole: more is no scatter of particles.
const LITTLE_WAY: f64 = 0.01;

/// Moves the gas about a point mass as a whole so that its center of mass is there: else both begin to swing about their common one.
pub(super) fn center_on_core<const D: usize>(
    hydrostatics: Option<&Hydrostatics<'_, D>>,
    positions: &mut Positions<D>,
    masses: &[f64],
) {
    let Some(equilibrium) = hydrostatics.filter(|h| h.point_mass().is_some()) else { return };
    let Some(center) = equilibrium.own_center() else { return };
    let (n, total) = (masses.len(), reduce::sum(masses.len(), |i| masses[i]));
    let off: [f64; D] = sph::array(|k| reduce::sum(n, |i| masses[i] * (positions[k][i] - center[k])) / total);
    let radius = reduce::max(n, |i| distance(&at(positions, i), &center));
    if off.iter().all(|off| off.abs() < LITTLE_WAY * radius) {
        (0..D).for_each(|k| positions[k].iter_mut().for_each(|x| *x -= off[k]));
    }
}

/// How the gas moves as it begins.
pub(super) struct Motion<const D: usize> {
    /// About the mean, in units of the equilibrium's; `None` at rest.
    velocities: Option<Vec<[f64; D]>>,
    /// Twice the kinetic energy of its own over d times the integral of the pressure, which is 1 where motion alone would hold the body; `None` at
    /// rest.
    pub over_support: Option<f64>,
    /// That integral, in the units of the table.
    pub support: f64,
}

impl<const D: usize> Motion<D> {
    /// That of the particles of a table in `units`, which are to turn at the rate `spin` besides; `None` where no pressure is known.
    pub(super) fn of(
        hydrostatics: Option<&Hydrostatics<'_, D>>,
        (target, positions): (&Target<'_, D>, &Positions<D>),
        (table, units, are_known): (&ParticleTable, &UnitSystem, bool),
        spin: [f64; 3],
    ) -> Option<Self> {
        let equilibrium = hydrostatics?;
        let n = positions[0].len();
        let unit = if are_known { units.to_cgs(UnitDimension::SPECIFIC_ENERGY) } else { 1.0 };
        let masses = target.masses(positions);
        let support = |i: usize| {
            let x = at(positions, i);
            masses[i] * equilibrium.pressure(&x) / target.density.value(&x).max(f64::MIN_POSITIVE)
        };
        let support = D as f64 * reduce::sum(n, support);
        let total = reduce::sum(n, |i| masses[i]);
        let about_mean = |rows: Vec<[f64; 3]>| -> Vec<[f64; 3]> {
            let mean: [f64; 3] = sph::array(|k| reduce::sum(n, |i| masses[i] * rows[i][k]) / total);
            parallel::map(n, |i| sph::array(|k| rows[i][k] - mean[k]))
        };
        let of_column = |column: &Column| about_mean(parallel::map(n, |i| row(column, i)));
        let own = table.column(names::VELOCITIES).map(of_column);
        let speed = (unit / equilibrium.specific_energy).sqrt();
        let twice_kinetic = own
            .as_ref()
            .map_or(0.0, |own| reduce::sum(n, |i| masses[i] * own[i].iter().map(|v| (speed * v).powi(2)).sum::<f64>()));
        let turned = (spin != [0.0; 3]).then(|| table.column(names::COORDINATES)).flatten().map(|column| {
            let places = about_mean(parallel::map(n, |i| row(column, i)));
            parallel::map(n, |i| {
                let (swirl, own) = (cross(spin, places[i]), own.as_ref().map_or([0.0; 3], |own| own[i]));
                sph::array(|k| own[k] + swirl[k])
            })
        });
        let velocities = turned.or(own).map(|all| parallel::map(n, |i| sph::array(|k| speed * all[i][k])));
        let mass = table.column(names::MASSES).map_or(total, |m| reduce::sum(n, |i| m.values.get(i)));
        Some(Self {
            velocities,
            // Rounding of velocities that are all the same is no motion.
            over_support: Some(twice_kinetic / support).filter(|share| *share > NO_MOTION),
            support: support * mass / total * equilibrium.specific_energy / unit,
        })
    }
}

/// What becomes of the gas where the scene asks for it and it does not settle before: of a body that its own gravity holds, or of what a
/// field and walls hold.
pub(super) fn certificate<const D: usize>(
    setting: &Setting<'_, D>,
    hydrostatics: Option<&Hydrostatics<'_, D>>,
    (positions, internal_energy): (&Positions<D>, Option<&[f64]>),
    motion: Option<Motion<D>>,
) -> Option<Certificate> {
    let Setting { scene, target, control, .. } = setting;
    let (equilibrium, duration) = hydrostatics.zip(scene.certify_at_once())?;
    let held_by = match equilibrium.own_center() {
        Some(center) => HeldBy::Own { center, point: equilibrium.point_mass() },
        None => HeldBy::Field(Field { equilibrium, target: *target }),
    };
    control.tell(Event::Begin(Step::Relax(CERTIFICATE)));
    let energy = internal_energy.map_or_else(|| equilibrium.energies(positions), <[f64]>::to_vec);
    let sums = (scene.kernel(), scene.kernel_neighbors(D));
    let kind = |i: usize| equilibrium.material(&at(positions, i)).map_or(0, |s| s.kind);
    let kinds = parallel::map(positions[0].len(), kind);
    let materials = equilibrium.materials().map(|m| (m, kinds.as_slice()));
    let matter = Matter { gamma: equilibrium.gamma(), materials, held_by };
    let velocities = motion.and_then(|motion| motion.velocities).unwrap_or_else(|| vec![[0.0; D]; energy.len()]);
    Some(certify(sums, *target, (positions, velocities, energy), &matter, duration, control))
}
