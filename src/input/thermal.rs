//! Thermal fields of an ideal gas: which of them are given, the energy that follows, and whether they agree.
//!
//! P = (gamma - 1) rho u = A rho^gamma, and u = kB T / ((gamma - 1) mu mH), where A is the entropic function. Where gas carries dust, rho is that of
//! the gas alone: dust has no pressure.

use crate::error::{Error, Result};
use sph_formats::UnitDimension;
use sph_formats::common::particle_names as names;

pub(crate) const PRESSURE: &str = "pressure";
pub(crate) const TEMPERATURE: &str = "temperature";
pub(crate) const INTERNAL_ENERGY: &str = "internal_energy";
pub(crate) const ENTROPY: &str = "entropy";
pub(crate) const MEAN_MOLECULAR_WEIGHT: &str = "mean_molecular_weight";
const DUST_FRACTION: &str = "dust_fraction";
/// How the expression of an energy by a temperature begins.
pub(crate) const OF_TEMPERATURE: &str = "kB*";

/// Thermal fields may disagree by this much of the energy: they come with four digits, or from tables.
const AGREEMENT: f64 = 1e-3;

/// The name by which expressions know a thermal field.
pub(crate) fn name_of(name: &str) -> Option<&'static str> {
    Some(match names::standard(name).unwrap_or(name) {
        names::PRESSURE => PRESSURE,
        names::TEMPERATURE => TEMPERATURE,
        names::INTERNAL_ENERGY => INTERNAL_ENERGY,
        ENTROPY => ENTROPY,
        _ => return None,
    })
}

/// What a thermal field is measured in; `None` for what is none.
pub(crate) fn dimension_of(name: &str) -> Option<UnitDimension> {
    Some(match name_of(name)? {
        PRESSURE => UnitDimension::PRESSURE,
        TEMPERATURE => UnitDimension::TEMPERATURE,
        INTERNAL_ENERGY => UnitDimension::SPECIFIC_ENERGY,
        _ => UnitDimension::NONE,
    })
}

/// Thermal fields, those of the scene first.
pub(crate) struct Known {
    /// Name, and whether the scene states it.
    fields: Vec<(&'static str, bool)>,
    has_weight: bool,
    has_dust: bool,
}

impl Known {
    /// By whether the scene states a field of a name, and whether there is one at all.
    pub fn new(is_stated: impl Fn(&str) -> bool, is_known: impl Fn(&str) -> bool) -> Self {
        let all = [INTERNAL_ENERGY, PRESSURE, ENTROPY, TEMPERATURE];
        let mut fields: Vec<_> = all.into_iter().filter(|n| is_known(n)).map(|n| (n, is_stated(n))).collect();
        fields.sort_by_key(|f| !f.1);
        Self { fields, has_weight: is_known(MEAN_MOLECULAR_WEIGHT), has_dust: is_known(DUST_FRACTION) }
    }

    /// The first by which there is an energy, and its expression.
    pub fn energy(&self, gamma: f64) -> Option<(&'static str, String)> {
        self.comparable().next().map(|name| (name, self.expression(name, gamma)))
    }

    /// Those that give an energy.
    fn comparable(&self) -> impl Iterator<Item = &'static str> + '_ {
        self.fields.iter().map(|f| f.0).filter(|name| *name != TEMPERATURE || self.has_weight)
    }

    /// Those that give an energy but the energy itself, and its expressions by them.
    pub fn besides_energy(&self, gamma: f64) -> Vec<(&'static str, String)> {
        let others = self.comparable().filter(|name| *name != INTERNAL_ENERGY);
        others.map(|name| (name, self.expression(name, gamma))).collect()
    }

    /// The expression of the specific internal energy by one field.
    fn expression(&self, name: &str, gamma: f64) -> String {
        let rho = if self.has_dust { format!("(rho*(1 - {DUST_FRACTION}))") } else { "rho".to_owned() };
        match name {
            PRESSURE => format!("{PRESSURE}/(({gamma:?} - 1)*{rho})"),
            ENTROPY => format!("{ENTROPY}*{rho}^({gamma:?} - 1)/({gamma:?} - 1)"),
            TEMPERATURE => format!("{OF_TEMPERATURE}{TEMPERATURE}/(({gamma:?} - 1)*{MEAN_MOLECULAR_WEIGHT}*mH)"),
            _ => INTERNAL_ENERGY.to_owned(),
        }
    }

    /// The first that the scene states.
    pub fn stated(&self) -> Option<&'static str> {
        self.fields.iter().find(|f| f.1).map(|f| f.0)
    }
}

/// The energy of an entropy or a temperature that the scene states, where it states none itself and no pressure, from which
/// the energy follows without this. A file's temperature gives one where nothing else does and the mean molecular weight is
/// known.
///
/// # Errors
/// A temperature without a mean molecular weight.
pub(crate) fn derived_energy(known: &Known, gamma: f64) -> Result<Option<String>> {
    let stated: Vec<&str> = known.fields.iter().filter(|f| f.1).map(|f| f.0).collect();
    if stated.is_empty() {
        let only_temperature = known.fields.iter().all(|f| f.0 == TEMPERATURE) && !known.fields.is_empty();
        return Ok((only_temperature && known.has_weight).then(|| known.expression(TEMPERATURE, gamma)));
    }
    if stated.contains(&INTERNAL_ENERGY) || stated.contains(&PRESSURE) {
        return Ok(None);
    }
    if stated.contains(&ENTROPY) {
        return Ok(Some(known.expression(ENTROPY, gamma)));
    }
    if !known.has_weight {
        return Err(Error::scene(
            "fields.temperature",
            "gives no energy without a mean molecular weight; add fields.mean_molecular_weight (0.6 for ionized gas of solar \
             composition, 2.3 for molecular gas)",
        ));
    }
    Ok(Some(known.expression(TEMPERATURE, gamma)))
}

/// Names of fields and expressions of the energies that they give, to be compared: where the scene states one of them, and
/// another is known.
pub(crate) fn energies(known: &Known, gamma: f64) -> Vec<(&'static str, String)> {
    if !known.fields.iter().any(|f| f.1) {
        return Vec::new();
    }
    known.comparable().map(|name| (name, known.expression(name, gamma))).collect()
}

/// Compares the energies that two fields give.
///
/// # Errors
/// What is wrong.
pub(crate) fn compare((one, a): (&str, f64), (other, b): (&str, f64), gamma: f64) -> std::result::Result<(), String> {
    if (a - b).abs() <= AGREEMENT * a.abs().max(b.abs()) {
        return Ok(());
    }
    Err(format!(
        "disagrees with {other}: by {one} the specific internal energy is {a:.6e}, by {other} {b:.6e}, with thermal.gamma = {gamma:.4}; \
         leave one out (input.carry chooses a file's columns)"
    ))
}
