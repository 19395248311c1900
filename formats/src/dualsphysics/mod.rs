//! DualSPHysics' binary particles: `CASE.bi4`, from which the code starts beside a `CASE.xml`, and the `Part_0000.bi4` that it writes.
//!
//! The container is of items with named values and arrays. The first item has the header's values, and within it are `PART_0000`, with the particles, and
//! `SphPrep`, with the texts of units, box, kernel and provenance, which the code passes over.
//!
//! | value                                   | content                                                                        |
//! |-----------------------------------------|--------------------------------------------------------------------------------|
//! | Data2d, Data2dPosY                      | whether particles are in the plane of x and z, and its y, 0                     |
//! | CaseNp, CaseNfixed, CaseNfluid          | particles, those of walls (type 5) and of gas; CaseNmoving and CaseNfloat are 0 |
//! | CasePosMin, CasePosMax                  | limits of the particles; along periodic axes half a spacing within the faces, which the code adds |
//! | PeriMode                                | a bit for each periodic axis                                                   |
//! | Dp, H                                   | (m/rho0)^(1/d), and half the middle support radius of the gas                   |
//! | Rhop0, Gamma, B                         | of Tait's equation: the walls' density, else the middle one; the file's index, or 7; c^2 rho0/gamma |
//! | MassBound, MassFluid                    | of a particle: unequal ones of a type are refused                              |
//!
//! | array    | type | from                                                                                              |
//! |----------|------|---------------------------------------------------------------------------------------------------|
//! | Idp      | u4   | 0, 1 ...: walls first, of which the code tells one from the other                                  |
//! | Posd     | 3 f8 | Coordinates; in two dimensions x, 0, y                                                            |
//! | Vel      | 3 f4 | Velocities, zeros where absent                                                                    |
//! | Rhop     | f4   | of gas by Tait's equation of its pressure less the least one, rho0 without; of walls Density |
//! | BoundNor | 3 f4 | of walls alone: Normals times SurfaceDistance                                                     |
//! | others   | f4, f8, i8 | scalars and vectors under their own names: Density (the summed one), SupportRadius, ParticleIDs and Pressure among them |
//!
//! In double precision, Velocities are there as f8, too. Two and three dimensions; particles that are neither gas nor walls are refused. Read, Rhop is Density and gives a Pressure where these are not there; moving
//! and floating bodies are walls, too; a file of the code has no units, and SI is taken. Several files of one time (`Part_p00_0000.bi4`) are refused, and so
//! are numbers in big-endian order.
//!
//! Layout after DualSPHysics' `src/source/JBinaryData.cpp`, `JPartDataBi4.cpp`, `JPartsLoad4.cpp` and `JPeriodicDef.h` (5.4).

use crate::registry::{Capabilities, FormatSpec, Match, ReadFn, WriteFn};

#[cfg(feature = "dualsphysics")]
mod binary;
mod liquid;
#[cfg(feature = "dualsphysics")]
mod read;
mod schema;
#[cfg(feature = "dualsphysics")]
mod write;

pub use liquid::Liquid;

#[cfg(feature = "dualsphysics")]
const CODE: (Option<ReadFn>, Option<WriteFn>) = (Some(read::read), Some(write::write));
#[cfg(not(feature = "dualsphysics"))]
const CODE: (Option<ReadFn>, Option<WriteFn>) = (None, None);

/// Data sheet of the format.
pub const SPEC: FormatSpec = FormatSpec {
    name: schema::NAME,
    summary: "DualSPHysics' binary particles (bi4)",
    extensions: &["bi4"],
    feature: "dualsphysics",
    reference: "https://github.com/DualSPHysics/DualSPHysics",
    capabilities: Capabilities {
        read_particles: true,
        write_particles: true,
        dimensions: schema::DIMENSIONS,
        equal_masses: true,
        columns: schema::COLUMNS,
        ..Capabilities::NONE
    },
    sniff,
    read: CODE.0,
    write: CODE.1,
    stream: None,
};

fn sniff(head: &[u8]) -> Match {
    if head.starts_with(schema::MAGIC) { Match::Certain } else { Match::No }
}
