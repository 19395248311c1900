//! Records the layout of a file, that is the names and lengths of its groups, datasets and attributes, as a code that starts from it finds them.

use crate::common::hdf5_read::{Attributes, Reader};
use crate::error::Result;
use crate::layout::{Dataset, Layout};
use crate::particle_names as names;
use std::fs::File;
use std::io::Read as _;
use std::path::Path;

/// Dataset names of SWIFT's snapshots, and what they are here.
const PLURALS: &[(&str, &str)] = &[
    ("Densities", names::DENSITY),
    ("InternalEnergies", names::INTERNAL_ENERGY),
    ("MagneticFluxDensities", names::MAGNETIC_FIELD),
    ("Pressures", names::PRESSURE),
    ("Temperatures", names::TEMPERATURE),
    ("SmoothingLengths", names::SMOOTHING_LENGTH),
];

/// What attracts of a black hole in SWIFT's snapshots, beside its mass at subgrid scale.
pub(super) const DYNAMICAL_MASSES: &str = "DynamicalMasses";

/// What an HDF5 file begins with, but for those with a block of the user's before it; the version of the superblock is next.
const SIGNATURE: &[u8; 8] = b"\x89HDF\r\n\x1a\n";

/// The name here of a dataset of a snapshot.
pub(super) fn singular(name: &str) -> &str {
    PLURALS.iter().find(|(plural, _)| *plural == name).map_or(name, |(_, singular)| singular)
}

/// The layout of a file that has particles of these types.
///
/// # Errors
/// [`crate::FormatError::Input`] where it is damaged.
pub(super) fn layout(
    (path, file): (&Path, &Reader<'_>),
    header: &Attributes,
    (units, support_over_length): (Option<&Attributes>, Option<f64>),
    types: impl Iterator<Item = u8>,
) -> Result<Layout> {
    let numbers =
        |of: &Attributes| of.names().filter_map(|name| Some((name.to_owned(), of.numbers(name)?))).collect::<Vec<_>>();
    let mut datasets = Vec::new();
    for part_type in types {
        let group = format!("PartType{part_type}");
        for name in file.datasets(&group)? {
            let shape = file.shape(&format!("{group}/{name}"))?;
            let meaning = if name == DYNAMICAL_MASSES { names::MASSES } else { singular(&name) };
            datasets.push(Dataset { part_type, meaning: meaning.to_owned(), name, shape });
        }
    }
    Ok(Layout {
        header: numbers(header),
        units: units.map(numbers),
        datasets,
        support_over_length,
        superblock: superblock(path),
    })
}

fn superblock(path: &Path) -> Option<u8> {
    let mut head = [0; SIGNATURE.len() + 1];
    File::open(path).and_then(|mut file| file.read_exact(&mut head)).ok()?;
    head.starts_with(SIGNATURE).then_some(head[SIGNATURE.len()])
}
