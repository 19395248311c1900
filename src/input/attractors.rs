//! The bodies of `gravity_of` as sources of gravity, in the units of the input that they accompany.

use crate::error::{Error, Result};
use crate::field::{RadialProfile, total_mass};
use crate::input::halo::{Halo, is_without_gas};
use crate::input::profile::{self, Numbers};
use crate::input::spherical::spherical;
use crate::input::stated_units;
use crate::input::units::RunUnits;
use crate::input::weight::Beside;
use crate::input::{factor, ingest};
use crate::scene::Scene;
use sph::point_mass::{PointMass, Softening};
use sph_formats::{FileContent, FormatSpec, ParticleFile, RawField, UnitDimension, UnitSystem};

/// Quadrature of a mass aims at this relative error.
const MASS_TOLERANCE: f64 = 1e-10;

/// One of them.
pub(crate) enum Attractor {
    Point(PointMass<1>),
    Sphere {
        profile: RadialProfile,
        /// Where it is cut.
        end: f64,
        mass: f64,
        name: String,
    },
    /// None that can be felt, and why.
    Left(String),
}

/// All of a scene's; `units` are those of its input.
///
/// # Errors
/// Those of reading the bodies, with their keys; one in other units or dimensions.
pub(crate) fn find(scene: &Scene, formats: &[FormatSpec], units: &RunUnits) -> Result<Vec<Attractor>> {
    let softening = scene.code().map_or(Softening::CubicSpline, |code| code.sheet.softening);
    let mut all = Vec::new();
    for (i, attractor) in scene.gravity_of.iter().enumerate() {
        let key = format!("gravity_of[{i}]");
        if let Some(mass) = &attractor.point_mass {
            let conversion = units.to_input();
            let mass = mass.value(&format!("{key}.point_mass"), UnitDimension::MASS, &conversion)?;
            let radius = attractor.softening_radius.as_ref();
            let radius = radius
                .map(|r| r.value(&format!("{key}.softening_radius"), UnitDimension::LENGTH, &conversion))
                .transpose()?;
            let radius = radius.unwrap_or(0.0);
            all.push(Attractor::Point(PointMass { center: [0.0], mass, radius, softening }));
            continue;
        }
        let alone = scene.of_attractor(attractor);
        let within = |error: Error| match error {
            Error::Scene { key: inner, problem } => Error::Scene { key: format!("{key}.{inner}"), problem },
            other => other,
        };
        all.push(sphere(&alone, formats, units).map_err(within)?);
    }
    Ok(all)
}

/// What attracts of a scene's, for a profile that depends on it, and what there is to say of the rest.
///
/// # Errors
/// As for [`find`].
pub(crate) fn beside(scene: &Scene, formats: &[FormatSpec], units: &RunUnits) -> Result<(Beside, Vec<String>)> {
    let (mut beside, mut notes) = (Beside::default(), Vec::new());
    for found in find(scene, formats, units)? {
        match found {
            Attractor::Point(point) => beside.points.push(point),
            Attractor::Sphere { profile, end, .. } => beside.spheres.push((profile, end)),
            Attractor::Left(note) => notes.push(note),
        }
    }
    Ok((beside, notes))
}

/// The gas of a scene's profile, at rest in the gravity of the scene's other bodies and its own, as if it had been read.
///
/// # Errors
/// As for [`find`], and numbers that make no such gas.
pub(crate) fn hydrostatic(
    scene: &Scene,
    formats: &[FormatSpec],
    (numbers, units): (&Numbers, &RunUnits),
) -> Result<RawField> {
    let gas = scene.input.hydrostatic().ok_or_else(|| Error::scene("input.profile", "is no gas that others hold"))?;
    // What is left out is said where the rest is added to what attracts particles.
    let (beside, _) = beside(scene, formats, units)?;
    profile::hydrostatic(scene, gas, (numbers, &beside))
}

/// The body of a scene of its own.
fn sphere(scene: &Scene, formats: &[FormatSpec], units: &RunUnits) -> Result<Attractor> {
    let name = scene.input_name();
    let left = Attractor::Left(format!("the gravity of {name} is left out: its density is not a function of radius"));
    let raw = match ingest::stated(scene)? {
        Some(raw) => raw,
        None => match ingest::content(scene, formats)? {
            FileContent::Particles(file) if is_without_gas(&file) => return of_particles(scene, &file, units),
            content => ingest::of_content(scene, content)?,
        },
    };
    if matches!(raw, ingest::RawInput::Disc(_)) {
        return Ok(left);
    }
    let own = RunUnits::new(scene, stated_units::units(scene, &raw)?.input)?;
    let raw = match raw {
        ingest::RawInput::Hydrostatic(numbers) => {
            ingest::RawInput::File(Box::new(hydrostatic(scene, formats, (&numbers, &own))?))
        }
        raw => raw,
    };
    let dimension = ingest::dimension(scene, &raw)?;
    if dimension != 3 {
        return Err(Error::scene("input.dimension", format!("is {dimension}, expected 3: it attracts a body in 3-D")));
    }
    let source = ingest::source::<3>(scene, formats, raw, &own)?.source;
    let source = factor::apply(scene, source, &own.to_input())?;
    let Some(sphere) = spherical(&source) else { return Ok(left) };
    let mass = match source.mass {
        Some(mass) => mass,
        None => total_mass(source.density.as_ref(), &source.domain, MASS_TOLERANCE)?,
    };
    let (length, density) = in_units(own.input.map(|u| (u.length, u.density)), units)?;
    Ok(Attractor::Sphere {
        profile: sphere.profile.scaled(length, density),
        end: sphere.end * length,
        mass: mass.value * density * length.powi(3),
        name,
    })
}

/// The collisionless particles of a file that has no gas.
///
/// # Errors
/// Those of a [`Halo`]; units where the body has none, or the other way round.
fn of_particles(scene: &Scene, file: &ParticleFile, units: &RunUnits) -> Result<Attractor> {
    let mut system = file.header.units;
    ingest::units_of_snapshot(scene, &mut system)?;
    let own = (system != UnitSystem::CODE).then(|| (system.length, system.mass / system.length.powi(3)));
    let (length, density) = in_units(own, units)?;
    let Halo { profile, mass, count } = Halo::of(&scene.input_name(), file)?;
    Ok(Attractor::Sphere {
        end: profile.outer_radius() * length,
        profile: profile.scaled(length, density),
        mass: mass * density * length.powi(3),
        name: format!("{} (the mean over spheres of its {count} particles)", scene.input_name()),
    })
}

/// Units of length and density, where there are any, in those of the body that is attracted.
///
/// # Errors
/// Where one has units and the other none.
fn in_units(own: Option<(f64, f64)>, units: &RunUnits) -> Result<(f64, f64)> {
    match (own, units.input) {
        (Some((length, density)), Some(body)) => Ok((length / body.length, density / body.density)),
        (None, None) => Ok((1.0, 1.0)),
        _ => {
            let problem = "has units where the body has none, or the other way round; state them in both, or `units`";
            Err(Error::scene("input", problem))
        }
    }
}
