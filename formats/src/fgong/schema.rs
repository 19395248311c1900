//! The variables of each version, and the line by which a file is recognized.

use crate::common::fixed_width::is_numbers;

pub const NAME: &str = "fgong";

/// Lines of text before the sizes.
pub const HEADER_LINES: usize = 4;
/// Numbers on a line.
pub const PER_LINE: usize = 5;
/// Most variables of a point or of a model that make sense.
const MOST: usize = 1000;

/// The line of sizes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    pub points: usize,
    pub globals: usize,
    pub variables: usize,
    pub version: u32,
}

impl Sizes {
    /// From the fifth line; `None` where it is none.
    pub fn parse(line: &str) -> Option<Self> {
        let numbers: Option<Vec<u64>> = line.split_whitespace().map(|f| f.parse().ok()).collect();
        let [points, globals, variables, version] = *numbers? else { return None };
        let small = |n: u64, least: usize| usize::try_from(n).ok().filter(|n| (least..=MOST).contains(n));
        Some(Self {
            points: usize::try_from(points).ok()?,
            globals: small(globals, 3)?,
            variables: small(variables, 5)?,
            version: u32::try_from(version).ok()?,
        })
    }
}

/// Whether a text begins with four lines of anything, the sizes and a line of numbers.
pub fn is_model(text: &str) -> bool {
    let mut lines = text.lines().skip(HEADER_LINES);
    let sizes = lines.next().and_then(Sizes::parse);
    let first = lines.next();
    sizes.zip(first).is_some_and(|(sizes, line)| is_numbers(line, sizes.globals.min(PER_LINE)))
}

/// Variables from 0 that every version has: name, unit, number.
#[cfg(feature = "fgong")]
pub const COMMON: &[(&str, &str, usize)] = &[
    ("temperature", "K", 2),
    ("pressure", "dyn/cm^2", 3),
    ("density", "g/cm^3", 4),
    ("x_mass_fraction_H", "1", 5),
    ("luminosity", "erg/s", 6),
    ("opacity", "cm^2/g", 7),
    ("energy_generation", "erg/g/s", 8),
    ("gamma_1", "", 9),
    ("nabla_ad", "", 10),
    ("delta", "", 11),
    ("specific_heat_p", "erg/g/K", 12),
    ("electrons_per_nucleon", "", 13),
];

/// What else a version has, without the thousands that tell how its numbers are written; `None` for an unknown one.
#[cfg(feature = "fgong")]
pub fn further(version: u32) -> Option<Vec<(&'static str, &'static str, usize)>> {
    const METALS: (&str, &str, usize) = ("z_mass_fraction_metals", "1", 16);
    const CNO: [(&str, &str, usize); 5] =
        [("he3", "1", 20), ("c12", "1", 21), ("c13", "1", 22), ("n14", "1", 23), ("o16", "1", 24)];
    const LIGHT: [(&str, &str, usize); 8] = [
        ("h2", "1", 28),
        ("he4", "1", 29),
        ("li7", "1", 30),
        ("be7", "1", 31),
        ("n15", "1", 32),
        ("o17", "1", 33),
        ("o18", "1", 34),
        ("ne20", "1", 35),
    ];
    let mut all = Vec::new();
    match version % 1000 {
        100 => {}
        200 => all.extend(CNO),
        210 | 250 => all.extend([METALS].into_iter().chain(CNO)),
        300 => all.extend([METALS].into_iter().chain(CNO).chain(LIGHT)),
        _ => return None,
    }
    Some(all)
}
