//! The two lines by which a model is recognized.

use crate::common::fixed_width::is_numbers;

pub const NAME: &str = "wdec";

/// Numbers on a line.
pub const PER_LINE: usize = 4;
/// Arrays of a model.
#[cfg(feature = "wdec")]
pub const ARRAYS: usize = 20;

/// Points of a model from its second line, `shells = core + envelope ...`; `None` where it is no such line.
pub fn points(line: &str) -> Option<usize> {
    let fields: Vec<&str> = line.split_whitespace().collect();
    let [all, "=", core, "+", envelope, ..] = *fields.as_slice() else { return None };
    let number = |text: &str| text.parse::<u32>().ok().map(|n| n as usize);
    let all = number(all)?;
    (number(core)?.checked_add(number(envelope)?)? == all).then_some(all)
}

/// Whether a text begins with a line of anything, the points and a line of numbers.
pub fn is_model(text: &str) -> bool {
    let mut lines = text.lines().skip(1);
    let points = lines.next().and_then(points);
    points.zip(lines.next()).is_some_and(|(points, line)| is_numbers(line, points.clamp(1, PER_LINE)))
}

/// Arrays that mean something on particles: name, unit, number from 0.
#[cfg(feature = "wdec")]
pub const CARRIED: &[(&str, &str, usize)] = &[
    ("luminosity", "erg/s", 2),
    ("temperature", "K", 3),
    ("density", "g/cm^3", 4),
    ("pressure", "dyn/cm^2", 5),
    ("energy_generation", "erg/g/s", 6),
    ("specific_heat_v", "erg/g/K", 7),
    ("chi_rho", "", 8),
    ("chi_t", "", 9),
    ("nabla", "", 14),
    ("nabla_ad", "", 15),
    ("y_mass_fraction_He", "1", 16),
    ("opacity", "cm^2/g", 17),
    ("ledoux_term", "", 18),
];
