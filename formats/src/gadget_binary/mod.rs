//! GADGET's own binary files, formats 1 and 2: Fortran records, as GADGET-1 to GADGET-4 and their descendants take them.
//!
//! A record is its length in bytes (u32), the data, and the length again. The first is the header of 256 bytes; then comes
//! one record per block, in this order. In format 2 a record of 8 bytes comes before each, with the block's name and
//! how many bytes to skip to reach the next name.
//!
//! | block | values                | particles                                        | written                              |
//! |-------|-----------------------|--------------------------------------------------|--------------------------------------|
//! | POS   | 3 f4 or f8            | all types in order                               | required                             |
//! | VEL   | 3 f4 or f8            | all types                                        | zeros where absent                   |
//! | ID    | u4 or u8              | all types                                        | 1 ... N where absent                 |
//! | MASS  | f4 or f8              | types whose mass in the header is 0              | required, the header's table stays 0 |
//! | U     | f4 or f8, per mass    | gas; entropies where the header's flag says so   | required for gas, the flag stays 0   |
//! | RHO   | f4 or f8              | gas                                              | if known                             |
//! | HSML  | f4 or f8              | gas; radius at which the kernel vanishes         | if RHO is known too                  |
//!
//! GADGET-4 writes a header of 192 bytes with counts of 64 bits, unless it is built with `GADGET2_HEADER`; that is read, too. A family of several files is
//! `NAME.0`, `NAME.1` and so on, with the numbers behind whatever name the code is told.
//!
//! Quirks: both byte orders occur; the width of a value shows in the length of its block only; lengths are taken modulo
//! 2^32, as codes write them for blocks of 4 GiB and more; with cooling, NE and NH come before HSML; units, kernel,
//! periodicity and dimension are not stored, so axes on which every particle is at 0 and at rest count as unused. Codes
//! read f4 unless they are built otherwise; f8 is written with double precision only.
//!
//! Layout after the GADGET-2 user guide, section 6, and its `allvars.h` and `io.c` (version 2.0.7).

use crate::particle_names as names;
use crate::registry::{
    Capabilities, Columns, FileNames, FixedCorner, FormatSpec, Match, ReadFn, StreamFn, Streaming, WriteFn,
};
use schema::{HEADER_BYTES, HEADER_BYTES_OF_4, NAME, NAME_BYTES};

#[cfg(feature = "gadget-binary")]
mod layout;
#[cfg(feature = "gadget-binary")]
mod read;
#[cfg(feature = "gadget-binary")]
mod records;
mod schema;
#[cfg(feature = "gadget-binary")]
mod write;

#[cfg(feature = "gadget-binary")]
const CODE: (Option<ReadFn>, Option<WriteFn>, Option<WriteFn>) =
    (Some(read::read), Some(write::format_2), Some(write::format_1));
#[cfg(not(feature = "gadget-binary"))]
const CODE: (Option<ReadFn>, Option<WriteFn>, Option<WriteFn>) = (None, None, None);

#[cfg(feature = "gadget-binary")]
const PIECES: (Option<Streaming>, Option<Streaming>) =
    (Some(in_files(write::piece_of_format_2)), Some(in_files(write::piece_of_format_1)));
#[cfg(not(feature = "gadget-binary"))]
const PIECES: (Option<Streaming>, Option<Streaming>) = (None, None);

#[cfg_attr(not(feature = "gadget-binary"), allow(dead_code))]
const fn in_files(write: StreamFn) -> Streaming {
    Streaming { write, names: FileNames::Appended, in_blocks: false }
}

/// Data sheet of the format: reads both, writes format 2.
pub const SPEC: FormatSpec = FormatSpec {
    name: NAME,
    summary: "GADGET binary files, formats 1 and 2; written as format 2",
    extensions: &["gadget", "gdt"],
    feature: "gadget-binary",
    reference: "https://wwwmpa.mpa-garching.mpg.de/gadget/users-guide.pdf",
    capabilities: Capabilities {
        read_particles: true,
        write_particles: true,
        requires: &[crate::particle_names::INTERNAL_ENERGY],
        dimensions: &[1, 2, 3],
        columns: Columns::Only(&[names::INTERNAL_ENERGY]),
        cubic_box: true,
        corner: FixedCorner::Periodic,
        ..Capabilities::NONE
    },
    sniff,
    read: CODE.0,
    write: CODE.1,
    stream: PIECES.0,
};

/// Data sheet of the older variant, written only: the reader of [`SPEC`] reads it.
pub const SPEC_1: FormatSpec = FormatSpec {
    name: "gadget-binary-1",
    summary: "GADGET binary files, written as format 1 without block names",
    extensions: &["gadget1"],
    capabilities: Capabilities { read_particles: false, ..SPEC.capabilities },
    read: None,
    write: CODE.2,
    stream: PIECES.1,
    ..SPEC
};

/// The first record's length, in either byte order, with what must follow it.
fn sniff(head: &[u8]) -> Match {
    let word = |at: usize| head.get(at..)?.first_chunk::<4>();
    let is = |at: usize, value: u32| word(at).is_some_and(|b| *b == value.to_le_bytes() || *b == value.to_be_bytes());
    let format_2 = is(0, NAME_BYTES) && head.get(4..8) == Some(b"HEAD");
    let format_1 = |bytes: u32| is(0, bytes) && is(4 + bytes as usize, bytes);
    if format_2 || format_1(HEADER_BYTES) || format_1(HEADER_BYTES_OF_4) { Match::Certain } else { Match::No }
}
