//! Roles of input variables: density, a component of the velocity, a temperature.

use crate::error::{Error, Result};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use sph_formats::{UnitDimension, did_you_mean};
use std::borrow::Cow;

/// Vector quantities that particles have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Vector {
    Velocity,
    MagneticField,
}

/// Which part of a vector a variable is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// All Cartesian components.
    Whole,
    X,
    Y,
    Z,
    /// Away from the center.
    R,
    /// Along the polar angle, away from the z axis at the north pole.
    Theta,
    /// Along the azimuth, eastward.
    Phi,
    /// Away from the z axis.
    Cylindrical,
    /// Along the latitude, northward.
    North,
}

/// What a variable is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Role {
    Density,
    Vector(Vector, Part),
    InternalEnergy,
    /// Internal and kinetic energy per mass.
    TotalEnergy,
    /// Internal, kinetic and magnetic energy per volume.
    TotalEnergyDensity,
    /// Internal energy per volume.
    InternalEnergyDensity,
    Temperature,
    Pressure,
    Entropy,
    Composition,
    Metallicity,
    Material,
    Potential,
    VectorPotential,
    SmoothingLength,
    Softening,
    Id,
    /// None of these: carried under its own name.
    None,
}

const NAMES: &[(&str, Role)] = {
    use {Part as P, Vector as V};
    &[
        ("density", Role::Density),
        ("velocity", Role::Vector(V::Velocity, P::Whole)),
        ("velocity-x", Role::Vector(V::Velocity, P::X)),
        ("velocity-y", Role::Vector(V::Velocity, P::Y)),
        ("velocity-z", Role::Vector(V::Velocity, P::Z)),
        ("velocity-r", Role::Vector(V::Velocity, P::R)),
        ("velocity-theta", Role::Vector(V::Velocity, P::Theta)),
        ("velocity-phi", Role::Vector(V::Velocity, P::Phi)),
        ("velocity-cylindrical", Role::Vector(V::Velocity, P::Cylindrical)),
        ("velocity-north", Role::Vector(V::Velocity, P::North)),
        ("magnetic-field", Role::Vector(V::MagneticField, P::Whole)),
        ("magnetic-field-x", Role::Vector(V::MagneticField, P::X)),
        ("magnetic-field-y", Role::Vector(V::MagneticField, P::Y)),
        ("magnetic-field-z", Role::Vector(V::MagneticField, P::Z)),
        ("magnetic-field-r", Role::Vector(V::MagneticField, P::R)),
        ("magnetic-field-theta", Role::Vector(V::MagneticField, P::Theta)),
        ("magnetic-field-phi", Role::Vector(V::MagneticField, P::Phi)),
        ("magnetic-field-cylindrical", Role::Vector(V::MagneticField, P::Cylindrical)),
        ("internal-energy", Role::InternalEnergy),
        ("total-energy", Role::TotalEnergy),
        ("total-energy-density", Role::TotalEnergyDensity),
        ("internal-energy-density", Role::InternalEnergyDensity),
        ("temperature", Role::Temperature),
        ("pressure", Role::Pressure),
        ("entropy", Role::Entropy),
        ("composition", Role::Composition),
        ("metallicity", Role::Metallicity),
        ("material", Role::Material),
        ("potential", Role::Potential),
        ("vector-potential", Role::VectorPotential),
        ("smoothing-length", Role::SmoothingLength),
        ("softening", Role::Softening),
        ("id", Role::Id),
        ("none", Role::None),
    ]
};

impl Role {
    /// All names.
    pub(super) fn names() -> impl Iterator<Item = &'static str> {
        NAMES.iter().map(|(name, _)| *name)
    }

    /// As scenes and `--map` write it.
    pub fn name(self) -> &'static str {
        NAMES.iter().find(|(_, role)| *role == self).map_or("magnetic-field", |(name, _)| name)
    }

    /// The role of a name.
    ///
    /// # Errors
    /// A name that is none, with those that are.
    pub fn parse(name: &str) -> std::result::Result<Self, String> {
        let plain = name.trim().to_lowercase().replace(['_', ' '], "-");
        let found = NAMES.iter().find(|(known, _)| *known == plain);
        found.map(|(_, role)| *role).ok_or_else(|| {
            let all = NAMES.iter().map(|(known, _)| *known);
            let hint = did_you_mean(&plain, all.clone());
            format!("'{name}' is no role; expected one of {}{hint}", all.collect::<Vec<_>>().join(", "))
        })
    }

    /// What its numbers measure; `None` where that is open.
    pub fn dimension(self) -> Option<UnitDimension> {
        Some(match self {
            Self::Vector(Vector::Velocity, _) => UnitDimension::VELOCITY,
            Self::Vector(Vector::MagneticField, _) => UnitDimension::MAGNETIC_FIELD,
            Self::InternalEnergy | Self::TotalEnergy | Self::Potential => UnitDimension::SPECIFIC_ENERGY,
            Self::Temperature => UnitDimension::TEMPERATURE,
            Self::Pressure | Self::TotalEnergyDensity | Self::InternalEnergyDensity => UnitDimension::PRESSURE,
            Self::SmoothingLength | Self::Softening => UnitDimension::LENGTH,
            Self::Density => UnitDimension::mass_density(3),
            _ => return None,
        })
    }
}

impl JsonSchema for Role {
    fn schema_name() -> Cow<'static, str> {
        "Role".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let names: Vec<&str> = Self::names().collect();
        json_schema!({ "description": "What a variable is.", "type": "string", "enum": names })
    }
}

impl TryFrom<String> for Role {
    type Error = String;

    fn try_from(name: String) -> std::result::Result<Self, String> {
        Self::parse(&name)
    }
}

impl From<Role> for String {
    fn from(role: Role) -> Self {
        role.name().to_owned()
    }
}

/// `NAME=ROLE` of the command line.
///
/// # Errors
/// What is missing, or a role that is none.
pub fn parse_mapping(text: &str) -> Result<(String, Role)> {
    let (name, role) = text
        .rsplit_once('=')
        .filter(|(name, _)| !name.trim().is_empty())
        .ok_or_else(|| Error::scene("--map", format!("is '{text}', expected NAME=ROLE, as in vel1=velocity-x")))?;
    let role = Role::parse(role).map_err(|problem| Error::scene("--map", problem))?;
    Ok((name.trim().to_owned(), role))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_role_has_one_name_that_reads_back() {
        for (i, (name, role)) in NAMES.iter().enumerate() {
            assert_eq!(Role::parse(name), Ok(*role));
            assert_eq!(role.name(), *name);
            assert!(NAMES[..i].iter().all(|(other, _)| other != name));
        }
        assert_eq!(Role::parse("Velocity_X"), Ok(Role::Vector(Vector::Velocity, Part::X)));
    }

    #[test]
    fn mappings_are_read_and_others_refused() {
        assert_eq!(parse_mapping("vel1 = velocity-x").unwrap().0, "vel1");
        assert_eq!(parse_mapping("a=b=pressure").unwrap(), ("a=b".to_owned(), Role::Pressure));
        for (text, part) in [("vel1", "NAME=ROLE"), ("=density", "NAME=ROLE"), ("a=velocty", "did you mean 'velocity'")]
        {
            let error = parse_mapping(text).unwrap_err().to_string();
            assert!(error.contains(part) && error.contains("--map"), "{error}");
        }
    }
}
