//! Values of options that take one of several words; the words are those of the scene.

use crate::seeding::{METHODS, Seeding};
use serde::Deserialize;
use serde::de::IntoDeserializer;
use sph::kernel::KernelName;
use sph_formats::did_you_mean;
use std::fmt;

/// One of several words.
fn among<T: Copy>(text: &str, known: &[(&str, T)]) -> Result<T, String> {
    let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
    known.iter().find(|(name, _)| *name == text).map(|(_, value)| *value).ok_or_else(|| expected(text, &names))
}

fn expected(text: &str, names: &[&str]) -> String {
    format!("expected {}{}", names.join(", "), did_you_mean(text, names.iter().copied()))
}

pub fn kernel(text: &str) -> Result<KernelName, String> {
    among(text, &KernelName::ALL.map(|kernel| (kernel.name(), kernel)))
}

pub fn seeding(text: &str) -> Result<Seeding, String> {
    Seeding::by_name(text)
        .map_or_else(|| among(text, &METHODS.iter().map(|m| (m.name, m.seeding)).collect::<Vec<_>>()), Ok)
}

/// A value of a scene that is one of several words, by the word that the scene has for it.
pub fn choice<T: for<'de> Deserialize<'de>>(text: &str) -> Result<T, String> {
    T::deserialize(text.into_deserializer()).map_err(|Unknown(names)| expected(text, names))
}

/// The words that there are.
#[derive(Debug)]
struct Unknown(&'static [&'static str]);

impl fmt::Display for Unknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "expected {}", self.0.join(", "))
    }
}

impl std::error::Error for Unknown {}

impl serde::de::Error for Unknown {
    fn custom<T: fmt::Display>(_: T) -> Self {
        Self(&[])
    }

    fn unknown_variant(_: &str, expected: &'static [&'static str]) -> Self {
        Self(expected)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{BoundaryName, Polish};

    #[test]
    fn words_are_those_of_scenes() {
        assert_eq!(choice::<Polish>("damped-relaxation"), Ok(Polish::DampedRelaxation));
        assert_eq!(choice::<BoundaryName>("open"), Ok(BoundaryName::Open));
        let said = choice::<Polish>("solvr").unwrap_err();
        assert_eq!(said, "expected solver, alaric, damped-relaxation, afc, none; did you mean 'solver'?");
    }
}
