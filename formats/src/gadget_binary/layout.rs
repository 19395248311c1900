//! The names and order of the blocks, and the bytes of the header.

use super::schema::NAME;
use crate::common::cosmology::Stated;
use crate::common::flavor::{BoxSize, Flavor, Need, Rule, Source, Storage, TYPES};
use crate::common::quantity::Quantity;
use crate::magnetic::MagneticUnit;
use crate::particle_names as names;

/// Byte offsets in the header.
pub mod offset {
    pub const COUNTS: usize = 0;
    pub const MASSES: usize = 24;
    pub const TIME: usize = 72;
    pub const REDSHIFT: usize = 80;
    pub const TOTALS: usize = 96;
    pub const FLAG_COOLING: usize = 120;
    pub const FILES: usize = 124;
    pub const BOX_SIZE: usize = 128;
    pub const MATTER: usize = 136;
    pub const HUBBLE: usize = 152;
    pub const TOTAL_HIGH_WORDS: usize = 168;
    pub const FLAG_ENTROPY: usize = 192;
    pub const FLAG_DOUBLE: usize = 196;
}

/// The same in GADGET-4's own header, whose counts have 64 bits.
pub mod offset_of_4 {
    pub const COUNTS: usize = 0;
    pub const TOTALS: usize = 48;
    pub const MASSES: usize = 96;
    pub const TIME: usize = 144;
    pub const REDSHIFT: usize = 152;
    pub const BOX_SIZE: usize = 160;
    pub const FILES: usize = 168;
}

/// Which particles a block covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cover {
    All,
    Gas,
    /// Types without a mass in the header.
    OwnMass,
}

/// One block that is understood.
#[derive(Debug, Clone, Copy)]
pub struct Block {
    /// Four characters, padded with blanks.
    pub label: &'static [u8; 4],
    pub column: &'static str,
    pub components: usize,
    pub cover: Cover,
    pub integers: bool,
}

const fn block(label: &'static [u8; 4], column: &'static str, components: usize, cover: Cover) -> Block {
    Block { label, column, components, cover, integers: false }
}

/// In the order of format 1.
pub const BLOCKS: &[Block] = &[
    block(b"POS ", names::COORDINATES, 3, Cover::All),
    block(b"VEL ", names::VELOCITIES, 3, Cover::All),
    Block { integers: true, ..block(b"ID  ", names::PARTICLE_IDS, 1, Cover::All) },
    block(b"MASS", names::MASSES, 1, Cover::OwnMass),
    block(b"U   ", names::INTERNAL_ENERGY, 1, Cover::Gas),
    block(b"RHO ", names::DENSITY, 1, Cover::Gas),
    block(b"NE  ", "ElectronAbundance", 1, Cover::Gas),
    block(b"NH  ", "NeutralHydrogenAbundance", 1, Cover::Gas),
    block(b"HSML", names::SUPPORT_RADIUS, 1, Cover::Gas),
];

/// Blocks that exist with radiative cooling only.
pub fn is_cooling(block: &Block) -> bool {
    matches!(block.label, b"NE  " | b"NH  ")
}

#[rustfmt::skip]
const RULES: &[Rule] = &[
    Rule { name: "POS ", source: Source::Column(names::COORDINATES), storage: Storage::Float, unit: Quantity::Length, components: 3, need: Need::All },
    Rule { name: "VEL ", source: Source::ColumnOrZeros(names::VELOCITIES), storage: Storage::Float, unit: Quantity::Velocity, components: 3, need: Need::All },
    Rule { name: "ID  ", source: Source::ColumnOrCount(names::PARTICLE_IDS), storage: Storage::Id, unit: Quantity::Number, components: 1, need: Need::All },
    Rule { name: "MASS", source: Source::Column(names::MASSES), storage: Storage::Float, unit: Quantity::Mass, components: 1, need: Need::All },
    Rule { name: "U   ", source: Source::Column(names::INTERNAL_ENERGY), storage: Storage::Float, unit: Quantity::SpecificEnergy, components: 1, need: Need::Gas },
    Rule { name: "RHO ", source: Source::Column(names::DENSITY), storage: Storage::Float, unit: Quantity::Density, components: 1, need: Need::Optional },
    Rule { name: "HSML", source: Source::Column(names::SUPPORT_RADIUS), storage: Storage::Float, unit: Quantity::Length, components: 1, need: Need::Optional },
];

/// The box is one number, the blocks are fixed.
pub const FLAVOR: Flavor = Flavor {
    format: NAME,
    rules: RULES,
    header: &[],
    box_size: BoxSize::None,
    inside_box: false,
    extra_columns: false,
    long_columns: false,
    wide_totals: false,
    unit_parameters: false,
    magnetic: MagneticUnit::HeavisideLorentz,
    dropped: &[],
    taken: &[],
};

/// The header's numbers that matter here.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Header {
    pub counts: [u32; TYPES],
    pub totals: [u64; TYPES],
    pub masses: [f64; TYPES],
    pub time: f64,
    pub redshift: f64,
    /// Share of matter in the critical density.
    pub matter: f64,
    /// H0 over 100 km/s/Mpc.
    pub hubble: f64,
    pub box_size: f64,
    pub files: u32,
    pub cooling: bool,
    pub entropy: bool,
}

impl Header {
    /// What is said of an expanding box, for the provenance.
    pub fn cosmology(&self) -> Option<(String, String)> {
        let Self { time, redshift, hubble, matter, .. } = *self;
        let [time, redshift, hubble, matter] = [time, redshift, hubble, matter].map(Some);
        Stated { time, redshift, hubble, matter, is_comoving: None }.fact()
    }
}
