//! Functions of place in every container of grids, under any names.

use rust_hdf5::H5File;
use sph_formats::common::netcdf_classic::{ClassicFile, Data};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

pub type Field = fn([f64; 3]) -> f64;

/// Variables with their names.
pub type Variables<'a> = [(&'a str, Field)];

/// Where values lie.
#[derive(Debug, Clone, Copy)]
pub struct Grid {
    /// Numbers of values along the axes.
    pub counts: [usize; 3],
    /// Corners of the region that nodes, or cells, fill.
    pub low: [f64; 3],
    pub high: [f64; 3],
    /// Whether values lie in the middles of cells; else at nodes, the outermost in the corners.
    pub has_cells: bool,
}

/// A way to write a grid.
pub struct Container {
    pub file: &'static str,
    /// Whether the format says that values belong to cells.
    pub states_cells: bool,
    pub write: fn(&Path, &Grid, &Variables<'_>),
}

pub const CONTAINERS: &[Container] = &[
    Container { file: "grid.nc", states_cells: false, write: netcdf },
    Container { file: "bounds.nc", states_cells: true, write: netcdf_with_bounds },
    Container { file: "grid.vtk", states_cells: false, write: vtk_points },
    Container { file: "cells.vtk", states_cells: true, write: vtk_cells },
    Container { file: "grid.csv", states_cells: false, write: table },
    Container { file: "grid.npz", states_cells: false, write: npz },
    Container { file: "grid.athdf", states_cells: true, write: athena },
    Container { file: "grid.dbl.h5", states_cells: true, write: pluto },
];

impl Grid {
    /// Node `i` of an axis, or the middle of cell `i`.
    fn at(&self, axis: usize, i: usize) -> f64 {
        let (low, extent, n) = (self.low[axis], self.high[axis] - self.low[axis], self.counts[axis] as f64);
        if self.has_cells { low + extent * (i as f64 + 0.5) / n } else { low + extent * i as f64 / (n - 1.0) }
    }

    pub fn line(&self, axis: usize) -> Vec<f64> {
        (0..self.counts[axis]).map(|i| self.at(axis, i)).collect()
    }

    fn face(&self, axis: usize, i: usize) -> f64 {
        self.low[axis] + (self.high[axis] - self.low[axis]) * i as f64 / self.counts[axis] as f64
    }

    fn faces(&self, axis: usize) -> Vec<f64> {
        (0..=self.counts[axis]).map(|i| self.face(axis, i)).collect()
    }

    /// Places with x running fastest.
    fn places(&self) -> Vec<[f64; 3]> {
        let [nx, ny, nz] = self.counts;
        let index = |flat: usize| [flat % nx, flat / nx % ny, flat / (nx * ny)];
        (0..nx * ny * nz).map(|f| std::array::from_fn(|k| self.at(k, index(f)[k]))).collect()
    }

    pub fn values(&self, field: Field) -> Vec<f64> {
        self.places().into_iter().map(field).collect()
    }
}

fn netcdf(path: &Path, grid: &Grid, variables: &Variables<'_>) {
    write_netcdf(path, grid, variables, false);
}

fn netcdf_with_bounds(path: &Path, grid: &Grid, variables: &Variables<'_>) {
    write_netcdf(path, grid, variables, true);
}

fn write_netcdf(path: &Path, grid: &Grid, variables: &Variables<'_>, has_bounds: bool) {
    const NAMES: [&str; 3] = ["x", "y", "z"];
    let mut file = ClassicFile::new();
    let lines: [Vec<f64>; 3] = std::array::from_fn(|k| grid.line(k));
    let pairs: [Vec<f64>; 3] = std::array::from_fn(|k| grid.faces(k).windows(2).flat_map(|w| [w[0], w[1]]).collect());
    let data: Vec<(&str, Vec<f64>)> = variables.iter().map(|(name, f)| (*name, grid.values(*f))).collect();
    let dimensions: [_; 3] = std::array::from_fn(|k| file.dimension(NAMES[k], grid.counts[k]));
    let two = file.dimension("two", 2);
    for (k, name) in NAMES.into_iter().enumerate() {
        let bounds = format!("{name}_bounds");
        let mut attributes = vec![("axis", name.to_uppercase().as_str().into())];
        if has_bounds {
            attributes.push(("bounds", bounds.as_str().into()));
            file.variable(&bounds, &[dimensions[k], two], Data::F64(&pairs[k]), &[]);
        }
        file.variable(name, &[dimensions[k]], Data::F64(&lines[k]), &attributes);
    }
    // In C order z comes first.
    let order = [dimensions[2], dimensions[1], dimensions[0]];
    for (name, values) in &data {
        file.variable(name, &order, Data::F64(values), &[]);
    }
    file.write(path).unwrap();
}

fn vtk(path: &Path, grid: &Grid, variables: &Variables<'_>, has_cells: bool) {
    let [nx, ny, nz] = grid.counts.map(|n| n + usize::from(has_cells));
    let mut text =
        format!("# vtk DataFile Version 3.0\ncloud\nASCII\nDATASET RECTILINEAR_GRID\nDIMENSIONS {nx} {ny} {nz}\n");
    for (k, name) in ["X", "Y", "Z"].iter().enumerate() {
        let n = [nx, ny, nz][k];
        let nodes = if has_cells { grid.faces(k) } else { grid.line(k) };
        let line: Vec<String> = nodes.iter().map(|x| format!("{x:.17e}")).collect();
        writeln!(text, "{name}_COORDINATES {n} double\n{}", line.join(" ")).unwrap();
    }
    let count: usize = grid.counts.iter().product();
    writeln!(text, "{} {count}", if has_cells { "CELL_DATA" } else { "POINT_DATA" }).unwrap();
    for (name, field) in variables {
        writeln!(text, "SCALARS {name} double 1\nLOOKUP_TABLE default").unwrap();
        grid.values(*field).iter().for_each(|v| writeln!(text, "{v:.17e}").unwrap());
    }
    std::fs::write(path, text).unwrap();
}

fn vtk_points(path: &Path, grid: &Grid, variables: &Variables<'_>) {
    vtk(path, grid, variables, false);
}

fn vtk_cells(path: &Path, grid: &Grid, variables: &Variables<'_>) {
    vtk(path, grid, variables, true);
}

fn table(path: &Path, grid: &Grid, variables: &Variables<'_>) {
    let names: Vec<&str> = ["x", "y", "z"].into_iter().chain(variables.iter().map(|v| v.0)).collect();
    let mut text = names.join(",") + "\n";
    for x in grid.places() {
        let row = x.into_iter().chain(variables.iter().map(|(_, f)| f(x)));
        let row: Vec<String> = row.map(|v| format!("{v:.17e}")).collect();
        writeln!(text, "{}", row.join(",")).unwrap();
    }
    std::fs::write(path, text).unwrap();
}

/// An array as NumPy has it in memory of Fortran's order.
pub fn npy(shape: &str, data: &[f64]) -> Vec<u8> {
    let mut dict = format!("{{'descr': '<f8', 'fortran_order': True, 'shape': {shape}, }}\n");
    while !(10 + dict.len()).is_multiple_of(16) {
        dict.insert(dict.len() - 1, ' ');
    }
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((dict.len() as u16).to_le_bytes());
    bytes.extend(dict.as_bytes());
    bytes.extend(data.iter().flat_map(|x| x.to_le_bytes()));
    bytes
}

fn npz(path: &Path, grid: &Grid, variables: &Variables<'_>) {
    let lines = ["x", "y", "z"].into_iter().enumerate().map(|(k, name)| {
        let nodes = grid.line(k);
        (name, npy(&format!("({},)", nodes.len()), &nodes))
    });
    let [nx, ny, nz] = grid.counts;
    let shape = format!("({nx}, {ny}, {nz})");
    archive(path, lines.chain(variables.iter().map(|(name, field)| (*name, npy(&shape, &grid.values(*field))))));
}

/// An archive of arrays.
pub fn archive<'a>(path: &Path, arrays: impl Iterator<Item = (&'a str, Vec<u8>)>) {
    let mut zip = zip::ZipWriter::new(std::fs::File::create(path).unwrap());
    for (name, bytes) in arrays {
        zip.start_file(format!("{name}.npy"), zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(&bytes).unwrap();
    }
    zip.finish().unwrap();
}

/// One block.
fn athena(path: &Path, grid: &Grid, variables: &Variables<'_>) {
    let file = H5File::create(path).unwrap();
    let root = file.root_group();
    let sizes = grid.counts.map(|n| n as i32);
    root.set_attr_string("Coordinates", "cartesian").unwrap();
    root.set_attr_array_numeric("RootGridSize", &sizes).unwrap();
    root.set_attr_array_numeric("MeshBlockSize", &sizes).unwrap();
    root.set_attr_numeric("NumMeshBlocks", &1_i32).unwrap();
    root.set_attr_numeric("MaxLevel", &0_i32).unwrap();
    root.set_attr_string_array("DatasetNames", &["prim"]).unwrap();
    root.set_attr_array_numeric("NumVariables", &[variables.len() as i32]).unwrap();
    let names: Vec<&str> = variables.iter().map(|v| v.0).collect();
    root.set_attr_string_array("VariableNames", &names).unwrap();
    file.new_dataset::<i64>().shape([1, 3]).create("LogicalLocations").unwrap().write_raw(&[0_i64; 3]).unwrap();
    for (k, n) in grid.counts.into_iter().enumerate() {
        let faces = grid.faces(k);
        file.new_dataset::<f64>().shape([1, n + 1]).create(&format!("x{}f", k + 1)).unwrap().write_raw(&faces).unwrap();
    }
    let all: Vec<f64> = variables.iter().flat_map(|(_, f)| grid.values(*f)).collect();
    let [nx, ny, nz] = grid.counts;
    file.new_dataset::<f64>().shape([variables.len(), 1, nz, ny, nx]).create("prim").unwrap().write_raw(&all).unwrap();
    file.close().unwrap();
}

fn pluto(path: &Path, grid: &Grid, variables: &Variables<'_>) {
    let file = H5File::create(path).unwrap();
    let step = file.create_group("Timestep_0").unwrap();
    step.set_attr_numeric("Time", &0.0_f64).unwrap();
    let vars = step.create_group("vars").unwrap();
    let [nx, ny, nz] = grid.counts;
    for (name, field) in variables {
        vars.new_dataset::<f64>().shape([nz, ny, nx]).create(name).unwrap().write_raw(&grid.values(*field)).unwrap();
    }
    let nodes = file.create_group("node_coords").unwrap();
    for (k, name) in ["X", "Y", "Z"].iter().enumerate() {
        let corners: Vec<f64> = (0..(nx + 1) * (ny + 1) * (nz + 1))
            .map(|f| grid.face(k, [f % (nx + 1), f / (nx + 1) % (ny + 1), f / ((nx + 1) * (ny + 1))][k]))
            .collect();
        nodes.new_dataset::<f64>().shape([nz + 1, ny + 1, nx + 1]).create(name).unwrap().write_raw(&corners).unwrap();
    }
    file.close().unwrap();
}
