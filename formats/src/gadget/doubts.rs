//! Contradictions between the header of a file and its data. Such files can be read, but a code that starts from them stops or counts a different
//! number of particles.

use crate::common::hdf5_read::Attributes;
use crate::model::{DOUBT_KEY, ParticleTable};
use crate::particle_names as names;

/// Keys and texts for the provenance, of a file with so many particles of each type. `totals` are those in all files of the snapshot.
pub(super) fn of_header(
    header: &Attributes,
    files: usize,
    counts: &[f64],
    totals: Option<&[f64]>,
) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut add = |key: &str, text: String| found.push((key.to_owned(), text));
    if let Some(totals) = totals.filter(|_| files == 1) {
        let of = |all: &[f64], i: usize| all.get(i).copied().unwrap_or(0.0);
        for i in (0..counts.len().max(totals.len())).filter(|&i| of(totals, i) != of(counts, i)) {
            let (here, all) = (of(counts, i), of(totals, i));
            add(DOUBT_KEY, format!("NumPart_Total says {all} particles of type {i}, but the one file has {here}"));
        }
    }
    if let Some(time) = header.number("Time").filter(|time| !time.is_finite()) {
        add(DOUBT_KEY, format!("the time is {time}"));
    }
    found
}

/// The same of the masses of a type that are in the header's table and in a dataset, too; `table_is_read` says which of them counts.
pub(super) fn of_masses(part_type: usize, table: f64, masses: &[f64], table_is_read: bool) -> Option<(String, String)> {
    let differs = |m: &&f64| !((**m - table).abs() <= ROUNDING * table);
    let other = masses.iter().find(differs)?;
    let read = if table_is_read { "MassTable, as GADGET does" } else { "Masses, as SWIFT does" };
    let text = format!(
        "MassTable says {table} for particles of type {part_type}, but the dataset Masses has {other}; read is {read}"
    );
    Some((DOUBT_KEY.to_owned(), text))
}

/// Of a magnetic field whose unit nothing in the file tells, though it states others.
pub(super) fn of_magnetic_field(table: &ParticleTable) -> Option<(String, String)> {
    table.column(names::MAGNETIC_FIELD)?;
    let text = "nothing says what its magnetic field is in, and codes differ: it is taken for units in which the magnetic pressure is B^2/2, not for \
                gauss; an attribute GIZMO_version of the header says that it is in gauss";
    Some((DOUBT_KEY.to_owned(), text.to_owned()))
}

/// Of numbers in single precision.
const ROUNDING: f64 = 1e-6;
