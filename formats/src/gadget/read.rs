//! Reads GADGET-style snapshots, SWIFT's initial conditions included.

use crate::common::particle_names as names;
use crate::error::{FormatError, Result};
use crate::model::{Column, ParticleFile, ParticleTable, RunHeader, Species, Values};
use crate::registry::{FieldRequest, FileContent};
use crate::units::{UnitDimension, UnitSystem};
use hdf5_reader::group::Group;
use hdf5_reader::{Attribute, Dataset, Datatype, Hdf5File};
use std::path::Path;

const FORMAT: &str = "gadget";
/// Names of datasets that other codes give to what we know under another.
const SYNONYMS: [(&str, &str); 4] = [
    ("SmoothingLengths", "SmoothingLength"),
    ("InternalEnergies", names::INTERNAL_ENERGY),
    ("Densities", names::DENSITY),
    ("Temperatures", names::TEMPERATURE),
];

pub(super) fn read(path: &Path, _request: &FieldRequest) -> Result<FileContent> {
    let bytes = std::fs::metadata(path).map_err(|e| FormatError::io(path, "read", e))?.len();
    let file =
        Hdf5File::open(path).map_err(|e| FormatError::input(path, FORMAT, "file", format!("no readable HDF5: {e}")))?;
    let root = file.root_group().map_err(|e| FormatError::input(path, FORMAT, "group '/'", e.to_string()))?;
    let header_group = root.group("Header").map_err(|_| {
        FormatError::input(path, FORMAT, "group '/Header'", "is missing; expected a GADGET- or SWIFT-style snapshot")
    })?;
    let header = header(&header_group, &root);
    let mut species = Vec::new();
    for part_type in 0..6_u8 {
        let name = format!("PartType{part_type}");
        if let Ok(group) = root.group(&name) {
            species.push(Species { part_type, table: table(path, &group, &name, bytes)? });
        }
    }
    if species.is_empty() {
        return Err(FormatError::input(path, FORMAT, "groups '/PartType0' to '/PartType5'", "are all missing"));
    }
    Ok(FileContent::Particles(ParticleFile { header, species }))
}

fn numbers(group: &Group, name: &str) -> Option<Vec<f64>> {
    attribute_numbers(&group.attribute(name).ok()?)
}

/// Values of a numeric attribute of any type.
fn attribute_numbers(attribute: &Attribute) -> Option<Vec<f64>> {
    let whole = |v: Vec<i64>| v.into_iter().map(|i| i as f64).collect();
    attribute
        .read_1d::<f64>()
        .or_else(|_| attribute.read_1d::<f32>().map(|v| v.into_iter().map(f64::from).collect()))
        .or_else(|_| attribute.read_1d::<i64>().map(whole))
        .or_else(|_| attribute.read_1d::<i32>().map(|v| v.into_iter().map(f64::from).collect()))
        .or_else(|_| attribute.read_1d::<u32>().map(|v| v.into_iter().map(f64::from).collect()))
        .ok()
}

fn header(group: &Group, root: &Group) -> RunHeader {
    let one = |name: &str| numbers(group, name).and_then(|v| v.first().copied());
    let sizes = numbers(group, "BoxSize").unwrap_or_default();
    let edge = sizes.first().copied().unwrap_or(0.0);
    let units = root.group("Units").ok().and_then(|u| {
        let factor = |name: &str| numbers(&u, name).and_then(|v| v.first().copied());
        Some(UnitSystem {
            length: factor("Unit length in cgs (U_L)")?,
            mass: factor("Unit mass in cgs (U_M)")?,
            time: factor("Unit time in cgs (U_t)")?,
            temperature: factor("Unit temperature in cgs (U_T)").unwrap_or(1.0),
        })
    });
    let dimension = one("Dimension").filter(|d| (1.0..=3.0).contains(d)).map_or(3, |d| d as usize);
    let provenance = root.group("SphPrep").ok().map(|g| {
        let attributes = g.attributes().unwrap_or_default();
        attributes.into_iter().filter_map(|a| a.read_string().ok().map(|v| (a.name, v))).collect()
    });
    RunHeader {
        dimension,
        box_size: std::array::from_fn(|k| if k < dimension { sizes.get(k).copied().unwrap_or(edge) } else { 0.0 }),
        periodic: [false; 3],
        units: units.unwrap_or(UnitSystem::CODE),
        time: one("Time").unwrap_or(0.0),
        kernel: String::new(),
        kernel_neighbors: 0.0,
        provenance: provenance.unwrap_or_default(),
    }
}

fn table(path: &Path, group: &Group, group_name: &str, file_bytes: u64) -> Result<ParticleTable> {
    let broken = |name: &str, problem: String| {
        FormatError::input(path, FORMAT, format!("dataset '/{group_name}/{name}'"), problem)
    };
    let mut datasets = group.datasets().map_err(|e| broken("", format!("cannot be listed: {e}")))?;
    datasets.sort_by(|a, b| a.name().cmp(b.name()));
    let mut table = ParticleTable::default();
    for dataset in datasets {
        let name = dataset.name().rsplit('/').next().unwrap_or_default().to_owned();
        let too_large = |v: &u64| usize::try_from(*v).ok();
        let shape: Option<Vec<usize>> = dataset.shape().iter().map(too_large).collect();
        let (rows, components) = match shape.as_deref() {
            Some([n]) => (*n, 1),
            Some([n, c]) if (1..=64).contains(c) => (*n, *c),
            _ => {
                return Err(broken(
                    &name,
                    format!("has shape {:?}, expected (N,) or (N, components)", dataset.shape()),
                ));
            }
        };
        let declared = (rows as u64).saturating_mul(components as u64);
        if declared > file_bytes.saturating_mul(crate::limits::MAX_EXPANSION) {
            return Err(FormatError::Limit {
                path: path.into(),
                format: FORMAT,
                location: format!("dataset '/{group_name}/{name}'"),
                declared: format!("{declared} values"),
                allowed: format!("a file of {file_bytes} bytes can hold"),
            });
        }
        if table.columns.is_empty() {
            table.count = rows;
        } else if rows != table.count {
            return Err(broken(&name, format!("has {rows} rows, the others {}", table.count)));
        }
        let values = values(&dataset).map_err(|e| broken(&name, format!("cannot be read: {e}")))?;
        let exponent = |which: &str| {
            attribute_numbers(&dataset.attribute(which).ok()?)?.first().map(|v| v.round().clamp(-100.0, 100.0) as i8)
        };
        let dimension = UnitDimension::new(
            exponent("U_L exponent").unwrap_or(0),
            exponent("U_M exponent").unwrap_or(0),
            exponent("U_t exponent").unwrap_or(0),
            exponent("U_T exponent").unwrap_or(0),
        );
        let name = SYNONYMS.iter().find(|(theirs, _)| *theirs == name).map_or(name, |(_, ours)| (*ours).to_owned());
        table.columns.push(Column { name, components, values, dimension });
    }
    Ok(table)
}

/// Values in the file's own precision.
fn values(dataset: &Dataset) -> std::result::Result<Values, String> {
    fn all<T: hdf5_reader::H5Type>(dataset: &Dataset) -> std::result::Result<Vec<T>, String> {
        dataset.read_array::<T>().map(|a| a.into_raw_vec_and_offset().0).map_err(|e| e.to_string())
    }
    fn whole<T: hdf5_reader::H5Type + TryInto<i64>>(dataset: &Dataset) -> std::result::Result<Values, String> {
        let wide = all::<T>(dataset)?.into_iter().map(TryInto::try_into).collect::<std::result::Result<Vec<i64>, _>>();
        wide.map(Values::I64).map_err(|_| "holds an integer beyond 2^63".to_owned())
    }
    match dataset.dtype() {
        Datatype::FloatingPoint { size: 4, .. } => all(dataset).map(Values::F32),
        Datatype::FloatingPoint { size: 8, .. } => all(dataset).map(Values::F64),
        Datatype::FixedPoint { size: 8, signed: true, .. } => whole::<i64>(dataset),
        Datatype::FixedPoint { size: 8, signed: false, .. } => whole::<u64>(dataset),
        Datatype::FixedPoint { size: 4, signed: true, .. } => whole::<i32>(dataset),
        Datatype::FixedPoint { size: 4, signed: false, .. } => whole::<u32>(dataset),
        other => Err(format!("has type {other:?}, expected a float or integer of 4 or 8 bytes")),
    }
}
