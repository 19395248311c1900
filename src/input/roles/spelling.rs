//! The names that communities give to what particles have.
//!
//! Compared are letters and digits in lower case, so that `v_x`, `VX` and `v(x)` are one.
//!
//! | community | velocity | field | others |
//! |---|---|---|---|
//! | CF conventions | `u`, `v`, `w`; `eastward_wind`; `x_wind` | | `air_pressure`, `air_temperature` |
//! | Athena++ | `vel1` to `vel3`; momenta `mom1` to `mom3` | `Bcc1` to `Bcc3` | `rho`, `press`, `Etot` |
//! | PLUTO | `vx1` to `vx3` | `Bx1` to `Bx3` | `rho`, `prs` |
//! | FLASH | `velx` to `velz` | `magx` to `magz` | `dens`, `pres`, `eint`, `ener`, `temp`, `gpot` |
//! | AMReX (Castro, Nyx) | `x_velocity`, `xvel` | | `Temp`, `eint_e`, `rho_e`, `rho_E`, `phiGrav` |
//! | RAMSES | `velocity_x` | `magnetic_field_x` | `pressure`, `thermal_pressure`, `metallicity` |
//! | MAESTROeX | `velx` to `velz` | | `tfromp`, `p0pluspi`, `X(he4)` |
//! | Quokka | momenta `x-GasMomentum` | | `gasDensity`, `gasEnergy`, `gasInternalEnergy` |
//! | yt | `velocity_x` | `magnetic_field_x` | `specific_thermal_energy`, `gravitational_potential` |
//! | MESA, GYRE, FGONG, KEPLER, WDEC | `velocity`, `v_r` | | `h1`, `he4`, `nt1`, `x_mass_fraction_H`, `z_mass_fraction_metals` |
//! | SWIFT | `Velocities` | `MagneticFluxDensities` | `InternalEnergies`, `Entropies`, `MetalMassFractions` |
//! | GADGET, GIZMO, AREPO | `Velocities` | `MagneticField` | `InternalEnergy`, `Metallicity`, `Potential` |
//! | Phantom | `vx` to `vz` | `Bx` to `Bz` | `u`, `h`, `poten` |
//! | WoMa | | | `A1_rho`, `A1_P`, `A1_T`, `A1_u`, `A1_mat_id` |

use crate::scene::{Part, Role, Vector};
use sph_formats::common::particle_names as names;
use sph_formats::plain_name;

/// What a name says by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spelling {
    Role(Role),
    /// Component 1, 2 or 3 along the axes of the grid, whatever these are.
    Numbered(Vector, usize),
    /// `u`, `v`, `w`: a velocity only in company.
    Wind(usize),
    /// Like something that particles have, but not that: what it is, and what to do.
    Other(&'static str),
    Unknown,
}

/// Prefixes of components, longest first.
const VELOCITY: &[&str] = &["gasvelocity", "velocity", "vel", "v", "u"];
const MAGNETIC_FIELD: &[&str] = &["magneticfield", "magnetic", "bfield", "bcc", "mag", "b"];

const PARTS: &[(&str, Part)] = &[
    ("x", Part::X),
    ("y", Part::Y),
    ("z", Part::Z),
    ("r", Part::R),
    ("rad", Part::R),
    ("radial", Part::R),
    ("theta", Part::Theta),
    ("phi", Part::Phi),
    ("rcyl", Part::Cylindrical),
    ("cylr", Part::Cylindrical),
    ("cylindricalr", Part::Cylindrical),
    ("cylindricalradius", Part::Cylindrical),
    ("sphericalradius", Part::R),
    ("sphericaltheta", Part::Theta),
    ("sphericalphi", Part::Phi),
];

/// Names that are written out, letters and digits alone.
const WORDS: &[(&str, Spelling)] = {
    use Spelling::{Other, Role as Is};
    const fn velocity(part: Part) -> Spelling {
        Spelling::Role(Role::Vector(Vector::Velocity, part))
    }
    const MOMENTUM: &str = "a momentum; divide it by the density to have a velocity";
    const VOLUME: &str = "an energy per volume; divide it by the density to have one per mass";
    &[
        ("velocity", velocity(Part::Whole)),
        ("velocities", velocity(Part::Whole)),
        ("vel", velocity(Part::Whole)),
        ("gasvelocity", velocity(Part::Whole)),
        ("gasvelocities", velocity(Part::Whole)),
        ("fluidvelocity", velocity(Part::Whole)),
        ("flowvelocity", velocity(Part::Whole)),
        ("bulkvelocity", velocity(Part::Whole)),
        ("radialvelocity", velocity(Part::R)),
        ("xvelocity", velocity(Part::X)),
        ("yvelocity", velocity(Part::Y)),
        ("zvelocity", velocity(Part::Z)),
        ("xvel", velocity(Part::X)),
        ("yvel", velocity(Part::Y)),
        ("zvel", velocity(Part::Z)),
        ("xwind", velocity(Part::X)),
        ("ywind", velocity(Part::Y)),
        ("seawaterxvelocity", velocity(Part::X)),
        ("seawateryvelocity", velocity(Part::Y)),
        ("eastwardwind", velocity(Part::Phi)),
        ("northwardwind", velocity(Part::North)),
        ("upwardairvelocity", velocity(Part::R)),
        ("eastwardseawatervelocity", velocity(Part::Phi)),
        ("northwardseawatervelocity", velocity(Part::North)),
        ("upwardseawatervelocity", velocity(Part::R)),
        ("magneticfield", Is(Role::Vector(Vector::MagneticField, Part::Whole))),
        ("magneticfields", Is(Role::Vector(Vector::MagneticField, Part::Whole))),
        ("magneticfluxdensities", Is(Role::Vector(Vector::MagneticField, Part::Whole))),
        ("bfield", Is(Role::Vector(Vector::MagneticField, Part::Whole))),
        ("xmom", Other(MOMENTUM)),
        ("ymom", Other(MOMENTUM)),
        ("zmom", Other(MOMENTUM)),
        ("momx", Other(MOMENTUM)),
        ("momy", Other(MOMENTUM)),
        ("momz", Other(MOMENTUM)),
        ("mom1", Other(MOMENTUM)),
        ("mom2", Other(MOMENTUM)),
        ("mom3", Other(MOMENTUM)),
        ("mx1", Other(MOMENTUM)),
        ("mx2", Other(MOMENTUM)),
        ("mx3", Other(MOMENTUM)),
        ("momentum", Other(MOMENTUM)),
        ("etot", Is(Role::TotalEnergyDensity)),
        ("gasenergy", Is(Role::TotalEnergyDensity)),
        ("gasinternalenergy", Is(Role::InternalEnergyDensity)),
        ("xgasmomentum", Other(MOMENTUM)),
        ("ygasmomentum", Other(MOMENTUM)),
        ("zgasmomentum", Other(MOMENTUM)),
        ("totalenergydensity", Is(Role::TotalEnergyDensity)),
        ("thermalenergydensity", Is(Role::InternalEnergyDensity)),
        ("internalenergydensity", Is(Role::InternalEnergyDensity)),
        ("energydensity", Other(VOLUME)),
        ("eng", Other(VOLUME)),
        ("energy", Other("an energy, which may be internal or total, per mass or per volume")),
        ("thermalenergy", Other("an energy, which may be per mass or per volume")),
        ("logt", Other("a logarithm")),
        ("logp", Other("a logarithm")),
        ("lnt", Other("a logarithm")),
        ("lnp", Other("a logarithm")),
        ("specificthermalenergy", Is(Role::InternalEnergy)),
        ("eint", Is(Role::InternalEnergy)),
        ("einte", Is(Role::InternalEnergy)),
        ("sie", Is(Role::InternalEnergy)),
        ("a1u", Is(Role::InternalEnergy)),
        ("ener", Is(Role::TotalEnergy)),
        ("specifictotalenergy", Is(Role::TotalEnergy)),
        ("t", Is(Role::Temperature)),
        ("tgas", Is(Role::Temperature)),
        ("gastemperature", Is(Role::Temperature)),
        ("airtemperature", Is(Role::Temperature)),
        ("tfromp", Is(Role::Temperature)),
        ("a1t", Is(Role::Temperature)),
        ("p", Is(Role::Pressure)),
        ("press", Is(Role::Pressure)),
        ("pres", Is(Role::Pressure)),
        ("prs", Is(Role::Pressure)),
        ("thermalpressure", Is(Role::Pressure)),
        ("airpressure", Is(Role::Pressure)),
        ("a1p", Is(Role::Pressure)),
        ("entropy", Is(Role::Entropy)),
        ("entropies", Is(Role::Entropy)),
        ("specificentropy", Is(Role::Entropy)),
        ("metallicity", Is(Role::Metallicity)),
        ("metallicities", Is(Role::Metallicity)),
        ("metals", Is(Role::Metallicity)),
        ("metalmassfraction", Is(Role::Metallicity)),
        ("metalmassfractions", Is(Role::Metallicity)),
        ("zmassfractionmetals", Is(Role::Metallicity)),
        ("a1matid", Is(Role::Material)),
        ("potential", Is(Role::Potential)),
        ("potentials", Is(Role::Potential)),
        ("gravitationalpotential", Is(Role::Potential)),
        ("gpot", Is(Role::Potential)),
        ("phigrav", Is(Role::Potential)),
        ("poten", Is(Role::Potential)),
        ("vectorpotential", Is(Role::VectorPotential)),
        ("vectorpotentialx", Is(Role::VectorPotential)),
        ("vectorpotentialy", Is(Role::VectorPotential)),
        ("vectorpotentialz", Is(Role::VectorPotential)),
        ("magneticvectorpotentials", Is(Role::VectorPotential)),
        ("smoothinglength", Is(Role::SmoothingLength)),
        ("smoothinglengths", Is(Role::SmoothingLength)),
        ("hsml", Is(Role::SmoothingLength)),
        ("softening", Is(Role::Softening)),
        ("softenings", Is(Role::Softening)),
        ("elementmassfractions", Is(Role::Composition)),
        ("elementabundance", Is(Role::Composition)),
        ("abundance", Is(Role::Composition)),
        ("abundances", Is(Role::Composition)),
    ]
};

/// The key of a scene's `fields` that means what a name says; `None` for what has none.
pub fn field_key(name: &str) -> Option<&'static str> {
    const VELOCITIES: [&str; 3] = ["v_x", "v_y", "v_z"];
    Some(match spelling(name) {
        Spelling::Role(Role::Vector(Vector::MagneticField, _)) | Spelling::Numbered(Vector::MagneticField, _) => {
            "magnetic_field"
        }
        Spelling::Role(Role::VectorPotential) => "vector_potential",
        Spelling::Role(Role::Vector(Vector::Velocity, part)) => match part {
            Part::Whole | Part::North => "velocity",
            Part::X => VELOCITIES[0],
            Part::Y => VELOCITIES[1],
            Part::Z => VELOCITIES[2],
            Part::R => "v_r",
            Part::Theta => "v_theta",
            Part::Phi => "v_phi",
            Part::Cylindrical => "v_R",
        },
        Spelling::Numbered(Vector::Velocity, place) => VELOCITIES.get(place)?,
        Spelling::Wind(_) => "velocity",
        Spelling::Role(Role::InternalEnergy) => "internal_energy",
        Spelling::Role(Role::Temperature) => "temperature",
        Spelling::Role(Role::Pressure) => "pressure",
        Spelling::Role(Role::Entropy) => "entropy",
        Spelling::Role(Role::Material) => "material",
        _ => return None,
    })
}

/// What the name says.
pub fn spelling(name: &str) -> Spelling {
    let plain = plain_name(name);
    if let Some((_, found)) = WORDS.iter().find(|(word, _)| *word == plain) {
        return *found;
    }
    if let Some(place) = ["u", "v", "w"].iter().position(|letter| *letter == plain) {
        return Spelling::Wind(place);
    }
    // AMReX's codes tell the two by the letter's case alone.
    match name {
        "rho_E" | "rhoE" => return Spelling::Role(Role::TotalEnergyDensity),
        "rho_e" | "rhoe" => return Spelling::Role(Role::InternalEnergyDensity),
        // A small b is much else.
        "B" => return Spelling::Role(Role::Vector(Vector::MagneticField, Part::Whole)),
        _ => {}
    }
    // A capital R beside a small v is the distance from the axis: `v_R`, `B_R`.
    if matches!(name, "v_R" | "vR" | "vel_R" | "B_R" | "BR" | "bR") {
        let vector = if name.starts_with('v') { Vector::Velocity } else { Vector::MagneticField };
        return Spelling::Role(Role::Vector(vector, Part::Cylindrical));
    }
    if let Some(role) = standard(name) {
        return Spelling::Role(role);
    }
    for (vector, prefixes) in [(Vector::Velocity, VELOCITY), (Vector::MagneticField, MAGNETIC_FIELD)] {
        if let Some(found) = prefixes.iter().find_map(|prefix| component(vector, plain.strip_prefix(prefix)?)) {
            return found;
        }
    }
    if is_composition(name) { Spelling::Role(Role::Composition) } else { Spelling::Unknown }
}

fn component(vector: Vector, rest: &str) -> Option<Spelling> {
    let digit = rest.strip_prefix('x').filter(|r| !r.is_empty()).unwrap_or(rest);
    if let Some(place) = ["1", "2", "3"].iter().position(|d| *d == digit) {
        return Some(Spelling::Numbered(vector, place));
    }
    let (_, part) = PARTS.iter().find(|(name, _)| *name == rest)?;
    Some(Spelling::Role(Role::Vector(vector, *part)))
}

/// Which component of a momentum per volume a name is: along an axis of the grid by number, or by name.
pub fn momentum(name: &str) -> Option<usize> {
    let plain = plain_name(name);
    [
        "mom1 momx xmom mx1 momentumx xgasmomentum",
        "mom2 momy ymom mx2 momentumy ygasmomentum",
        "mom3 momz zmom mx3 momentumz zgasmomentum",
    ]
    .iter()
    .position(|names| names.split(' ').any(|n| n == plain))
}

/// Names that particle files use.
fn standard(name: &str) -> Option<Role> {
    Some(match names::standard(name)? {
        names::DENSITY => Role::Density,
        names::INTERNAL_ENERGY => Role::InternalEnergy,
        names::PRESSURE => Role::Pressure,
        names::TEMPERATURE => Role::Temperature,
        names::MATERIAL_IDS => Role::Material,
        names::PARTICLE_IDS => Role::Id,
        names::SUPPORT_RADIUS => Role::SmoothingLength,
        _ => return None,
    })
}

/// `h1`, `he4`, `x_mass_fraction_H`, `X_He`, `massfrac_c12`.
fn is_composition(name: &str) -> bool {
    let lower = name.to_ascii_lowercase();
    // KEPLER's neutrons and protons that no nucleus holds.
    if ["nt1", "pn1", "neutrons"].contains(&lower.as_str()) {
        return true;
    }
    if lower.contains("mass_fraction") || lower.contains("massfraction") || lower.starts_with("massfrac") {
        return true;
    }
    let isotope = lower.strip_prefix("x_").or_else(|| lower.strip_prefix("x(")?.strip_suffix(')')).unwrap_or(&lower);
    let letters = isotope.find(|c: char| c.is_ascii_digit()).unwrap_or(isotope.len());
    let (element, nucleons) = isotope.split_at(letters);
    let is_element = ELEMENTS.contains(&element);
    let is_number = nucleons.parse::<u16>().is_ok_and(|n| (1..300).contains(&n));
    is_element && (is_number || (nucleons.is_empty() && lower.starts_with("x")))
}

/// Those of nuclear networks.
const ELEMENTS: &[&str] = &[
    "h", "he", "li", "be", "b", "c", "n", "o", "f", "ne", "na", "mg", "al", "si", "p", "s", "cl", "ar", "k", "ca",
    "sc", "ti", "v", "cr", "mn", "fe", "co", "ni", "cu", "zn",
];

#[cfg(test)]
mod tests {
    use super::*;

    fn velocity(part: Part) -> Spelling {
        Spelling::Role(Role::Vector(Vector::Velocity, part))
    }

    fn field(part: Part) -> Spelling {
        Spelling::Role(Role::Vector(Vector::MagneticField, part))
    }

    #[test]
    fn the_spellings_of_each_community_are_known() {
        for (name, expected) in [
            ("vel1", Spelling::Numbered(Vector::Velocity, 0)),
            ("vel3", Spelling::Numbered(Vector::Velocity, 2)),
            ("vx2", Spelling::Numbered(Vector::Velocity, 1)),
            ("Bcc1", Spelling::Numbered(Vector::MagneticField, 0)),
            ("Bx3", Spelling::Numbered(Vector::MagneticField, 2)),
            ("velx", velocity(Part::X)),
            ("x_velocity", velocity(Part::X)),
            ("yvel", velocity(Part::Y)),
            ("velocity_z", velocity(Part::Z)),
            ("v_x", velocity(Part::X)),
            ("VY", velocity(Part::Y)),
            ("uz", velocity(Part::Z)),
            ("v_r", velocity(Part::R)),
            ("vr", velocity(Part::R)),
            ("v_R", velocity(Part::Cylindrical)),
            ("vtheta", velocity(Part::Theta)),
            ("v_phi", velocity(Part::Phi)),
            ("eastward_wind", velocity(Part::Phi)),
            ("Velocities", velocity(Part::Whole)),
            ("Bx", field(Part::X)),
            ("magy", field(Part::Y)),
            ("magnetic_field_z", field(Part::Z)),
            ("MagneticFluxDensities", field(Part::Whole)),
            ("u", Spelling::Wind(0)),
            ("w", Spelling::Wind(2)),
            ("eint", Spelling::Role(Role::InternalEnergy)),
            ("InternalEnergies", Spelling::Role(Role::InternalEnergy)),
            ("specific_thermal_energy", Spelling::Role(Role::InternalEnergy)),
            ("ener", Spelling::Role(Role::TotalEnergy)),
            ("Etot", Spelling::Role(Role::TotalEnergyDensity)),
            ("rho_E", Spelling::Role(Role::TotalEnergyDensity)),
            ("rho_e", Spelling::Role(Role::InternalEnergyDensity)),
            ("prs", Spelling::Role(Role::Pressure)),
            ("pres", Spelling::Role(Role::Pressure)),
            ("press", Spelling::Role(Role::Pressure)),
            ("thermal_pressure", Spelling::Role(Role::Pressure)),
            ("Temp", Spelling::Role(Role::Temperature)),
            ("tfromp", Spelling::Role(Role::Temperature)),
            ("X(he4)", Spelling::Role(Role::Composition)),
            ("gasInternalEnergy", Spelling::Role(Role::InternalEnergyDensity)),
            ("A1_mat_id", Spelling::Role(Role::Material)),
            ("rho", Spelling::Role(Role::Density)),
            ("he4", Spelling::Role(Role::Composition)),
            ("nt1", Spelling::Role(Role::Composition)),
            ("y_mass_fraction_He", Spelling::Role(Role::Composition)),
            ("x_mass_fraction_H", Spelling::Role(Role::Composition)),
            ("X_He", Spelling::Role(Role::Composition)),
            ("MetalMassFractions", Spelling::Role(Role::Metallicity)),
            ("gpot", Spelling::Role(Role::Potential)),
            ("Softenings", Spelling::Role(Role::Softening)),
        ] {
            assert_eq!(spelling(name), expected, "{name}");
        }
    }

    #[test]
    fn names_alike_are_not_taken() {
        for name in
            ["x", "vorticity", "bulk", "ux_error", "vol", "volume", "number", "h", "x_h2o_total", "co2", "opacity"]
        {
            let found = spelling(name);
            assert!(!matches!(found, Spelling::Role(Role::Vector(..)) | Spelling::Numbered(..)), "{name}: {found:?}");
        }
        assert_eq!(spelling("vorticity"), Spelling::Unknown);
        assert!(matches!(spelling("mom2"), Spelling::Other(_)));
        assert!(matches!(spelling("energy_density"), Spelling::Other(_)));
    }
}
