//! Units of input and output: those that a file states, and the system in which particles are written.
//!
//! Solar and terrestrial values are the nominal ones of IAU 2015 resolution B3 (GM and radii) over the CODATA
//! 2018 constant of gravity; astronomical unit and parsec are exact (IAU 2012 B2, 2015 B2).

use crate::nearest::nearest;

/// Newton's constant, cm^3 g^-1 s^-2 (CODATA 2018).
pub const GRAVITATIONAL_CONSTANT_CGS: f64 = 6.674_30e-8;
/// g.
pub const SOLAR_MASS_CGS: f64 = 1.327_124_4e26 / GRAVITATIONAL_CONSTANT_CGS;
/// cm.
pub const SOLAR_RADIUS_CGS: f64 = 6.957e10;
/// g.
pub const EARTH_MASS_CGS: f64 = 3.986_004e20 / GRAVITATIONAL_CONSTANT_CGS;
/// cm, equatorial.
pub const EARTH_RADIUS_CGS: f64 = 6.378_1e8;
/// g.
const JUPITER_MASS_CGS: f64 = 1.266_865_3e23 / GRAVITATIONAL_CONSTANT_CGS;
/// cm, equatorial.
const JUPITER_RADIUS_CGS: f64 = 7.149_2e9;
/// erg/s.
const SOLAR_LUMINOSITY_CGS: f64 = 3.828e33;
const AU_CGS: f64 = 1.495_978_707e13;
const PARSEC_CGS: f64 = 3.085_677_581_491_367_3e18;
/// CODATA 2018.
const ATOMIC_MASS_CGS: f64 = 1.660_539_066_60e-24;
const YEAR_CGS: f64 = 3.155_76e7;

/// Exponents of length, mass, time, temperature and magnetic field.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct UnitDimension {
    pub length: i8,
    pub mass: i8,
    pub time: i8,
    pub temperature: i8,
    /// A dimension of its own: the gauss is the root of a unit of pressure, which has no whole exponents.
    pub magnetic: i8,
}

impl UnitDimension {
    pub const NONE: Self = Self::new(0, 0, 0, 0);
    pub const LENGTH: Self = Self::new(1, 0, 0, 0);
    pub const MASS: Self = Self::new(0, 1, 0, 0);
    pub const TIME: Self = Self::new(0, 0, 1, 0);
    pub const TEMPERATURE: Self = Self::new(0, 0, 0, 1);
    pub const VELOCITY: Self = Self::new(1, 0, -1, 0);
    pub const SPECIFIC_ENERGY: Self = Self::new(2, 0, -2, 0);
    pub const PRESSURE: Self = Self::new(-1, 1, -2, 0);
    /// Magnetic flux density.
    pub const MAGNETIC_FIELD: Self = Self { magnetic: 1, ..Self::new(0, 0, 0, 0) };
    /// Per time: an angular velocity.
    pub const RATE: Self = Self::new(0, 0, -1, 0);

    pub const fn new(length: i8, mass: i8, time: i8, temperature: i8) -> Self {
        Self { length, mass, time, temperature, magnetic: 0 }
    }

    /// Mass per unit volume in `d` dimensions.
    pub const fn mass_density(d: usize) -> Self {
        Self::new(-(d as i8), 1, 0, 0)
    }

    /// What is measured so, with its article; `None` for what has no usual name.
    pub fn name(self) -> Option<&'static str> {
        Some(match self {
            Self::NONE => "a pure number",
            Self::LENGTH => "a length",
            Self::MASS => "a mass",
            Self::TIME => "a time",
            Self::TEMPERATURE => "a temperature",
            Self::VELOCITY => "a velocity",
            Self::SPECIFIC_ENERGY => "a specific energy",
            Self::PRESSURE => "a pressure",
            Self::RATE => "an angular velocity",
            Self::MAGNETIC_FIELD => "a magnetic field",
            ENERGY => "an energy",
            FORCE => "a force",
            POWER => "a power",
            d if d == Self::mass_density(3) => "a density",
            d if d == Self::mass_density(2) => "a surface density",
            _ => return None,
        })
    }

    fn raised(self, n: i8) -> Option<Self> {
        Some(Self {
            length: self.length.checked_mul(n)?,
            mass: self.mass.checked_mul(n)?,
            time: self.time.checked_mul(n)?,
            temperature: self.temperature.checked_mul(n)?,
            magnetic: self.magnetic.checked_mul(n)?,
        })
    }

    fn times(self, other: Self) -> Option<Self> {
        Some(Self {
            length: self.length.checked_add(other.length)?,
            mass: self.mass.checked_add(other.mass)?,
            time: self.time.checked_add(other.time)?,
            temperature: self.temperature.checked_add(other.temperature)?,
            magnetic: self.magnetic.checked_add(other.magnetic)?,
        })
    }
}

/// A unit as stated by a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// As written, e.g. `kg m-3`.
    pub symbol: String,
    /// How many cgs (cm, g, s, K) units one of it is.
    pub to_cgs: f64,
    pub dimension: UnitDimension,
}

impl Unit {
    /// Reads the usual spellings: `kg m-3`, `kg/m^3`, `g cm**-3`, `g/cc`, `km/s`, `Msun`, `erg g-1`, `J/kg`.
    /// Numbers are factors, as in `1e-3 kg m-3`. An empty text or `1` is dimensionless. `None` where any part is not understood.
    pub fn parse(text: &str) -> Option<Self> {
        let symbol = text.trim().to_owned();
        let spaced = points_spaced(&symbol.replace("**", "^").replace('/', " / ").replace(['*', '·'], " "));
        let (mut to_cgs, mut dimension, mut sign) = (1.0, UnitDimension::NONE, 1);
        for token in spaced.split_whitespace() {
            if token == "/" {
                // Everything behind a slash divides, as in `erg/g/s` and `erg/g s`.
                sign = -1;
                continue;
            }
            if let Some(number) = factor(token) {
                to_cgs *= f64::powi(number, sign);
                continue;
            }
            let (name, power) = split_power(token)?;
            let (factor, base) = symbol_value(name)?;
            let power = power.checked_mul(sign as i8)?;
            to_cgs *= f64::powi(factor, power.into());
            dimension = dimension.times(base.raised(power)?)?;
        }
        (to_cgs.is_finite() && to_cgs > 0.0).then_some(Self { symbol, to_cgs, dimension })
    }
}

/// A point multiplies, unless it stands between digits.
fn points_spaced(text: &str) -> String {
    let digit = |b: Option<&u8>| b.is_some_and(u8::is_ascii_digit);
    let bytes = text.as_bytes();
    let is_product = |i: usize| !(i > 0 && digit(bytes.get(i - 1)) && digit(bytes.get(i + 1)));
    text.char_indices().map(|(i, c)| if c == '.' && is_product(i) { ' ' } else { c }).collect()
}

/// A number that stands for itself, such as `6.957e10`.
fn factor(token: &str) -> Option<f64> {
    let value: f64 = token.parse().ok().filter(|_| token.starts_with(|c: char| c.is_ascii_digit()))?;
    (value.is_finite() && value > 0.0).then_some(value)
}

/// `m-3`, `m^-3`, `m3` and `m` into name and power.
fn split_power(token: &str) -> Option<(&str, i8)> {
    if token == "1" {
        return Some(("1", 1));
    }
    let end = token.find(|c: char| c == '^' || c == '-' || c == '+' || c.is_ascii_digit()).unwrap_or(token.len());
    let (name, power) = token.split_at(end);
    let power = power.trim_start_matches('^').trim_matches(|c| c == '(' || c == ')' || c == '{' || c == '}');
    let power = if power.is_empty() { 1 } else { power.parse().ok()? };
    (!name.is_empty()).then_some((name, power))
}

/// cgs factor and dimension of one symbol, with an SI prefix where that is usual.
fn symbol_value(name: &str) -> Option<(f64, UnitDimension)> {
    if let Some(found) = plain_symbol(name) {
        return Some(found);
    }
    const PREFIXES: [(&str, f64); 11] = [
        ("k", 1e3),
        ("M", 1e6),
        ("G", 1e9),
        ("T", 1e12),
        ("c", 1e-2),
        ("m", 1e-3),
        ("u", 1e-6),
        ("µ", 1e-6),
        ("μ", 1e-6),
        ("n", 1e-9),
        ("d", 1e-1),
    ];
    const PREFIXED: [&str; 18] = [
        "m", "g", "s", "Pa", "J", "N", "pc", "yr", "K", "meter", "metre", "G", "T", "gauss", "tesla", "bar", "eV", "L",
    ];
    PREFIXES.iter().find_map(|(prefix, factor)| {
        let base = name.strip_prefix(prefix).filter(|b| PREFIXED.contains(b))?;
        plain_symbol(base).map(|(value, dimension)| (factor * value, dimension))
    })
}

fn plain_symbol(name: &str) -> Option<(f64, UnitDimension)> {
    SYMBOLS.iter().find(|s| s.spellings.contains(&name)).map(|s| (s.to_cgs, s.dimension))
}

/// A unit with a name of its own.
struct Symbol {
    /// The first is the one to be recommended.
    spellings: &'static [&'static str],
    to_cgs: f64,
    dimension: UnitDimension,
}

const fn symbol(spellings: &'static [&'static str], to_cgs: f64, dimension: UnitDimension) -> Symbol {
    Symbol { spellings, to_cgs, dimension }
}

const ENERGY: UnitDimension = UnitDimension::new(2, 1, -2, 0);
const FORCE: UnitDimension = UnitDimension::new(1, 1, -2, 0);
const POWER: UnitDimension = UnitDimension::new(2, 1, -3, 0);

/// Everything that [`Unit::parse`] knows without a prefix.
const SYMBOLS: &[Symbol] = &[
    symbol(&["1", "rad"], 1.0, UnitDimension::NONE),
    symbol(&["cm", "centimeter", "centimeters"], 1.0, UnitDimension::LENGTH),
    symbol(&["m", "meter", "meters", "metre", "metres"], 1e2, UnitDimension::LENGTH),
    symbol(&["km", "kilometer", "kilometers"], 1e5, UnitDimension::LENGTH),
    symbol(&["Rearth", "R_earth", "earthRad", "R⊕"], EARTH_RADIUS_CGS, UnitDimension::LENGTH),
    symbol(&["Rjup", "R_jup", "jupiterRad", "RJ"], JUPITER_RADIUS_CGS, UnitDimension::LENGTH),
    symbol(&["Rsun", "R_sun", "Rsol", "rsun", "solRad", "R☉", "R⊙"], SOLAR_RADIUS_CGS, UnitDimension::LENGTH),
    symbol(&["au", "AU"], AU_CGS, UnitDimension::LENGTH),
    symbol(&["ly"], 9.460_730_472_580_8e17, UnitDimension::LENGTH),
    symbol(&["pc", "parsec"], PARSEC_CGS, UnitDimension::LENGTH),
    symbol(&["kpc"], 1e3 * PARSEC_CGS, UnitDimension::LENGTH),
    symbol(&["Mpc"], 1e6 * PARSEC_CGS, UnitDimension::LENGTH),
    symbol(&["g", "gram", "grams", "gm"], 1.0, UnitDimension::MASS),
    symbol(&["kg", "kilogram", "kilograms"], 1e3, UnitDimension::MASS),
    symbol(&["Mearth", "M_earth", "earthMass", "M⊕"], EARTH_MASS_CGS, UnitDimension::MASS),
    symbol(&["Mjup", "M_jup", "jupiterMass", "MJ"], JUPITER_MASS_CGS, UnitDimension::MASS),
    symbol(&["Msun", "M_sun", "Msol", "msun", "solMass", "M☉", "M⊙"], SOLAR_MASS_CGS, UnitDimension::MASS),
    symbol(&["amu"], ATOMIC_MASS_CGS, UnitDimension::MASS),
    symbol(&["cc"], 1.0, UnitDimension::new(3, 0, 0, 0)),
    symbol(&["L", "liter", "liters", "litre", "litres"], 1e3, UnitDimension::new(3, 0, 0, 0)),
    symbol(&["s", "sec", "second", "seconds"], 1.0, UnitDimension::TIME),
    symbol(&["min", "minute", "minutes"], 60.0, UnitDimension::TIME),
    // Not `h`, which in `kpc/h` is the Hubble parameter.
    symbol(&["hr", "hour", "hours"], 3_600.0, UnitDimension::TIME),
    symbol(&["day", "days"], 86_400.0, UnitDimension::TIME),
    symbol(&["yr", "year", "years"], YEAR_CGS, UnitDimension::TIME),
    symbol(&["kyr"], 1e3 * YEAR_CGS, UnitDimension::TIME),
    symbol(&["Myr"], 1e6 * YEAR_CGS, UnitDimension::TIME),
    symbol(&["Gyr"], 1e9 * YEAR_CGS, UnitDimension::TIME),
    symbol(&["K", "kelvin", "Kelvin"], 1.0, UnitDimension::TEMPERATURE),
    symbol(&["erg", "ergs"], 1.0, ENERGY),
    symbol(&["J", "joule", "joules"], 1e7, ENERGY),
    symbol(&["eV", "electronvolt", "electronvolts"], 1.602_176_634e-12, ENERGY),
    symbol(&["Lsun", "L_sun", "solLum", "L☉", "L⊙"], SOLAR_LUMINOSITY_CGS, POWER),
    symbol(&["W", "watt", "watts"], 1e7, POWER),
    symbol(&["dyn", "dyne", "dynes"], 1.0, FORCE),
    symbol(&["N"], 1e5, FORCE),
    symbol(&["Pa", "pascal"], 10.0, UnitDimension::PRESSURE),
    symbol(&["bar"], 1e6, UnitDimension::PRESSURE),
    symbol(&["atm"], 1.013_25e6, UnitDimension::PRESSURE),
    symbol(&["Ba", "barye"], 1.0, UnitDimension::PRESSURE),
    symbol(&["G", "gauss", "Gauss"], 1.0, UnitDimension::MAGNETIC_FIELD),
    symbol(&["T", "tesla", "Tesla"], 1e4, UnitDimension::MAGNETIC_FIELD),
];

/// Usual units that are made of several, by what they measure.
const COMPOSED: &[(&str, UnitDimension)] = &[
    ("cm/s", UnitDimension::VELOCITY),
    ("m/s", UnitDimension::VELOCITY),
    ("km/s", UnitDimension::VELOCITY),
    ("g/cm^3", UnitDimension::mass_density(3)),
    ("kg/m^3", UnitDimension::mass_density(3)),
    ("Msun/pc^3", UnitDimension::mass_density(3)),
    ("erg/g", UnitDimension::SPECIFIC_ENERGY),
    ("J/kg", UnitDimension::SPECIFIC_ENERGY),
    ("km^2/s^2", UnitDimension::SPECIFIC_ENERGY),
    ("rad/s", UnitDimension::RATE),
    ("rad/day", UnitDimension::RATE),
    ("km/s/pc", UnitDimension::RATE),
    ("g/cm^2", UnitDimension::new(-2, 1, 0, 0)),
    ("cm^2/s", UnitDimension::new(2, 0, -1, 0)),
];

impl Unit {
    /// Units of one dimension, as examples for messages; each is read by [`Unit::parse`].
    pub fn known(dimension: UnitDimension) -> Vec<&'static str> {
        let simple = SYMBOLS.iter().filter(|s| s.dimension == dimension).map(|s| s.spellings[0]);
        simple.chain(COMPOSED.iter().filter(|c| c.1 == dimension).map(|c| c.0)).collect()
    }

    /// `text` with the one symbol in it that is not understood replaced by the known one that is most like it.
    pub fn nearest(text: &str) -> Option<String> {
        let is_letter = |c: char| c.is_alphabetic() || c == '_';
        let mut words = text.split(|c: char| !is_letter(c)).filter(|w| !w.is_empty());
        let wrong = words.find(|word| symbol_value(word).is_none())?;
        let all = SYMBOLS.iter().flat_map(|s| s.spellings.iter().copied());
        let better = text.replacen(wrong, nearest(wrong, all)?, 1);
        Unit::parse(&better).map(|_| better)
    }
}

/// The units of a set of particles, in cgs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitSystem {
    pub length: f64,
    pub mass: f64,
    pub time: f64,
    pub temperature: f64,
}

impl UnitSystem {
    /// Dimensionless numbers, written as if cgs.
    pub const CODE: Self = Self { length: 1.0, mass: 1.0, time: 1.0, temperature: 1.0 };

    /// cm, g, s.
    pub fn cgs() -> Self {
        Self::CODE
    }

    /// m, kg, s.
    pub fn si() -> Self {
        Self { length: 1e2, mass: 1e3, time: 1.0, temperature: 1.0 }
    }

    /// Solar radius, solar mass, and the time in which the constant of gravity is 1 (1593 s).
    pub fn solar() -> Self {
        Self::gravitational(SOLAR_RADIUS_CGS, SOLAR_MASS_CGS)
    }

    /// Earth radius, Earth mass, and the time in which the constant of gravity is 1 (807 s).
    pub fn planetary() -> Self {
        Self::gravitational(EARTH_RADIUS_CGS, EARTH_MASS_CGS)
    }

    /// kpc, 1e10 solar masses, km/s: the default of GADGET.
    pub fn galactic() -> Self {
        let length = 1e3 * PARSEC_CGS;
        Self { length, mass: 1e10 * SOLAR_MASS_CGS, time: length / 1e5, temperature: 1.0 }
    }

    fn gravitational(length: f64, mass: f64) -> Self {
        let time = (length.powi(3) / (GRAVITATIONAL_CONSTANT_CGS * mass)).sqrt();
        Self { length, mass, time, temperature: 1.0 }
    }

    /// One of `cgs`, `si`, `solar`, `planetary`, `galactic`, `code`.
    pub fn by_name(name: &str) -> Option<Self> {
        Some(match name {
            "cgs" => Self::cgs(),
            "si" => Self::si(),
            "solar" => Self::solar(),
            "planetary" => Self::planetary(),
            "galactic" => Self::galactic(),
            "code" => Self::CODE,
            _ => return None,
        })
    }

    /// The unit of a quantity of dimension `d`, as [`Unit::parse`] reads it; empty for a pure number.
    pub fn symbol(&self, d: UnitDimension) -> String {
        let bases = [("g", d.mass), ("cm", d.length), ("s", d.time), ("K", d.temperature), ("gauss", d.magnetic)];
        let mut parts: Vec<String> = Vec::new();
        let factor = self.to_cgs(d);
        if factor != 1.0 {
            parts.push(format!("{factor:e}"));
        }
        parts.extend(bases.iter().filter(|(_, p)| *p != 0).map(|(name, power)| match power {
            1 => (*name).to_owned(),
            power => format!("{name}^{power}"),
        }));
        parts.join(" ")
    }

    /// The system's unit of a quantity.
    pub fn unit(&self, dimension: UnitDimension) -> Unit {
        Unit { symbol: self.symbol(dimension), to_cgs: self.to_cgs(dimension), dimension }
    }

    /// The factor from this system to cgs for a quantity of dimension `d`; magnetic fields of the system are those whose pressure is
    /// B^2/2 (Lorentz and Heaviside's), so that their unit is sqrt(4 pi) roots of that of pressure in gauss.
    pub fn to_cgs(&self, d: UnitDimension) -> f64 {
        self.length.powi(d.length.into())
            * self.mass.powi(d.mass.into())
            * self.time.powi(d.time.into())
            * self.temperature.powi(d.temperature.into())
            * if d.magnetic == 0 { 1.0 } else { self.gauss().powi(d.magnetic.into()) }
    }

    /// The field, in gauss, whose pressure B^2/(8 pi) is half a unit of pressure.
    fn gauss(&self) -> f64 {
        (4.0 * std::f64::consts::PI * self.to_cgs(UnitDimension::PRESSURE)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(text: &str, to_cgs: f64, dimension: UnitDimension) {
        let unit = Unit::parse(text).unwrap_or_else(|| panic!("'{text}' is not understood"));
        assert!((unit.to_cgs / to_cgs - 1.0).abs() < 1e-12, "{text}: {}", unit.to_cgs);
        assert_eq!(unit.dimension, dimension, "{text}");
    }

    #[test]
    fn units_for_messages_are_understood_and_of_their_dimension() {
        for (text, dimension) in COMPOSED.iter().copied() {
            assert_eq!(Unit::parse(text).map(|u| u.dimension), Some(dimension), "{text}");
        }
        for symbol in SYMBOLS {
            for spelling in symbol.spellings {
                check(spelling, symbol.to_cgs, symbol.dimension);
            }
            assert!(Unit::known(symbol.dimension).contains(&symbol.spellings[0]));
        }
    }

    #[test]
    fn misspelled_units_are_led_to_the_nearest() {
        for (text, better) in [
            ("Rsn", Some("Rsun")),
            ("MSUN", Some("Msun")),
            ("kms", Some("km")),
            ("Km/s", Some("km/s")),
            ("solar_radii", None),
            ("km/s", None),
        ] {
            assert_eq!(Unit::nearest(text).as_deref(), better, "{text}");
        }
    }

    #[test]
    fn usual_spellings_are_understood() {
        let density = UnitDimension::mass_density(3);
        for text in ["kg m-3", "kg/m^3", "kg m^-3", "kg m**-3", "kg*m^-3", "kg/m3"] {
            check(text, 1e-3, density);
        }
        for text in ["g/cc", "g cm-3", "g/cm^3", "g cm^{-3}"] {
            check(text, 1.0, density);
        }
        check("km/s", 1e5, UnitDimension::VELOCITY);
        check("J/kg", 1e4, UnitDimension::SPECIFIC_ENERGY);
        check("erg g-1", 1.0, UnitDimension::SPECIFIC_ENERGY);
        check("kg/L", 1.0, UnitDimension::mass_density(3));
        check("g/mL", 1.0, UnitDimension::mass_density(3));
        check("atm", 1.013_25e6, UnitDimension::PRESSURE);
        check("kbar", 1e9, UnitDimension::PRESSURE);
        check("keV", 1.602_176_634e-9, UnitDimension::new(2, 1, -2, 0));
        check("GPa", 1e10, UnitDimension::PRESSURE);
        check("dyn/cm2", 1.0, UnitDimension::PRESSURE);
        check("Msun", 1.327_124_4e26 / 6.674_30e-8, UnitDimension::MASS);
        check("kpc", 3.085_677_581_491_367_3e21, UnitDimension::LENGTH);
        check("6.957e10 cm", 6.957e10, UnitDimension::LENGTH);
        check("1e-3 kg.m-3", 1e-6, density);
        check("2.5 g cm^-3 s^0", 2.5, density);
        check("m/1e3 s", 0.1, UnitDimension::VELOCITY);
        check("", 1.0, UnitDimension::NONE);
        check("1", 1.0, UnitDimension::NONE);
        check("rad/sec", 1.0, UnitDimension::new(0, 0, -1, 0));
        check("cm/sec", 1.0, UnitDimension::VELOCITY);
        check("Gyr", 3.155_76e16, UnitDimension::TIME);
        check("1e-6 G", 1e-6, UnitDimension::MAGNETIC_FIELD);
        check("uG", 1e-6, UnitDimension::MAGNETIC_FIELD);
        check("nT", 1e-5, UnitDimension::MAGNETIC_FIELD);
        check("T", 1e4, UnitDimension::MAGNETIC_FIELD);
        check("1/s", 1.0, UnitDimension::new(0, 0, -1, 0));
    }

    #[test]
    fn what_is_not_understood_is_not_guessed() {
        for text in ["degrees_north", "furlong", "m^x", "kg m-3 foo", "m^1000", "^3", "days since 2001-01-01"] {
            assert_eq!(Unit::parse(text), None, "{text}");
        }
    }

    #[test]
    fn symbols_are_read_as_what_they_were_written_for() {
        for system in [UnitSystem::cgs(), UnitSystem::solar(), UnitSystem::galactic()] {
            for d in [
                UnitDimension::LENGTH,
                UnitDimension::SPECIFIC_ENERGY,
                UnitDimension::mass_density(3),
                UnitDimension::MAGNETIC_FIELD,
                UnitDimension::NONE,
            ] {
                check(&system.symbol(d), system.to_cgs(d), d);
            }
        }
    }

    #[test]
    fn gravity_is_one_in_solar_and_planetary_units() {
        for system in [UnitSystem::solar(), UnitSystem::planetary()] {
            let g = GRAVITATIONAL_CONSTANT_CGS / system.to_cgs(UnitDimension::new(3, -1, -2, 0));
            assert!((g - 1.0).abs() < 1e-12);
        }
    }
}
