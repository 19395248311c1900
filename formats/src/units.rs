//! Units at the border: what a file states, and the system in which particles are written.

/// Exponents of length, mass, time and temperature.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct UnitDimension {
    pub length: i8,
    pub mass: i8,
    pub time: i8,
    pub temperature: i8,
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

    pub const fn new(length: i8, mass: i8, time: i8, temperature: i8) -> Self {
        Self { length, mass, time, temperature }
    }

    /// Mass per unit volume in `d` dimensions.
    pub const fn mass_density(d: usize) -> Self {
        Self::new(-(d as i8), 1, 0, 0)
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
    /// The unit of a symbol such as `km` or `kg m-3`.
    pub fn parse(symbol: &str) -> Option<Self> {
        let density = UnitDimension::mass_density(3);
        let (to_cgs, dimension) = match symbol.trim() {
            "cm" => (1.0, UnitDimension::LENGTH),
            "m" => (1e2, UnitDimension::LENGTH),
            "km" => (1e5, UnitDimension::LENGTH),
            "g/cm^3" | "g/cm3" | "g cm-3" | "g cm^-3" => (1.0, density),
            "kg/m^3" | "kg/m3" | "kg m-3" | "kg m^-3" => (1e-3, density),
            _ => return None,
        };
        Some(Self {
            symbol: symbol.trim().to_owned(),
            to_cgs,
            dimension,
        })
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

    /// The factor from this system to cgs for a quantity of dimension `d`.
    pub fn to_cgs(&self, d: UnitDimension) -> f64 {
        self.length.powi(d.length.into())
            * self.mass.powi(d.mass.into())
            * self.time.powi(d.time.into())
            * self.temperature.powi(d.temperature.into())
    }
}
