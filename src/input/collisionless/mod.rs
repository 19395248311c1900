//! Random velocities of collisionless particles in a spherical body, isotropic and in equilibrium with the attraction of all
//! that is about its center: its own mass and that of `gravity_of`.
//!
//! `eddington` draws them from the distribution function of the density in that potential ([`eddington`]), `jeans` from
//! Gaussians of the dispersion that Jeans's equation asks for ([`jeans`]). Particles draw by themselves, keyed by seed and number;
//! the mean velocity by mass is taken off.

mod eddington;
mod jeans;
mod spline;
mod well;

use crate::error::{Error, Result};
use crate::input::constants::gravity;
use crate::input::internal_units::Prepared;
use crate::input::spherical::{Spherical, spherical};
use crate::input::units::RunUnits;
use crate::random::{Purpose, keyed};
use crate::scene::{Scene, VelocityName};
use crate::target::{Positions, at};
use eddington::Eddington;
use jeans::Jeans;
use rand::RngExt;
use sph::geometry::distance;
use sph::{parallel, reduce};
use sph_formats::Species;
use well::{Sphere, Well};

const KEY: &str = "collisionless.velocities";
/// Share of the mass in energies at which f is negative up to which these are left empty.
const LITTLE: f64 = 1e-3;
/// A surplus of kinetic energy that is more than the scatter of a few thousand particles.
const SPREADS: f64 = 0.05;
/// Shares of negative f below this are rounding.
const ROUNDING: f64 = 1e-7;

/// Velocities, row by row, in units of the square root of `specific_energy`, which is in cgs where there are units.
pub(crate) struct Drawn {
    pub velocities: Vec<f64>,
    pub specific_energy: f64,
    pub notes: Vec<String>,
    pub warnings: Vec<String>,
}

/// How speeds are drawn.
enum Law<'a> {
    Eddington(Eddington<'a>),
    Jeans(Jeans),
}

/// Velocities for particles at `positions`; `None` where none are to be drawn.
///
/// # Errors
/// A density that is no function of the radius, or that no isotropic velocities hold.
pub(crate) fn velocities<const D: usize>(
    scene: &Scene,
    prepared: &Prepared<D>,
    (positions, masses): (&Positions<D>, &[f64]),
    units: &RunUnits,
) -> Result<Option<Drawn>> {
    let Some(input) = scene.collisionless.as_ref().filter(|c| c.velocities != VelocityName::None) else {
        return Ok(None);
    };
    let Some(Spherical { profile, center, .. }) = spherical(&prepared.source) else {
        let problem = "are drawn for a density that depends on the distance from its center alone, in all of a ball; state them in `fields`, with \
                       `velocities: none`";
        return Err(Error::scene(KEY, problem));
    };
    let center: [f64; D] = sph::array(|k| center[k]);
    let beside = &prepared.beside;
    let enclosed = |r: f64| profile.enclosed_mass(r) + if beside.is_empty() { 0.0 } else { beside.enclosed_mass(r) };
    let nodes = profile.nodes();
    let sphere = Sphere { density: &|r| profile.density(r), enclosed: &enclosed, nodes: &nodes };
    let has_tail = input.velocities == VelocityName::Eddington;
    let well = Well::new(&sphere, has_tail).map_err(|problem| Error::scene(KEY, problem))?;
    let mut notes = vec![potential_note(prepared)];
    let law = match input.velocities {
        VelocityName::Jeans => {
            notes.push("velocities are Gaussian with the dispersion of Jeans's equation; the distribution function is not exactly in equilibrium".into());
            Law::Jeans(Jeans::new(&sphere, &well).map_err(|problem| Error::scene(KEY, problem))?)
        }
        _ => Law::Eddington(of_eddington(&well, &mut notes)?),
    };
    let n = masses.len();
    let mut drawn = vec![[0.0; D]; n];
    parallel::update(&mut drawn, |i, v| {
        let mut random = keyed(scene.seed, Purpose::Velocity, i as u64);
        let r = distance(&at(positions, i), &center);
        let speed = match &law {
            Law::Eddington(f) => f.speed(r, &mut random),
            Law::Jeans(gaussian) => gaussian.speed(r, &mut random),
        };
        let way = direction(&mut random);
        *v = sph::array(|k| speed * way[k]);
    });
    let total = reduce::sum(n, |i| masses[i]);
    for k in 0..D {
        // Twice, so that what is left is the rounding of the mean and not that of the sum before it.
        for _ in 0..2 {
            let mean = reduce::sum(n, |i| masses[i] * drawn[i][k]) / total;
            parallel::update(&mut drawn, |_, v| v[k] -= mean);
        }
    }
    let kinetic = reduce::sum(n, |i| masses[i] * drawn[i].iter().map(|v| v * v).sum::<f64>());
    let virial = reduce::sum(n, |i| {
        let r = distance(&at(positions, i), &center);
        if r > 0.0 { masses[i] * enclosed(r) / r } else { 0.0 }
    });
    notes.push(format!(
        "the drawn velocities have 2 K/|W| = {:.4}, with W the sum of m x g in that potential",
        kinetic / virial
    ));
    let surplus = kinetic / virial - 1.0;
    let warnings = Vec::from_iter((surplus > SPREADS).then(|| {
        format!(
            "the outer particles will move outward: 2 K/|W| is {:.3}, since much mass would lie beyond the radius \
             where the density is cut; cut it farther out, let the density fall off before that radius, or use \
             `velocities: jeans`",
            1.0 + surplus
        )
    }));
    let (length, density) = units.input.map_or((1.0, 1.0), |u| (u.length, u.density));
    let mass = prepared.mass.value * density * length.powi(3);
    let specific_energy = gravity(scene, units.input.is_some()) * mass / (prepared.length * length);
    Ok(Some(Drawn { velocities: drawn.into_flattened(), specific_energy, notes, warnings }))
}

/// Refuses particles of the input that are of the same type: files would not tell them apart.
///
/// # Errors
/// With what the scene can do about it.
pub(crate) fn refuse_taken_type(scene: &Scene, others: &[Species]) -> Result<()> {
    match scene.collisionless.as_ref().filter(|c| others.iter().any(|o| o.part_type == c.part_type)) {
        Some(input) => {
            let problem = format!(
                "is {}, as that of particles that the input has beside its density; state another, or leave these out with input.other_types: drop",
                input.part_type
            );
            Err(Error::scene("collisionless.type", problem))
        }
        None => Ok(()),
    }
}

fn potential_note<const D: usize>(prepared: &Prepared<D>) -> String {
    let others = prepared.beside.spheres.len() + prepared.beside.points.len();
    let others = match others {
        0 => "the body's own mass alone".to_owned(),
        1 => "the body's own mass and one other body (gravity_of)".to_owned(),
        n => format!("the body's own mass and {n} other bodies (gravity_of)"),
    };
    format!("the particles are collisionless; their velocities are drawn in the potential of {others}")
}

/// The distribution function of a density in a well.
fn of_eddington<'a>(well: &'a Well, notes: &mut Vec<String>) -> Result<Eddington<'a>> {
    let f = Eddington::new(well);
    let remedy = "`velocities: jeans` draws Gaussian ones instead";
    if let Some((share, [from, to])) = f.negative.filter(|(share, _)| *share > ROUNDING) {
        let found = format!(
            "for {:.3} % of the mass, at energies of {from:.3} to {to:.3} of the depth of the potential, counted from the center",
            100.0 * share.min(1.0)
        );
        if !(share <= LITTLE) {
            let problem = format!(
                "are drawn from f(E), which is negative {found}: no isotropic velocities make this density in this potential; {remedy}, or let the \
                 density fall more smoothly towards its edge"
            );
            return Err(Error::scene(KEY, problem));
        }
        notes.push(format!("f(E) is negative {found}: no particles are given such energies ({remedy})"));
    }
    notes.push(match well.tail {
        None => "velocities are drawn from f(E) of the density in the potential (Eddington 1916); it ends at the body's edge".into(),
        Some(slope) => format!(
            "velocities are drawn from f(E) of the density in the potential (Eddington 1916), as if the density went on beyond the edge, where it is cut, as r^-{slope:.2}"
        ),
    });
    Ok(f)
}

/// A unit vector of any direction.
fn direction(random: &mut impl RngExt) -> [f64; 3] {
    let [u, turn]: [f64; 2] = [random.random(), random.random()];
    let z = 2.0 * u - 1.0;
    let (sin, cos) = (std::f64::consts::TAU * turn).sin_cos();
    let across = (1.0 - z * z).sqrt();
    [across * cos, across * sin, z]
}

#[cfg(test)]
mod tests;
