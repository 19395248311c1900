//! Particle snapshots in HDF5 as GADGET introduced them and SWIFT, GIZMO and AREPO took them over.
//!
//! One layout that all of them and the usual readers (swiftsimio, yt, pynbody, SPLASH) accept:
//!
//! - `/Header`: all scalars with shape (1,); `NumPart_*` and `MassTable` with 6 entries, `MassTable` zero (else it
//!   overrides `Masses`), `Flag_DoublePrecision` 0 even with f64 data (GIZMO stops on 1).
//! - `/Units`: exactly five factors to cgs (SWIFT wants all five, swiftsimio no more).
//! - `/PartType0`: the datasets of the flavor's table, each with its exponents of the units.
//! - `/SphPrep`: provenance, in a group of its own because readers stumble over it elsewhere.

use super::hdf5;
use super::particle_names as names;
use crate::error::{FormatError, Result};
use crate::model::{Column, ParticleFile, ParticleTable, RunHeader, Species, Values};
use crate::registry::WriteOptions;
use crate::units::UnitDimension;
use rust_hdf5::{H5Dataset, H5Group};
use std::path::Path;

/// How a dataset is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Storage {
    /// f64 always.
    Double,
    /// f32, or f64 on request.
    Float,
    /// u64.
    Identifier,
    /// i32.
    Integer,
}

/// What to do where the column is absent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Absent {
    /// The flavor cannot do without; the text is the remedy.
    Refuse(&'static str),
    /// Zeros mean what absence means (particles at rest).
    Zero,
    Skip,
}

/// One dataset of a flavor.
#[derive(Debug, Clone, Copy)]
pub struct DatasetSpec {
    /// Name in the file.
    pub name: &'static str,
    /// Name of the particle column.
    pub column: &'static str,
    pub storage: Storage,
    /// 3 for vectors, which are padded with zeros in fewer dimensions.
    pub components: usize,
    pub absent: Absent,
}

/// How the flavor's smoothing length follows from the particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SmoothingLength {
    /// h = eta (m/rho)^(1/d).
    Eta(f64),
    /// The kernel's support radius.
    SupportRadius,
}

/// A flavor of the layout.
pub struct Flavor {
    pub format: &'static str,
    pub datasets: &'static [DatasetSpec],
    pub smoothing_length: SmoothingLength,
    /// Whether a box may have three different edges.
    pub box_may_differ: bool,
}

/// Writes a snapshot.
///
/// # Errors
/// [`FormatError::Output`] for what the flavor cannot hold, [`FormatError::Io`].
pub fn write(flavor: &Flavor, path: &Path, file: &ParticleFile, options: WriteOptions) -> Result<()> {
    let writer = Writer { flavor, path, header: &file.header, options };
    let h5 = hdf5::create(path)?;
    let group = |name: &str| h5.create_group(name).map_err(|e| hdf5::io(path, "write", e));
    writer.header(&group("Header")?, &file.species)?;
    writer.units(&group("Units")?)?;
    for species in &file.species {
        writer.species(&group(&format!("PartType{}", species.part_type))?, &species.table)?;
    }
    let provenance = group("SphPrep")?;
    for (key, value) in &file.header.provenance {
        provenance.set_attr_string(key, value).map_err(|e| hdf5::io(path, "write", e))?;
    }
    h5.close().map_err(|e| hdf5::io(path, "write", e))
}

struct Writer<'a> {
    flavor: &'a Flavor,
    path: &'a Path,
    header: &'a RunHeader,
    options: WriteOptions,
}

impl Writer<'_> {
    fn refuse(&self, problem: String) -> FormatError {
        FormatError::Output { path: self.path.into(), format: self.flavor.format, problem }
    }

    fn header(&self, group: &H5Group, species: &[Species]) -> Result<()> {
        let mut counts = [0_u64; 6];
        for s in species {
            let slot = counts
                .get_mut(usize::from(s.part_type))
                .ok_or_else(|| self.refuse(format!("particle type {} is not one of 0 to 5", s.part_type)))?;
            *slot += s.table.count as u64;
        }
        let low = counts.map(|c| (c & 0xffff_ffff) as u32);
        let high = counts.map(|c| (c >> 32) as u32);
        let (path, h) = (self.path, self.header);
        hdf5::attribute(path, group, "Dimension", &[h.dimension as i32])?;
        hdf5::attribute(path, group, "BoxSize", &self.box_size()?)?;
        hdf5::attribute(path, group, "NumPart_ThisFile", &low)?;
        hdf5::attribute(path, group, "NumPart_Total", &low)?;
        hdf5::attribute(path, group, "NumPart_Total_HighWord", &high)?;
        hdf5::attribute(path, group, "MassTable", &[0.0_f64; 6])?;
        hdf5::attribute(path, group, "Time", &[h.time])?;
        hdf5::attribute(path, group, "Redshift", &[0.0_f64])?;
        for (name, value) in [
            ("NumFilesPerSnapshot", 1_i32),
            ("Flag_Entropy_ICs", 0),
            ("Flag_Sfr", 0),
            ("Flag_Feedback", 0),
            ("Flag_Cooling", 0),
            ("Flag_StellarAge", 0),
            ("Flag_Metals", 0),
            ("Flag_DoublePrecision", 0),
        ] {
            hdf5::attribute(path, group, name, &[value])?;
        }
        Ok(())
    }

    /// One edge where all are equal (or the code reads only one), else three.
    fn box_size(&self) -> Result<Vec<f64>> {
        let used = &self.header.box_size[..self.header.dimension];
        let largest = used.iter().fold(0.0_f64, |m, &b| m.max(b));
        if used.iter().all(|b| (b / largest - 1.0).abs() < 1e-12) {
            return Ok(vec![largest]);
        }
        if !self.flavor.box_may_differ {
            return Err(self.refuse(format!(
                "the box has edges {used:?}, but this flavor holds only cubes; write the swift flavor, or choose a cubic domain"
            )));
        }
        // A missing axis gets the largest edge, so that no code sees a box without volume.
        Ok((0..3).map(|k| used.get(k).copied().unwrap_or(largest)).collect())
    }

    fn units(&self, group: &H5Group) -> Result<()> {
        let u = &self.header.units;
        for (name, value) in [
            ("Unit length in cgs (U_L)", u.length),
            ("Unit mass in cgs (U_M)", u.mass),
            ("Unit time in cgs (U_t)", u.time),
            ("Unit current in cgs (U_I)", 1.0),
            ("Unit temperature in cgs (U_T)", u.temperature),
        ] {
            hdf5::attribute(self.path, group, name, &[value])?;
        }
        Ok(())
    }

    fn species(&self, group: &H5Group, table: &ParticleTable) -> Result<()> {
        for spec in self.flavor.datasets {
            match (table.column(spec.column), spec.absent) {
                (Some(column), _) => self.column(group, spec, column, table.count)?,
                (None, Absent::Skip) => {}
                (None, Absent::Zero) => {
                    let zero = Column {
                        name: spec.column.into(),
                        components: spec.components,
                        values: Values::F32(Vec::new()),
                        dimension: UnitDimension::VELOCITY,
                    };
                    self.store(group, spec, &zero.dimension, table.count, |_, _| 0.0)?;
                }
                (None, Absent::Refuse(remedy)) => {
                    return Err(self.refuse(format!("it needs {}, but there is no such column; {remedy}", spec.name)));
                }
            }
        }
        self.smoothing_length(group, table)?;
        let known = |name: &str| name == names::SUPPORT_RADIUS || self.flavor.datasets.iter().any(|d| d.column == name);
        for column in table.columns.iter().filter(|c| !known(&c.name)) {
            let storage = if matches!(column.values, Values::I64(_)) { Storage::Integer } else { Storage::Float };
            let spec = ExtraSpec { name: &column.name, storage, components: column.components };
            self.extra(group, &spec, column, table.count)?;
        }
        Ok(())
    }

    fn column(&self, group: &H5Group, spec: &DatasetSpec, column: &Column, count: usize) -> Result<()> {
        let (given, wanted) = (column.components, spec.components);
        if given > wanted {
            return Err(self.refuse(format!("column '{}' has {given} components, expected {wanted}", column.name)));
        }
        let values = &column.values;
        self.store(
            group,
            spec,
            &column.dimension,
            count,
            |i, k| if k < given { values.get(i * given + k) } else { 0.0 },
        )
    }

    fn extra(&self, group: &H5Group, spec: &ExtraSpec<'_>, column: &Column, count: usize) -> Result<()> {
        let (n, values) = (spec.components, &column.values);
        self.store_as(group, spec.name, spec.storage, n, &column.dimension, count, &|i, k| values.get(i * n + k))
    }

    /// h in the flavor's convention.
    fn smoothing_length(&self, group: &H5Group, table: &ParticleTable) -> Result<()> {
        let need = |name: &str| {
            table.column(name).ok_or_else(|| self.refuse(format!("SmoothingLength needs the column '{name}'")))
        };
        let length = UnitDimension::LENGTH;
        let store = |value: &dyn Fn(usize, usize) -> f64| {
            self.store_as(group, "SmoothingLength", Storage::Float, 1, &length, table.count, value)
        };
        match self.flavor.smoothing_length {
            SmoothingLength::SupportRadius => {
                let support = need(names::SUPPORT_RADIUS)?;
                store(&|i, _| support.values.get(i))
            }
            SmoothingLength::Eta(eta) => {
                let (mass, density) = (need(names::MASSES)?, need(names::DENSITY)?);
                let power = 1.0 / self.header.dimension as f64;
                store(&|i, _| eta * (mass.values.get(i) / density.values.get(i)).powf(power))
            }
        }
    }

    fn store(
        &self,
        group: &H5Group,
        spec: &DatasetSpec,
        dimension: &UnitDimension,
        count: usize,
        value: impl Fn(usize, usize) -> f64,
    ) -> Result<()> {
        self.store_as(group, spec.name, spec.storage, spec.components, dimension, count, &value)
    }

    #[allow(clippy::too_many_arguments)] // one call per fact of a dataset; a struct would name them twice
    fn store_as(
        &self,
        group: &H5Group,
        name: &str,
        storage: Storage,
        components: usize,
        dimension: &UnitDimension,
        count: usize,
        value: &dyn Fn(usize, usize) -> f64,
    ) -> Result<()> {
        let (path, level, shape) = (self.path, self.options.compression, (count, components));
        let double = storage == Storage::Double || (storage == Storage::Float && self.options.double_precision);
        self.check(name, shape, double || storage != Storage::Float, value)?;
        let dataset = match storage {
            _ if double => hdf5::dataset::<f64>(path, group, name, shape, level, value)?,
            Storage::Float | Storage::Double => {
                hdf5::dataset::<f32>(path, group, name, shape, level, |i, k| value(i, k) as f32)?
            }
            Storage::Identifier => hdf5::dataset::<u64>(path, group, name, shape, level, |i, k| value(i, k) as u64)?,
            Storage::Integer => hdf5::dataset::<i32>(path, group, name, shape, level, |i, k| value(i, k) as i32)?,
        };
        self.exponents(&dataset, dimension)
    }

    /// Refuses what the file could not hold: values that are not finite, or beyond f32.
    fn check(
        &self,
        name: &str,
        (rows, columns): (usize, usize),
        wide: bool,
        value: &dyn Fn(usize, usize) -> f64,
    ) -> Result<()> {
        let limit = if wide { f64::MAX } else { f64::from(f32::MAX) };
        for i in 0..rows {
            for k in 0..columns {
                let v = value(i, k);
                if !(v.abs() <= limit) {
                    return Err(self.refuse(format!(
                        "{name} of particle {i} is {v:e}, which {} cannot hold; choose other units (output.units) or double precision (output.double_precision)",
                        if wide { "f64" } else { "f32" }
                    )));
                }
            }
        }
        Ok(())
    }

    fn exponents(&self, dataset: &H5Dataset, d: &UnitDimension) -> Result<()> {
        for (name, power) in [
            ("U_M exponent", d.mass),
            ("U_L exponent", d.length),
            ("U_t exponent", d.time),
            ("U_I exponent", 0),
            ("U_T exponent", d.temperature),
            ("a-scale exponent", 0),
            ("h-scale exponent", 0),
        ] {
            hdf5::dataset_attribute(self.path, dataset, name, power.into())?;
        }
        Ok(())
    }
}

/// A carried column under its own name.
struct ExtraSpec<'a> {
    name: &'a str,
    storage: Storage,
    components: usize,
}
