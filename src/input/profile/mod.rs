//! Inputs made from physics: the tables of [`ProfileInput`], as if they had been read from a file.
//!
//! | model | density | pressure |
//! |---|---|---|
//! | polytrope, isothermal, bonnor-ebert, white-dwarf | solution under its own gravity | of the equation of state |
//! | plummer, hernquist, nfw, king, beta-model, power-law | closed form, cut at the outer radius | that carries the weight, 0 at the outer radius |
//! | evrard | closed form | of one specific internal energy |
//! | toy-star | closed form | k rho^2 |

mod emden;
mod spheres;
mod table;
mod white_dwarf;

use crate::error::{Error, Result};
use crate::input::hydrostatics::GRAVITATIONAL_CONSTANT;
use crate::scene::{ProfileInput, Scene};
use sph_formats::{Geometry, Location, RawField, Unit, Values, Variable};
use spheres::{Cut, key};
use table::Table;

/// The field of a scene's profile.
///
/// # Errors
/// Numbers that make no body.
pub(crate) fn field(scene: &Scene, profile: &ProfileInput) -> Result<RawField> {
    let d = scene.input.dimension.unwrap_or(3);
    let has_units = matches!(profile, ProfileInput::WhiteDwarf { .. });
    let in_cgs = scene.code().map_or(GRAVITATIONAL_CONSTANT, |code| code.sheet.gravity);
    let plain = scene.balance.clone().unwrap_or_default().constant;
    let gravity = if has_units { in_cgs } else { plain };
    let table = table(profile, d, gravity)?;
    let name = profile.name();
    let worst = table.density.iter().chain(&table.radii).find(|v| !v.is_finite());
    if let Some(v) = worst {
        let problem = format!("has a density or radius of {v}: its mass and radii are beyond f64; choose other units");
        return Err(Error::scene(format!("input.profile.{name}"), problem));
    }
    let unit = |symbol: &str| Unit::parse(symbol).filter(|_| has_units);
    let variable = |name: &str, symbol: &str, values: Vec<f64>| Variable {
        name: name.into(),
        description: None,
        unit: unit(symbol),
        location: Location::Node,
        components: 1,
        values: Values::F64(values),
    };
    let mut variables = vec![variable("density", "g/cm^3", table.density)];
    variables.extend(table.pressure.map(|p| variable("pressure", "dyn/cm^2", p)));
    variables.extend(table.internal_energy.map(|u| variable("internal_energy", "erg/g", u)));
    Ok(RawField {
        path: format!("profile {name}").into(),
        format: "profile",
        geometry: Geometry::Radial { nodes: table.radii, unit: unit("cm") },
        variables,
        density: Some("density".into()),
        metadata: Vec::new(),
        notes: Vec::new(),
    })
}

fn table(profile: &ProfileInput, d: usize, gravity: f64) -> Result<Table> {
    let model = profile.name();
    let is_of_any_dimension = matches!(
        profile,
        ProfileInput::Polytrope { .. }
            | ProfileInput::BonnorEbert { .. }
            | ProfileInput::PowerLaw { .. }
            | ProfileInput::ToyStar { .. }
    );
    if d != 3 && !is_of_any_dimension {
        return Err(Error::scene(
            "input.dimension",
            format!("is {d}, but the profile '{model}' is one in 3 dimensions"),
        ));
    }
    let positive = |name: &str, value: f64| match value.is_finite() && value > 0.0 {
        true => Ok(value),
        false => Err(Error::scene(key(model, name), format!("is {value}, expected a positive number"))),
    };
    let cut = |mass: f64, (scale_name, scale): (&str, f64), (outer_name, outer): (&str, f64)| {
        let (mass, scale, outer) =
            (positive("mass", mass)?, positive(scale_name, scale)?, positive(outer_name, outer)?);
        Ok::<_, Error>(Cut { mass, scale, outer })
    };
    match *profile {
        ProfileInput::Polytrope { n, mass, radius } => {
            spheres::polytrope(d, n, positive("mass", mass)?, positive("radius", radius)?, gravity)
        }
        ProfileInput::Isothermal { mass, radius, sound_speed } => {
            let (mass, radius) = (positive("mass", mass)?, positive("radius", radius)?);
            spheres::isothermal(mass, radius, positive("sound_speed", sound_speed)?, gravity)
        }
        ProfileInput::BonnorEbert { mass, radius, xi } => {
            let (mass, radius) = (positive("mass", mass)?, positive("radius", radius)?);
            spheres::bonnor_ebert(d, positive("xi", xi)?, mass, radius, gravity)
        }
        ProfileInput::Plummer { mass, scale_radius, outer_radius } => {
            let cut = cut(mass, ("scale_radius", scale_radius), ("outer_radius", outer_radius))?;
            Ok(spheres::cored(cut, gravity, &|x| (1.0 + x * x).powf(-2.5)))
        }
        ProfileInput::Hernquist { mass, scale_radius, outer_radius } => {
            let cut = cut(mass, ("scale_radius", scale_radius), ("outer_radius", outer_radius))?;
            Ok(spheres::cusped(cut, gravity, &|x| 1.0 / (x * (1.0 + x).powi(3))))
        }
        ProfileInput::Nfw { mass, scale_radius, outer_radius } => {
            let cut = cut(mass, ("scale_radius", scale_radius), ("outer_radius", outer_radius))?;
            Ok(spheres::cusped(cut, gravity, &|x| 1.0 / (x * (1.0 + x).powi(2))))
        }
        ProfileInput::King { mass, core_radius, tidal_radius } => {
            let cut = cut(mass, ("core_radius", core_radius), ("tidal_radius", tidal_radius))?;
            Ok(spheres::cored(cut, gravity, &spheres::king(cut.outer / cut.scale)))
        }
        ProfileInput::BetaModel { mass, core_radius, beta, outer_radius } => {
            let cut = cut(mass, ("core_radius", core_radius), ("outer_radius", outer_radius))?;
            let power = -1.5 * positive("beta", beta)?;
            Ok(spheres::cored(cut, gravity, &|x| (1.0 + x * x).powf(power)))
        }
        ProfileInput::Evrard { mass, radius, energy } => {
            let (mass, radius) = (positive("mass", mass)?, positive("radius", radius)?);
            Ok(spheres::evrard(mass, radius, positive("energy", energy)?, gravity))
        }
        ProfileInput::PowerLaw { mass, radius, slope } => {
            spheres::power_law(d, slope, positive("mass", mass)?, positive("radius", radius)?, gravity)
        }
        ProfileInput::ToyStar { mass, radius, k } => {
            Ok(spheres::toy_star(d, positive("mass", mass)?, positive("radius", radius)?, positive("k", k)?))
        }
        ProfileInput::WhiteDwarf { mass, nucleons_per_electron } => {
            let per_electron = positive("nucleons_per_electron", nucleons_per_electron)?;
            white_dwarf::white_dwarf(positive("mass", mass)?, per_electron, gravity)
        }
    }
}
