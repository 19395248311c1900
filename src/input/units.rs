//! The units of the numbers of an input and of its scene.
//!
//! Plain numbers of a scene are in its `units`, by default those of the input: its unit of length, the mass in a cube of
//! that length at its unit of density, and the second, or for particle files their unit of time. Where neither states any,
//! they are the input's numbers and those of the output, whatever `output.units` calls them.

use crate::error::{Error, Result};
use crate::scene::{Conversion, Scene, system_of};
use sph_formats::{Unit, UnitDimension, UnitSystem};

/// Factors from the input's numbers to cgs, where both are known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InputUnits {
    pub length: f64,
    /// Mass per volume in 3-D.
    pub density: f64,
    /// Particle files state one; for others it is the second.
    pub time: f64,
}

impl InputUnits {
    /// The system of which these are units.
    pub fn system(&self) -> UnitSystem {
        UnitSystem { length: self.length, mass: self.density * self.length.powi(3), time: self.time, temperature: 1.0 }
    }
}

/// The unit that a key of the scene names.
///
/// # Errors
/// No unit, or one of something else.
pub fn named_unit(key: &str, name: Option<&str>, dimension: UnitDimension) -> Result<Option<Unit>> {
    let Some(name) = name else { return Ok(None) };
    match Unit::parse(name) {
        Some(unit) if unit.dimension == dimension => Ok(Some(unit)),
        Some(_) => Err(Error::scene(key, format!("'{name}' is a unit of another quantity"))),
        None => Err(Error::scene(
            key,
            format!("'{name}' is not a known unit; write for example {}", Unit::known(dimension).join(", ")),
        )),
    }
}

/// Units of a run, where they are known.
#[derive(Debug, Clone, Copy)]
pub struct RunUnits {
    pub input: Option<InputUnits>,
    /// Of plain numbers in the scene.
    scene: Option<UnitSystem>,
    /// Whether these are no more than what a model of numbers with units is computed in.
    is_unsaid: bool,
}

impl RunUnits {
    /// The scene's statement over the input's.
    ///
    /// # Errors
    /// A name that is none.
    pub fn new(scene: &Scene, input: Option<InputUnits>) -> Result<Self> {
        let written = scene.output.units.as_deref().filter(|name| input.is_none() && *name != "code");
        let own = match (scene.stated_units()?, written) {
            (Some(system), _) => Some(system),
            (None, Some(name)) => Some(system_of("output.units", name)?),
            (None, None) => input.map(|units| units.system()),
        };
        let is_unsaid = scene.stated_units()?.is_none()
            && match input {
                Some(_) => scene.input.has_profile_with_units(),
                // The units of the output would be those of the plain numbers beside others.
                None => written.is_some() && scene.has_quantities_with_units(),
            };
        Ok(Self { input, scene: own, is_unsaid })
    }

    /// Whether length and density of the input are in the units of the scene's numbers.
    pub fn are_the_scenes(&self) -> bool {
        let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
        let is_same = |(input, own): (InputUnits, UnitSystem)| {
            near(own.length, input.length) && near(own.to_cgs(UnitDimension::mass_density(3)), input.density)
        };
        self.input.zip(self.scene).is_some_and(is_same)
    }

    /// To the input's numbers, in which domains are.
    pub fn to_input(self) -> Conversion {
        let to = self.input.map(|units| units.system()).or(self.scene);
        self.conversion(to.unwrap_or(UnitSystem::CODE))
    }

    /// To the numbers of the output.
    pub fn to_output(self, out: &UnitSystem) -> Conversion {
        self.conversion(*out)
    }

    /// To cgs, or to the input's numbers where it has no units.
    pub fn to_cgs(self) -> Conversion {
        match self.input {
            Some(_) => self.conversion(UnitSystem::cgs()),
            None => self.to_input(),
        }
    }

    fn conversion(&self, to: UnitSystem) -> Conversion {
        Conversion { is_unsaid: self.is_unsaid, ..Conversion::new(self.scene, to) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sph_formats::UnitDimension;

    /// Of a scene that names its own units, and those of the output.
    fn scene(own: Option<&str>, output: Option<&str>) -> Scene {
        let mut scene = Scene { units: own.map(str::to_owned), ..Scene::default() };
        scene.output.units = output.map(str::to_owned);
        scene
    }

    fn units(own: Option<&str>, output: Option<&str>, input: Option<InputUnits>) -> RunUnits {
        RunUnits::new(&scene(own, output), input).unwrap()
    }

    const CGS: InputUnits = InputUnits { length: 1.0, density: 1.0, time: 1.0 };

    #[test]
    fn plain_numbers_are_the_inputs_for_all_keys_alike() {
        let run = units(None, Some("solar"), Some(CGS));
        assert_eq!(run.to_input().factor(UnitDimension::LENGTH), 1.0);
        let out = run.to_output(&UnitSystem::solar());
        assert!((out.factor(UnitDimension::LENGTH) * 6.957e10 - 1.0).abs() < 1e-14);
        // One cm/s in units of sqrt(G Msun / Rsun).
        let speed = 1.0 / out.factor(UnitDimension::VELOCITY);
        assert!((speed / (1.327_124_4e26_f64 / 6.957e10).sqrt() - 1.0).abs() < 1e-12, "{speed:e}");
    }

    #[test]
    fn the_scene_may_state_others() {
        let run = units(Some("solar"), None, Some(CGS));
        assert_eq!(run.to_input().factor(UnitDimension::LENGTH), 6.957e10);
        assert_eq!(run.to_output(&UnitSystem::solar()).factor(UnitDimension::VELOCITY), 1.0);
    }

    #[test]
    fn numbers_without_units_stay_as_they_are() {
        for output in [None, Some("code"), Some("solar")] {
            let run = units(None, output, None);
            for conversion in [run.to_input(), run.to_cgs()] {
                assert_eq!(conversion.factor(UnitDimension::VELOCITY), 1.0, "{output:?}");
            }
        }
        let named = units(None, Some("solar"), None);
        assert_eq!(named.to_output(&UnitSystem::solar()).factor(UnitDimension::VELOCITY), 1.0);
        // What the output calls its numbers says what a unit in the scene is worth.
        assert!(named.to_input().from.is_some());
        assert!(units(None, Some("code"), None).to_input().from.is_none());
    }

    #[test]
    fn unknown_names_are_refused_with_a_guess() {
        for (name, part) in [("sollar", "did you mean 'solar'"), ("code", "says nothing"), ("imperial", "expected cgs")]
        {
            let error = RunUnits::new(&scene(Some(name), None), None).unwrap_err().to_string();
            assert!(error.starts_with("scene, units: ") && error.contains(part), "{error}");
        }
    }
}
