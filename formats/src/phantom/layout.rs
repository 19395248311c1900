//! Tags, particle types and constants of a dump.

use super::schema::{NAME, units};
use crate::common::flavor::{BoxSize, Flavor, Job, Need, Rule, Source, Storage};
use crate::common::quantity::Quantity;
use crate::magnetic::MagneticUnit;
use crate::model::Species;
use crate::particle_names as names;
use crate::units::UnitDimension;

/// Characters of the identity and of a tag.
pub const IDENTITY: usize = 100;
pub const TAG: usize = 16;
/// Edges of an open box about the origin, beside what Phantom reads.
pub const CENTERED_BOX: [&str; 3] = ["centered_box_x", "centered_box_y", "centered_box_z"];
/// Lower corner of an open box that lies elsewhere.
pub const BOX_CORNER: [&str; 3] = ["box_corner_x", "box_corner_y", "box_corner_z"];
/// Marks numbers that are pure, to which the units of the header are Phantom's own.
pub const PURE_NUMBERS: &str = "pure_numbers";
/// Second integer, which is also the real number, and the last one of the capture pattern.
pub const CAPTURE_REAL: i32 = 60878;
pub const CAPTURE_END: i32 = 690_706;
/// h over the mean particle spacing with Phantom's default, the cubic spline.
pub const HFACT: f64 = 1.2;
/// The kernel's support over h.
pub const SUPPORT: f64 = 2.0;
/// Particle types of an ordinary build (`maxtypes`).
pub const TYPES: usize = 8;

/// Data types of header blocks and arrays, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Int,
    Int1,
    Int2,
    Int4,
    Int8,
    /// The code's own precision: 8 bytes in full dumps, 4 in small ones.
    Real,
    Real4,
    Real8,
}

pub const KINDS: [Kind; 8] =
    [Kind::Int, Kind::Int1, Kind::Int2, Kind::Int4, Kind::Int8, Kind::Real, Kind::Real4, Kind::Real8];

impl Kind {
    /// Bytes per value where reals have `real`.
    pub fn width(self, real: usize) -> usize {
        match self {
            Self::Int1 => 1,
            Self::Int2 => 2,
            Self::Int | Self::Int4 | Self::Real4 => 4,
            Self::Int8 | Self::Real8 => 8,
            Self::Real => real,
        }
    }
}

/// What is added to coordinates along an axis: in vacuum a body whose place was not chosen is about the origin, to which Phantom
/// resets centers of mass.
pub fn shift(job: &Job, axis: usize) -> f64 {
    let header = job.header;
    let is_free = header.periodic == [false; 3] && header.box_corner.is_none();
    if is_free { -0.5 * header.box_size[axis] } else { 0.0 }
}

/// Phantom's number of its first kind of dust (`idust`).
pub const DUST: i8 = 7;

/// Phantom's number of the particles of a species.
pub fn itype(species: &Species) -> Option<i8> {
    if species.table.column(names::DUST_TO_GAS_RATIO).is_some() {
        return Some(DUST);
    }
    Some(match species.part_type {
        0 => 1,
        1 => 5,
        3 => 6,
        4 => 4,
        5 => 3,
        _ => return None,
    })
}

/// The GADGET-style type of Phantom's number; dust and whatever else has none of its own becomes 2.
pub fn part_type(itype: i64) -> u8 {
    match itype {
        1 => 0,
        5 => 1,
        6 => 3,
        4 => 4,
        3 => 5,
        _ => 2,
    }
}

/// Factor from the header's units to Phantom's.
pub fn factor(job: &Job, dimension: UnitDimension) -> f64 {
    let from = job.header.units;
    // A magnetic field's unit has one time below the line, as a velocity's.
    let powers = i32::from(dimension.magnetic) - i32::from(dimension.time);
    (units(&from).time / from.time).powi(powers)
}

#[rustfmt::skip]
const RULES: &[Rule] = &[
    Rule { name: "Coordinates", source: Source::Column(names::COORDINATES), storage: Storage::Double, unit: Quantity::Length, components: 3, need: Need::All },
    Rule { name: "Velocities", source: Source::ColumnOrZeros(names::VELOCITIES), storage: Storage::Double, unit: Quantity::Velocity, components: 3, need: Need::All },
    Rule { name: "u", source: Source::Column(names::INTERNAL_ENERGY), storage: Storage::Float, unit: Quantity::SpecificEnergy, components: 1, need: Need::Gas },
    Rule { name: "h", source: Source::Spacing { eta: HFACT }, storage: Storage::Float, unit: Quantity::Length, components: 1, need: Need::All },
    Rule { name: "dustfrac", source: Source::Column(names::DUST_FRACTION), storage: Storage::Float, unit: Quantity::Number, components: 1, need: Need::Optional },
    Rule { name: "massoftype", source: Source::Column(names::MASSES), storage: Storage::Float, unit: Quantity::Mass, components: 1, need: Need::All },
    Rule { name: "iorig", source: Source::ColumnOrCount(names::PARTICLE_IDS), storage: Storage::Id, unit: Quantity::Number, components: 1, need: Need::All },
];

/// What a dump needs of every species.
pub const FLAVOR: Flavor = Flavor {
    format: NAME,
    rules: RULES,
    header: &[],
    box_size: BoxSize::Edges,
    inside_box: false,
    extra_columns: true,
    long_columns: false,
    wide_totals: false,
    unit_parameters: false,
    magnetic: MagneticUnit::HeavisideLorentz,
    dropped: &[names::SUPPORT_RADIUS, names::DENSITY, names::DUST_TO_GAS_RATIO],
    taken: &["itype", "x", "y", "z", "vx", "vy", "vz", "Bx", "By", "Bz"],
};
