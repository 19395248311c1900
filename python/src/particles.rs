//! Particle files as Python's dictionaries and NumPy arrays, and back.
//!
//! A header is a dictionary; a species is (type, columns), a column (name, array, exponents of length, mass, time and temperature).
//! Arrays take over the memory of what was placed or read; writing copies them.

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::{PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use sph_formats::{Column, ParticleFile, ParticleTable, RunHeader, Species, UnitDimension, UnitSystem, Values};

/// Header and species of a file.
pub fn to_python(py: Python<'_>, file: ParticleFile) -> PyResult<(Py<PyDict>, Py<PyList>)> {
    let h = file.header;
    let header = PyDict::new(py);
    header.set_item("dimension", h.dimension)?;
    header.set_item("box_size", h.box_size)?;
    header.set_item("box_corner", h.box_corner)?;
    header.set_item("periodic", h.periodic)?;
    let units = PyDict::new(py);
    units.set_item("length", h.units.length)?;
    units.set_item("mass", h.units.mass)?;
    units.set_item("time", h.units.time)?;
    units.set_item("temperature", h.units.temperature)?;
    header.set_item("units", units)?;
    header.set_item("time", h.time)?;
    header.set_item("kernel", h.kernel)?;
    header.set_item("kernel_neighbors", h.kernel_neighbors)?;
    header.set_item("provenance", h.provenance)?;
    let species = PyList::empty(py);
    for Species { part_type, table } in file.species {
        let columns = PyList::empty(py);
        for column in table.columns {
            let d = column.dimension;
            let exponents = (d.length, d.mass, d.time, d.temperature);
            let name = column.name.clone();
            columns.append((name, array(py, column)?, exponents))?;
        }
        species.append((part_type, columns))?;
    }
    Ok((header.unbind(), species.unbind()))
}

/// The values of a column, one row a particle where there are several components.
fn array<'py>(py: Python<'py>, column: Column) -> PyResult<Bound<'py, PyAny>> {
    let components = column.components;
    fn shaped<'py, T: numpy::Element>(py: Python<'py>, v: Vec<T>, components: usize) -> PyResult<Bound<'py, PyAny>> {
        let rows = v.len() / components.max(1);
        let flat = PyArray1::from_vec(py, v);
        if components == 1 {
            return Ok(flat.into_any());
        }
        let shaped: Bound<'py, PyArray2<T>> = flat.reshape([rows, components])?;
        Ok(shaped.into_any())
    }
    match column.values {
        Values::F64(v) => shaped(py, v, components),
        Values::F32(v) => shaped(py, v, components),
        Values::I64(v) => shaped(py, v, components),
    }
}

/// The file of a header and species.
///
/// # Errors
/// A key that is missing, an array that is not of numbers, or has other rows than its fellows.
pub fn from_python(header: &Bound<'_, PyDict>, species: &Bound<'_, PyList>) -> PyResult<ParticleFile> {
    fn get<'py, T: for<'a> FromPyObject<'a, 'py, Error = PyErr>>(dict: &Bound<'py, PyDict>, key: &str) -> PyResult<T> {
        dict.get_item(key)?.ok_or_else(|| PyKeyError::new_err(format!("the header has no '{key}'")))?.extract()
    }
    let units: Bound<'_, PyDict> =
        header.get_item("units")?.ok_or_else(|| PyKeyError::new_err("the header has no 'units'"))?.cast_into()?;
    let run = RunHeader {
        dimension: get(header, "dimension")?,
        box_size: get(header, "box_size")?,
        box_corner: match header.get_item("box_corner")? {
            Some(corner) => corner.extract()?,
            None => None,
        },
        periodic: get(header, "periodic")?,
        units: UnitSystem {
            length: get(&units, "length")?,
            mass: get(&units, "mass")?,
            time: get(&units, "time")?,
            temperature: get(&units, "temperature")?,
        },
        time: get(header, "time")?,
        kernel: get(header, "kernel")?,
        kernel_neighbors: get(header, "kernel_neighbors")?,
        provenance: get(header, "provenance")?,
        layouts: Vec::new(),
    };
    let mut file = ParticleFile { header: run, species: Vec::new() };
    for entry in species.iter() {
        let (part_type, columns): (u8, Bound<'_, PyList>) = {
            let entry = entry.cast::<PyTuple>()?;
            (entry.get_item(0)?.extract()?, entry.get_item(1)?.cast_into()?)
        };
        let columns = columns.iter().map(|c| column(c.cast::<PyTuple>()?)).collect::<PyResult<Vec<Column>>>()?;
        let count = columns.first().map_or(0, |c| c.values.len() / c.components.max(1));
        file.species.push(Species { part_type, table: ParticleTable { count, columns } });
    }
    file.validate().map_err(|(what, problem)| PyValueError::new_err(format!("{what}: {problem}")))?;
    Ok(file)
}

fn column(entry: &Bound<'_, PyTuple>) -> PyResult<Column> {
    let name: String = entry.get_item(0)?.extract()?;
    let (length, mass, time, temperature): (i8, i8, i8, i8) = entry.get_item(2)?.extract()?;
    let given = entry.get_item(1)?;
    let (values, shape) = if let Ok(a) = given.extract::<PyReadonlyArrayDyn<'_, i64>>() {
        (Values::I64(a.as_array().iter().copied().collect()), a.shape().to_vec())
    } else if let Ok(a) = given.extract::<PyReadonlyArrayDyn<'_, f32>>() {
        (Values::F32(a.as_array().iter().copied().collect()), a.shape().to_vec())
    } else if let Ok(a) = given.extract::<PyReadonlyArrayDyn<'_, f64>>() {
        (Values::F64(a.as_array().iter().copied().collect()), a.shape().to_vec())
    } else {
        return Err(PyTypeError::new_err(format!("'{name}' is no array of float64, float32 or int64")));
    };
    let components = match shape.as_slice() {
        [_] => 1,
        [_, components] => *components,
        _ => return Err(PyValueError::new_err(format!("'{name}' has {} axes, expected 1 or 2", shape.len()))),
    };
    let dimension = UnitDimension::new(length, mass, time, temperature);
    Ok(Column { name, components, values, dimension })
}
