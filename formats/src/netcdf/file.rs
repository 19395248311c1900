//! An open file: its contents by name, and the texts of its errors.

use super::axes::{self, Role};
use super::schema::NAME;
use crate::error::{FormatError, Result};
use crate::limits::{Budget, MAX_VARIABLE_BYTES};
use crate::units::Unit;
use netcdf_reader::{FileStorage, NcAttrValue, NcFile, NcFormat, NcOpenOptions, NcVariable};
use std::path::Path;
use std::sync::Arc;

/// An open file and what its errors should say.
pub struct File<'p> {
    pub nc: NcFile,
    pub path: &'p Path,
    pub bytes: u64,
    pub budget: Budget,
}

impl<'p> File<'p> {
    pub fn open(path: &'p Path) -> Result<Self> {
        let metadata = std::fs::metadata(path).map_err(|e| FormatError::io(path, "open", e))?;
        let options = NcOpenOptions {
            max_read_bytes: usize::try_from(MAX_VARIABLE_BYTES).unwrap_or(usize::MAX),
            ..NcOpenOptions::default()
        };
        let damaged =
            |e| FormatError::input(path, NAME, "header", format!("{e}; the file is damaged, incomplete or not NetCDF"));
        let mut nc = NcFile::open_with_options(path, options).map_err(damaged)?;
        if is_classic(&nc) {
            // Read by ranges: what a map of the file has touched would count as memory beside the numbers made of it.
            let storage = FileStorage::open(path).map_err(|e| damaged(e.into()))?;
            nc = NcFile::from_storage(Arc::new(storage)).map_err(damaged)?;
        }
        Ok(Self { nc, path, bytes: metadata.len(), budget: Budget::new(metadata.len()) })
    }

    /// Whether the file has one of the layouts from before NetCDF-4, which compress nothing.
    pub fn is_classic(&self) -> bool {
        is_classic(&self.nc)
    }

    pub fn input(&self, location: &str, problem: impl Into<String>) -> FormatError {
        FormatError::input(self.path, NAME, location, problem)
    }

    pub fn damaged(&self, location: &str, e: netcdf_reader::Error) -> FormatError {
        match e {
            netcdf_reader::Error::Hdf5(hdf5_reader::error::Error::UnsupportedFilter(filter)) => self.unsupported(format!(
                "compression of {location} by {filter}; only deflate, shuffle and fletcher32 are read, so copy the file with nccopy -F none"
            )),
            e => self.input(location, format!("{e}; the file is damaged or incomplete")),
        }
    }

    pub fn unsupported(&self, what: impl Into<String>) -> FormatError {
        FormatError::Unsupported { path: self.path.into(), format: NAME, what: what.into() }
    }

    pub fn variables(&self) -> Result<&[NcVariable]> {
        self.nc.variables().map_err(|e| self.damaged("header", e))
    }

    /// The coordinate variable of a dimension.
    pub fn coordinate(&self, dimension: &str) -> Option<&NcVariable> {
        self.nc.coordinate_variable(dimension).ok().filter(|v| v.ndim() == 1)
    }

    pub fn role(&self, dimension: &str) -> Option<Role> {
        axes::role(dimension, self.coordinate(dimension))
    }
}

fn is_classic(nc: &NcFile) -> bool {
    matches!(nc.format(), NcFormat::Classic | NcFormat::Offset64 | NcFormat::Cdf5)
}

/// The global attributes as texts.
pub fn metadata(file: &File) -> Vec<(String, String)> {
    let attributes = file.nc.global_attributes().unwrap_or_default();
    let as_text = |value: &NcAttrValue| {
        let numbers = || value.as_f64_vec().map(|v| v.iter().map(f64::to_string).collect::<Vec<_>>().join(" "));
        value.as_string().or_else(numbers)
    };
    attributes.iter().filter_map(|a| Some((a.name.clone(), as_text(&a.value)?))).collect()
}

/// The unit of a variable, where it states one that is known.
pub fn unit(file: &File, variable: &NcVariable, notes: &mut Vec<String>) -> Option<Unit> {
    let symbol = axes::text(variable, "units").or_else(|| {
        // Some files state the unit in the title only: `Density (kg/m^3)`.
        let title = axes::text(variable, "display_name")?;
        let (_, inner) = title.strip_suffix(')')?.rsplit_once('(')?;
        Some(inner.to_owned())
    })?;
    let unit = Unit::parse(&symbol);
    if unit.is_none() {
        let file = file.path.display();
        notes.push(format!("unit '{symbol}' of variable '{}' in '{file}' is not known", variable.name()));
    }
    unit
}
