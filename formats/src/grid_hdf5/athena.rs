//! Athena++: mesh blocks of one level are joined to one grid; blocks of several levels are kept as they are.

use super::athena_tree;
use super::mesh::{Mesh, gathered, grid, unsupported};
use super::tree::{Tree, checked};
use crate::common::hdf5_read::{Attributes, Reader};
use crate::error::Result;
use crate::model::{Coordinates, Geometry, Location, Values};
use std::path::Path;

/// Coordinates that are Cartesian in space.
const CARTESIAN: [&str; 2] = ["cartesian", "minkowski"];
const SPHERICAL: &str = "spherical_polar";
const CYLINDRICAL: &str = "cylindrical";

/// The mesh blocks of a file.
pub struct Blocks<'a> {
    file: &'a Reader<'a>,
    path: &'a Path,
    attributes: Attributes,
    /// Cells of the whole grid, and of a block, along x1, x2, x3.
    grid: [usize; 3],
    block: [usize; 3],
    /// First cell of each block of a grid without refinement.
    starts: Vec<[usize; 3]>,
    /// The blocks of one with refinement.
    tree: Option<Tree>,
}

impl<'a> Blocks<'a> {
    /// # Errors
    /// Where blocks do not fill the grid.
    pub fn open(file: &'a Reader<'a>, path: &'a Path) -> Result<Self> {
        let attributes = file.root_attributes()?;
        let sizes = |name: &str| -> Result<[usize; 3]> {
            let found = attributes.numbers(name).unwrap_or_default();
            let valid = |n: &f64| n.fract() == 0.0 && (1.0..1e9).contains(n);
            match found.as_slice() {
                [a, b, c] if [a, b, c].into_iter().all(valid) => Ok([*a, *b, *c].map(|n| n as usize)),
                _ => {
                    Err(file
                        .input(format!("attribute '{name}'"), format!("is {found:?}, expected three numbers of cells")))
                }
            }
        };
        let (grid, block) = (sizes("RootGridSize")?, sizes("MeshBlockSize")?);
        let max_level = attributes.number("MaxLevel").unwrap_or(0.0);
        let mut blocks = Self { file, path, attributes, grid, block, starts: Vec::new(), tree: None };
        if max_level == 0.0 {
            blocks.place()?;
        } else {
            blocks.tree = Some(athena_tree::open(file, max_level, grid, block)?);
        }
        Ok(blocks)
    }

    /// Finds where each block lies, and that they fill the grid.
    fn place(&mut self) -> Result<()> {
        let location = "dataset 'LogicalLocations'";
        let wrong =
            |problem: String| self.file.input(location, format!("{problem} (by 'Levels' and 'LogicalLocations')"));
        let Some((shape, values)) = self.file.array("LogicalLocations")? else {
            return Err(wrong("are not numbers".into()));
        };
        let [count, 3] = *shape.as_slice() else {
            return Err(wrong(format!("have shape {shape:?}, expected (blocks, 3)")));
        };
        let along: Option<[usize; 3]> = (0..3)
            .map(|k| (self.grid[k].is_multiple_of(self.block[k])).then(|| self.grid[k] / self.block[k]))
            .collect::<Option<Vec<_>>>()
            .and_then(|v| v.try_into().ok());
        let expected = along.and_then(|a| a.iter().try_fold(1_usize, |n, &m| n.checked_mul(m)));
        let (Some(along), true) = (along, expected == Some(count)) else {
            let (g, b) = (self.grid, self.block);
            return Err(wrong(format!("has {count} blocks of {b:?} cells, which do not fill the grid of {g:?}")));
        };
        let mut seen = vec![false; count];
        for b in 0..count {
            let at: [f64; 3] = std::array::from_fn(|k| values.get(3 * b + k));
            if !(0..3).all(|k| at[k] >= 0.0 && at[k] < along[k] as f64) {
                return Err(wrong(format!("block {b} is at {at:?}, expected less than {along:?}")));
            }
            let at = at.map(|x| x as usize);
            let slot = seen.get_mut(at[0] + along[0] * (at[1] + along[1] * at[2]));
            if slot.is_none_or(|s| std::mem::replace(s, true)) {
                return Err(wrong(format!("two blocks are at {at:?}")));
            }
            self.starts.push(std::array::from_fn(|k| at[k] * self.block[k]));
        }
        Ok(())
    }

    /// # Errors
    /// Where faces are missing or the coordinates are not supported.
    pub fn mesh(&self) -> Result<Mesh> {
        let name = self.attributes.text("Coordinates").unwrap_or_default();
        let coordinates = match name.as_str() {
            SPHERICAL => Coordinates::Spherical,
            CYLINDRICAL => Coordinates::Polar,
            other if CARTESIAN.contains(&other) => Coordinates::Cartesian,
            other => {
                let what =
                    format!("coordinates '{other}'; known are cartesian, minkowski, {SPHERICAL} and {CYLINDRICAL}");
                return Err(unsupported(self.path, what));
            }
        };
        if let Some(tree) = &self.tree {
            if coordinates != Coordinates::Cartesian {
                let what = format!(
                    "a refined grid in coordinates '{name}'; refined ones are read in cartesian coordinates: write this one to one \
                     level, as Athena++'s athena_read.athdf does with level=0, or resample it"
                );
                return Err(unsupported(self.path, what));
            }
            let (geometry, notes) = checked(tree.grid(self.path)?, "Athena++", |location, problem| {
                self.file.input(location, format!("{problem} (by 'Levels' and 'LogicalLocations')"))
            })?;
            return Ok(Mesh {
                geometry,
                location: Location::Cell,
                names: self.attributes.texts("VariableNames").unwrap_or_default(),
                units: None,
                metadata: self.metadata(),
                notes,
            });
        }
        let radial = coordinates == Coordinates::Spherical && self.grid[1] == 1 && self.grid[2] == 1;
        let mut faces = (0..3).map(|axis| self.faces(axis)).collect::<Result<Vec<_>>>()?;
        let (geometry, location) = if radial {
            (Geometry::Radial { nodes: faces.swap_remove(0), unit: None }, Location::Cell)
        } else {
            (grid(self.path, coordinates, faces)?, Location::Node)
        };
        Ok(Mesh {
            geometry,
            location,
            names: self.attributes.texts("VariableNames").unwrap_or_default(),
            units: None,
            metadata: self.metadata(),
            notes: vec![format!("Athena++ grid of {:?} cells in {} blocks", self.grid, self.starts.len())],
        })
    }

    fn metadata(&self) -> Vec<(String, String)> {
        self.attributes.number("Time").map(|t| ("time".to_owned(), t.to_string())).into_iter().collect()
    }

    fn faces(&self, axis: usize) -> Result<Vec<f64>> {
        let name = format!("x{}f", axis + 1);
        let wrong = |problem: String| self.file.input(format!("dataset '{name}'"), problem);
        let (n, total) = (self.block[axis], self.grid[axis]);
        let found = self.file.array(&name)?;
        let Some((_, values)) = found.filter(|(shape, _)| *shape == [self.starts.len(), n + 1]) else {
            return Err(wrong(format!("expected the faces of {} blocks of {n} cells", self.starts.len())));
        };
        let mut faces = vec![f64::NAN; total + 1];
        for (b, start) in self.starts.iter().enumerate() {
            for i in 0..=n {
                let face = values.get(b * (n + 1) + i);
                let slot = faces.get_mut(start[axis] + i);
                match slot {
                    Some(f) if f.is_nan() || *f == face => *f = face,
                    _ => {
                        return Err(wrong(format!(
                            "block {b} has its face {i} at {face}, where another block differs"
                        )));
                    }
                }
            }
        }
        Ok(faces)
    }

    /// The values of a variable in the order of the grid.
    ///
    /// # Errors
    /// Where it is missing or has another shape than the blocks.
    pub fn variable(&self, name: &str) -> Result<(String, Values)> {
        let names = self.attributes.texts("VariableNames").unwrap_or_default();
        let sets = self.attributes.texts("DatasetNames").unwrap_or_default();
        let counts = self.attributes.numbers("NumVariables").unwrap_or_default();
        let missing = || self.file.input(format!("variable '{name}'"), "is in none of the file's datasets");
        let mut index = names.iter().position(|n| n == name).ok_or_else(missing)?;
        for (set, &count) in sets.iter().zip(&counts) {
            let count = count.max(0.0) as usize;
            if index < count {
                return Ok((name.to_owned(), self.slab(set, index, count)?));
            }
            index -= count;
        }
        Err(missing())
    }

    fn slab(&self, set: &str, index: usize, count: usize) -> Result<Values> {
        let [nx, ny, nz] = self.block;
        let blocks = self.tree.as_ref().map_or(self.starts.len(), |tree| tree.leaves.len());
        let expected = [count, blocks, nz, ny, nx];
        let found = self.file.array(set)?;
        let Some((_, values)) = found.filter(|(shape, _)| *shape == expected) else {
            let problem = format!("expected numbers of shape {expected:?}");
            return Err(self.file.input(format!("dataset '{set}'"), problem));
        };
        let cells = nx * ny * nz;
        if self.tree.is_some() {
            let first = index * blocks * cells;
            return Ok(gathered(&values, first..first + blocks * cells));
        }
        let along: [usize; 3] = std::array::from_fn(|k| self.grid[k] / self.block[k]);
        let mut at = vec![0; self.starts.len()];
        for (b, start) in self.starts.iter().enumerate() {
            let [i, j, k]: [usize; 3] = std::array::from_fn(|axis| start[axis] / self.block[axis]);
            if let Some(slot) = at.get_mut(i + along[0] * (j + along[1] * k)) {
                *slot = b;
            }
        }
        let source = |flat: usize| {
            let (i, rest) = (flat % self.grid[0], flat / self.grid[0]);
            let (j, k) = (rest % self.grid[1], rest / self.grid[1]);
            let block = i / nx + along[0] * (j / ny + along[1] * (k / nz));
            let within = i % nx + nx * (j % ny + ny * (k % nz));
            (index * self.starts.len() + at.get(block).copied().unwrap_or(0)) * cells + within
        };
        Ok(gathered(&values, (0..cells * self.starts.len()).map(source)))
    }
}
