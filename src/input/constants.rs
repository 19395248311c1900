//! Constants of nature and named units, as numbers in a scene's own units.
//!
//! Values are those of CODATA 2022, in cgs; `mH` is the hydrogen atom of 1.007 825 032 u (AME2020).

use crate::error::{Error, Result as Outcome};
use crate::field::{AnalyticField, Expression, Names};
use crate::scene::{Conversion, Quantity, Scene};
use sph_formats::{Unit, UnitDimension, UnitSystem};

/// Newton's constant in cm^3 g^-1 s^-2 (CODATA 2022).
pub use sph_formats::units::GRAVITATIONAL_CONSTANT_CGS as GRAVITATIONAL_CONSTANT;

/// Name, value in cgs and dimension; the constant of gravity is the scene's.
const CONSTANTS: &[(&str, f64, UnitDimension)] = &[
    ("kB", 1.380_649e-16, UnitDimension::new(2, 1, -2, -1)),
    ("mH", 1.673_532_84e-24, UnitDimension::MASS),
    ("mp", 1.672_621_925_95e-24, UnitDimension::MASS),
    ("me", 9.109_383_713_9e-28, UnitDimension::MASS),
    ("c", 2.997_924_58e10, UnitDimension::VELOCITY),
    ("hbar", 1.054_571_817e-27, UnitDimension::new(2, 1, -1, 0)),
    ("sigmaSB", 5.670_374_419e-5, UnitDimension::new(0, 1, -3, -4)),
    ("aR", 7.565_733_25e-15, UnitDimension::new(-1, 1, -2, -4)),
];

const GRAVITY: UnitDimension = UnitDimension::new(3, -1, -2, 0);

/// The number that `name` stands for in `system`, with `gravity` the constant of gravity in cgs, or in numbers without
/// units. An error where it needs units that there are not; `None` for a name that is no constant.
pub(crate) fn constant(name: &str, system: Option<&UnitSystem>, gravity: f64) -> Option<Result<f64, String>> {
    if name == "G" {
        return Some(Ok(system.map_or(gravity, |s| gravity / s.to_cgs(GRAVITY))));
    }
    let listed = CONSTANTS.iter().find(|c| c.0 == name).map(|c| (c.1, c.2));
    // Powers are for the expression to take: only bare names are units here.
    let is_bare = name.chars().all(|c| c.is_ascii_alphabetic() || c == '_');
    let unit = || Unit::parse(name).filter(|_| is_bare && !name.is_empty()).map(|u| (u.to_cgs, u.dimension));
    let (cgs, dimension) = listed.or_else(unit)?;
    Some(match system {
        Some(system) => Ok(cgs / system.to_cgs(dimension)),
        None if dimension == UnitDimension::NONE => Ok(cgs),
        None => Err(format!(
            "'{name}' has a unit, but the input has none: state `units`, as in `units: solar`, or write a number"
        )),
    })
}

/// Newton's constant in cgs, as the code that the scene is for has it.
pub(crate) fn gravity_in_cgs(scene: &Scene) -> f64 {
    scene.code().map_or(GRAVITATIONAL_CONSTANT, |code| code.sheet.gravity)
}

/// The constant of gravity of a scene: in cgs where there are units, else the number that the scene says.
pub(crate) fn gravity(scene: &Scene, has_units: bool) -> f64 {
    if has_units { gravity_in_cgs(scene) } else { scene.balance.on().cloned().unwrap_or_default().constant }
}

/// What names stand for in the expressions of a scene, whose numbers are in `system`.
#[derive(Clone, Copy)]
pub(crate) struct Constants {
    pub system: Option<UnitSystem>,
    gravity: f64,
}

impl Constants {
    pub fn new(scene: &Scene, system: Option<UnitSystem>) -> Self {
        Self { system, gravity: gravity(scene, system.is_some()) }
    }

    /// An expression of the coordinates and of `others`, which knows constants and units.
    ///
    /// # Errors
    /// As for [`Expression::parse`].
    pub fn expression<const D: usize>(&self, key: &str, text: &str, others: &[&str]) -> Outcome<Expression> {
        let constants = |name: &str| constant(name, self.system.as_ref(), self.gravity);
        Expression::parse_with(key, text, Names { dimension: D, others, constants: &constants })
    }

    /// The text of an expression, which is `text` but for a number of `dimension` with its unit, such as `1e-6 G`.
    ///
    /// # Errors
    /// A unit of another dimension, or one where there are none; the constant of gravity in a magnetic field.
    pub fn number(&self, key: &str, text: &str, dimension: UnitDimension) -> Outcome<String> {
        let quantity = Quantity::Text(text.trim().to_owned());
        if quantity.dimension().is_none() {
            let is_magnetic = UnitDimension { length: UnitDimension::MAGNETIC_FIELD.length, ..dimension }
                == UnitDimension::MAGNETIC_FIELD;
            let mut words = text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
            if is_magnetic && words.any(|word| word == "G") {
                let problem = "has 'G', which in an expression is the constant of gravity; write `gauss`, as in '1e-6*gauss*sin(x)'";
                return Err(Error::scene(key, problem));
            }
            return Ok(text.to_owned());
        }
        let conversion = Conversion::new(self.system, self.system.unwrap_or(UnitSystem::CODE));
        Ok(format!("{:e}", quantity.value(key, dimension, &conversion)?))
    }

    /// A density or a resolution as a field: an expression, or a number of `dimension` with its unit.
    ///
    /// # Errors
    /// As for [`Self::expression`] and [`Self::number`].
    pub fn field<const D: usize>(
        &self,
        (key, text): (&str, &str),
        dimension: UnitDimension,
        center: [f64; D],
    ) -> Outcome<AnalyticField<D>> {
        let text = self.number(key, text, dimension)?;
        Ok(AnalyticField::with(self.expression::<D>(key, &text, &[])?, center))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constants_follow_the_units_of_the_scene() {
        let si = UnitSystem::si();
        let value = |name: &str| constant(name, Some(&si), 6.674_30e-8).unwrap().unwrap();
        for (name, expected) in
            [("G", 6.674_30e-11), ("kB", 1.380_649e-23), ("c", 2.997_924_58e8), ("km", 1e3), ("aR", 7.565_733_25e-16)]
        {
            assert!((value(name) / expected - 1.0).abs() < 1e-12, "{name}: {}", value(name));
        }
        // a = 4 sigma / c.
        assert!((4.0 * value("sigmaSB") / value("c") / value("aR") - 1.0).abs() < 1e-8);
    }

    #[test]
    fn without_units_only_gravity_has_a_number() {
        assert_eq!(constant("G", None, 2.0), Some(Ok(2.0)));
        assert!(constant("kB", None, 1.0).unwrap().unwrap_err().contains("units: solar"));
        assert_eq!(constant("furlong", None, 1.0), None);
        assert_eq!(constant("m2", None, 1.0), None);
    }
}
