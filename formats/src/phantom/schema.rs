//! The bytes that a dump begins with, and the units of its numbers.

use crate::units::UnitSystem;

pub const NAME: &str = "phantom";

/// First integer of every dump.
pub const CAPTURE: i32 = 60769;

/// The constant of gravity in cgs as Phantom has it (physcon.f90). Units in which it is 1 to nine digits are Phantom's; in
/// others it leaves the dump's units and takes its own.
const PHANTOMS_GRAVITY: f64 = 6.672_041e-8;

/// Phantom's units: those of the header with the time that makes its G = 1. Pure numbers stay what they are.
pub fn units(from: &UnitSystem) -> UnitSystem {
    if *from == UnitSystem::CODE {
        return *from;
    }
    let time = (from.length.powi(3) / (PHANTOMS_GRAVITY * from.mass)).sqrt();
    // Units of an earlier dump keep their last digits.
    let same = (time / from.time - 1.0).abs() < 1e-9;
    UnitSystem { time: if same { from.time } else { time }, ..*from }
}

/// Length and mass that Phantom takes for pure numbers of matter that attracts itself, in which G is 1 (its physcon.f90).
#[cfg(feature = "phantom")]
const OWN_UNITS: (f64, f64) = (1.496e13, 1.9891e33);

/// The units that a header has: those of pure numbers of an open box are the ones that Phantom would take, so that what it is told in centimeters has
/// the same size in its output and in its forces.
#[cfg(feature = "phantom")]
pub fn units_of_header(from: &UnitSystem, is_open: bool) -> UnitSystem {
    let (length, mass) = OWN_UNITS;
    if *from == UnitSystem::CODE && is_open { units(&UnitSystem { length, mass, ..*from }) } else { units(from) }
}
