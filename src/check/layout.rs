//! Checks of a file's layout: missing attributes, attributes of unexpected length, flags, and names of datasets at which a simulation code
//! stops or which it misreads. The readers of this project accept all of them.
//!
//! What is opened, and how: SWIFT 2026.04 `src/single_io.c` and `io_read_unit_system` of `src/common_io.c`; GADGET-4 226f62e
//! `snap_io::read_header_fields` of `src/io/snap_io.cc` and `my_H5Aread` of `src/io/hdf5_util.cc`; GIZMO's public version, GADGET-2.0.7 and AREPO's
//! public version `read_header_attributes_in_hdf5` of `read_ic.c`.

use super::finding::{Finding, Level, add, named};
use super::values::{as_in_files, needed};
use crate::codes::{AS_PLANETARY, TargetCode};
use sph_formats::common::particle_names as names;
use sph_formats::layout::{Dataset, Layout};
use sph_formats::{ParticleFile, Species};

/// How many numbers a code takes of an attribute.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Room {
    /// It stops, or ends without a word, at any other number of them.
    Exactly(usize),
    /// It writes more over what lies behind.
    AtMost(usize),
}

use Room::{AtMost, Exactly};

/// Types of particles in GADGET's family as it is built by default, and in SWIFT.
const TYPES: usize = 6;
const TYPES_OF_SWIFT: usize = 7;

const OF_SWIFT: &[(&str, Room)] = &[
    ("BoxSize", AtMost(3)),
    (TOTAL, AtMost(TYPES_OF_SWIFT)),
    (HIGH_WORD, AtMost(TYPES_OF_SWIFT)),
    (ENTROPY, AtMost(TYPES_OF_SWIFT)),
];
const OF_GADGET4: &[(&str, Room)] = &[
    (HERE, Exactly(TYPES)),
    (TOTAL, Exactly(TYPES)),
    (MASS_TABLE, Exactly(TYPES)),
    ("Time", Exactly(1)),
    ("Redshift", Exactly(1)),
    ("BoxSize", Exactly(1)),
    (FILES, Exactly(1)),
];
const OF_GADGET2: &[(&str, Room)] = &[
    (HERE, AtMost(TYPES)),
    (TOTAL, AtMost(TYPES)),
    (HIGH_WORD, AtMost(TYPES)),
    (MASS_TABLE, AtMost(TYPES)),
    ("Time", AtMost(1)),
    (FILES, AtMost(1)),
    (ENTROPY, AtMost(1)),
];
const OF_GIZMO: &[(&str, Room)] = &[
    (HERE, AtMost(TYPES)),
    (TOTAL, AtMost(TYPES)),
    (HIGH_WORD, AtMost(TYPES)),
    (MASS_TABLE, AtMost(TYPES)),
    ("Time", AtMost(1)),
    (FILES, AtMost(1)),
    (DOUBLE, AtMost(1)),
];
const OF_AREPO: &[(&str, Room)] = &[
    (HERE, Exactly(TYPES)),
    (TOTAL, Exactly(TYPES)),
    (HIGH_WORD, Exactly(TYPES)),
    (MASS_TABLE, Exactly(TYPES)),
    ("Time", Exactly(1)),
    ("Redshift", Exactly(1)),
    ("BoxSize", Exactly(1)),
    (FILES, Exactly(1)),
    ("Omega0", Exactly(1)),
    ("OmegaLambda", Exactly(1)),
    ("HubbleParam", Exactly(1)),
    ("Flag_Sfr", Exactly(1)),
    ("Flag_Cooling", Exactly(1)),
    ("Flag_StellarAge", Exactly(1)),
    ("Flag_Metals", Exactly(1)),
    ("Flag_Feedback", Exactly(1)),
    (DOUBLE, Exactly(1)),
];

const HERE: &str = "NumPart_ThisFile";
const TOTAL: &str = "NumPart_Total";
const HIGH_WORD: &str = "NumPart_Total_HighWord";
const MASS_TABLE: &str = "MassTable";
const FILES: &str = "NumFilesPerSnapshot";
const ENTROPY: &str = "Flag_Entropy_ICs";
const DOUBLE: &str = "Flag_DoublePrecision";

/// What SWIFT reads of a group of units, once there is one.
const UNITS: [&str; 5] = [
    "Unit length in cgs (U_L)",
    "Unit mass in cgs (U_M)",
    "Unit time in cgs (U_t)",
    "Unit current in cgs (U_I)",
    "Unit temperature in cgs (U_T)",
];

/// Superblocks of HDF5 files that libraries before 1.10 open, and codes built with those.
const OLD_SUPERBLOCK: u8 = 2;

/// The attributes that a code opens which starts from such files.
fn attributes(code: &TargetCode) -> Option<&'static [(&'static str, Room)]> {
    Some(match code.sheet.name {
        "swift" => OF_SWIFT,
        "gadget4" => OF_GADGET4,
        "gadget2" => OF_GADGET2,
        "gizmo" => OF_GIZMO,
        "arepo" => OF_AREPO,
        _ => return None,
    })
}

/// Whether a code starts from such files.
pub(super) fn opens(code: &TargetCode) -> bool {
    attributes(code).is_some()
}

/// Findings of the files that particles are from, for codes that start from such files.
pub(super) fn layouts(file: &ParticleFile, code: &TargetCode, findings: &mut Vec<Finding>) {
    let Some(opened) = attributes(code) else { return };
    for layout in &file.header.layouts {
        let mut found = Vec::new();
        lacking(layout, opened, code, &mut found);
        lengths(layout, opened, code, &mut found);
        flags(layout, code, &mut found);
        if code.sheet.name == "swift" {
            for_swift(layout, code, &mut found);
        }
        for species in file.species.iter().filter(|s| s.table.count > 0) {
            datasets(species, layout, code, &mut found);
        }
        container(layout, code, &mut found);
        // Files of one snapshot have the same faults.
        found.retain(|finding| !findings.contains(finding));
        findings.append(&mut found);
    }
}

/// How to have a file that the code takes.
fn convert(code: &TargetCode) -> String {
    format!("sph-prep convert FILE NEW --to {}", code.sheet.format)
}

fn lacking(layout: &Layout, opened: &[(&str, Room)], code: &TargetCode, findings: &mut Vec<Finding>) {
    for (name, _) in opened.iter().filter(|(name, _)| layout.of_header(name).is_none()) {
        let text =
            format!("lacks the header's {name}, but {} reads it and stops, or takes zeros; write it", code.sheet.title);
        add(findings, Level::Error, "header", text);
    }
}

fn lengths(layout: &Layout, opened: &[(&str, Room)], code: &TargetCode, findings: &mut Vec<Finding>) {
    let title = code.sheet.title;
    // Those of one length are one finding: counts and masses are mostly off together.
    let mut wrong: Vec<(usize, Room, Vec<&str>)> = Vec::new();
    for &(name, room) in opened {
        let Some(count) = layout.of_header(name).map(<[f64]>::len) else { continue };
        let is_taken = match room {
            Exactly(wanted) => count == wanted,
            AtMost(most) => count <= most,
        };
        match wrong.iter_mut().find(|(length, of, _)| (*length, *of) == (count, room)) {
            _ if is_taken => {}
            Some((.., names)) => names.push(name),
            None => wrong.push((count, room, vec![name])),
        }
    }
    for (count, room, names) in wrong {
        let (level, text) = match room {
            Exactly(1) => (Level::Error, format!("{title} takes one, and stops at any other; write one")),
            Exactly(wanted) => (
                Level::Error,
                format!(
                    "{title} has {wanted} types of particles, and stops at any other; write {wanted}, or build it with NTYPES={count}"
                ),
            ),
            AtMost(most) => (
                Level::Warning,
                format!(
                    "{title} has room for {most}, and writes the others over what lies behind; write {}",
                    most.min(TYPES)
                ),
            ),
        };
        let numbers = if count == 1 { "number" } else { "numbers" };
        let has = if names.len() == 1 { "has" } else { "have" };
        let text = format!("{} {has} {count} {numbers}, but {text} ({} does)", names.join(", "), convert(code));
        add(findings, level, "header", text);
    }
}

/// Flags that say what a code does not make of the numbers.
fn flags(layout: &Layout, code: &TargetCode, findings: &mut Vec<Finding>) {
    let (name, title) = (code.sheet.name, code.sheet.title);
    let set = |flag: &str| layout.of_header(flag).and_then(|numbers| numbers.first()).copied().filter(|n| *n != 0.0);
    if let Some(flag) = set(DOUBLE).filter(|_| ["gizmo", "arepo"].contains(&name)) {
        let text = format!(
            "{DOUBLE} is {flag}, at which {title} stops unless it is built with INPUT_IN_DOUBLEPRECISION; write 0: numbers in HDF5 say by themselves how precise they are"
        );
        add(findings, Level::Error, "header", text);
    }
    let Some(flag) = set(ENTROPY) else { return };
    let (level, unless) = match (name, code.scheme.name) {
        // These read the flag, and what it says.
        ("gadget2", _) | ("swift", "pressure-entropy") => return,
        ("gadget4", _) => (Level::Warning, " unless it is built with INITIAL_CONDITIONS_CONTAIN_ENTROPY"),
        _ => (Level::Error, ""),
    };
    let text = format!(
        "{ENTROPY} is {flag}, so that {} has entropies, but {title} ({}) takes them for energies{unless}; {} makes energies of them",
        names::INTERNAL_ENERGY,
        code.scheme.name,
        convert(code)
    );
    add(findings, level, "header", text);
}

fn for_swift(layout: &Layout, code: &TargetCode, findings: &mut Vec<Finding>) {
    let title = code.sheet.title;
    if layout.of_header(FILES).is_some_and(|n| n.first() == Some(&0.0)) {
        let text = format!("{FILES} is 0, but {title} starts from 1 file alone; write 1, or leave it out");
        add(findings, Level::Error, "header", text);
    }
    let Some(units) = &layout.units else { return };
    for unit in UNITS.iter().filter(|unit| units.iter().all(|(name, _)| name != *unit)) {
        let text = format!(
            "lack '{unit}', but {title} reads all five of a group Units and stops; write it, or take out the whole group"
        );
        add(findings, Level::Error, "units", text);
    }
}

/// Columns that the code asks for under another name or in another shape.
fn datasets(species: &Species, layout: &Layout, code: &TargetCode, findings: &mut Vec<Finding>) {
    let (title, is_swift) = (code.sheet.title, code.sheet.name == "swift");
    let own = || layout.datasets.iter().filter(|d| d.part_type == species.part_type);
    let materials: &[&str] = if AS_PLANETARY.contains(&code.scheme.name) { &[names::MATERIAL_IDS] } else { &[] };
    let table = layout.of_header(MASS_TABLE).and_then(|m| m.get(usize::from(species.part_type))).copied();
    let is_in_table = |name: &str| name == names::MASSES && !is_swift && table.is_some_and(|m| m > 0.0);
    for name in needed(species.part_type, code).iter().chain(materials).filter(|name| !is_in_table(name)) {
        let name = as_in_files(name);
        let Some(Dataset { shape, .. }) = own().find(|d| d.name == name) else {
            if let Some(other) = own().find(|d| d.meaning == name) {
                let text = format!(
                    "is called {}, as in SWIFT's snapshots, but {title} starts from {name} alone: it stops, or takes zeros; {} writes that",
                    other.name,
                    convert(code)
                );
                add(findings, Level::Error, &named(species, name), text);
            }
            continue;
        };
        let is_vector = [names::COORDINATES, names::VELOCITIES].contains(&name);
        let is_taken = match shape.as_slice() {
            [_] => !is_vector,
            [_, 3] => is_vector,
            // SWIFT reads as many numbers as it needs, however they are put.
            [_, 1] => is_swift && !is_vector,
            _ => false,
        };
        if !is_taken {
            let wanted = if is_vector {
                "three numbers for each particle"
            } else {
                "one number for each particle, in one row of them"
            };
            let text = format!(
                "has the shape {shape:?}, but {title} reads {wanted}: it stops, or takes others or zeros; {} writes it so",
                convert(code)
            );
            add(findings, Level::Error, &named(species, name), text);
        }
    }
}

fn container(layout: &Layout, code: &TargetCode, findings: &mut Vec<Finding>) {
    if let Some(version) = layout.superblock.filter(|version| *version > OLD_SUPERBLOCK) {
        let text = format!(
            "is HDF5 with a superblock of version {version}, of a writer that was asked for the latest: {} does not open it, or reads zeros, where its HDF5 library is older than the writer's; {} writes an older one",
            code.sheet.title,
            convert(code)
        );
        add(findings, Level::Warning, "file", text);
    }
}
