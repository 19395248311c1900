//! PLUTO: one step on a static grid.

use super::mesh::{Mesh, grid, unsupported};
use super::pluto_grid::{GRID_FILE, PlutoGrid, corner};
use super::schema::DENSITY_NAMES;
use crate::common::hdf5_read::Reader;
use crate::error::Result;
use crate::model::{Coordinates, Geometry, Location, Values};
use std::path::Path;

/// Names of the coordinates.
const AXES: [&str; 3] = ["X", "Y", "Z"];
/// How far the corners of a line of cells may be apart, relative to the extent: they are stored in f32.
const STRAIGHT: f64 = 1e-5;

/// The only step of a file.
pub struct Step<'a> {
    file: &'a Reader<'a>,
    path: &'a Path,
    /// Group of the variables.
    group: String,
    time: Option<f64>,
    coordinates: Coordinates,
    /// Dimensions of the datasets.
    rank: usize,
    /// Faces along x1, x2, x3; along as many as the grid has dimensions, or all three in curvilinear coordinates.
    faces: Vec<Vec<f64>>,
}

impl<'a> Step<'a> {
    /// # Errors
    /// Where there is not one step, or the grid is not rectilinear.
    pub fn open(file: &'a Reader<'a>, path: &'a Path, groups: &[String]) -> Result<Self> {
        let steps: Vec<&String> = groups.iter().filter(|g| g.starts_with("Timestep_")).collect();
        let [step] = steps.as_slice() else {
            let problem = format!("there are {} groups Timestep_<n>, expected one", steps.len());
            return Err(file.input("group '/'", problem));
        };
        let time = file.group_attributes(step)?.number("Time");
        let group = format!("{step}/vars");
        let stated = PlutoGrid::beside(path)?;
        let nodes = Nodes::read(file)?;
        let rank = nodes.shape.len();
        let coordinates = stated.as_ref().map_or(Coordinates::Cartesian, |s| s.coordinates);
        let faces = match &stated {
            // In one dimension the corners are the radii.
            Some(stated) if coordinates.is_curvilinear() && (rank > 1 || coordinates != Coordinates::Spherical) => {
                nodes.of_grid(file, stated)?
            }
            _ => nodes.straight(path)?,
        };
        if stated.is_none() && rank < 3 && faces[0][0] >= 0.0 {
            let what = format!(
                "a grid of {rank} dimensions whose first coordinate may be x or a radius, which the file does not say; put \
                 PLUTO's {GRID_FILE} of the run beside it"
            );
            return Err(unsupported(path, what));
        }
        Ok(Self { file, path, group, time, coordinates, rank, faces })
    }

    /// # Errors
    /// Where the grid is a single cell.
    pub fn mesh(&self) -> Result<Mesh> {
        let cells: Vec<usize> = self.faces.iter().map(|f| f.len() - 1).take(self.rank).collect();
        let (geometry, location) = match (self.coordinates, self.faces.as_slice()) {
            (Coordinates::Spherical, [nodes]) => {
                (Geometry::Radial { nodes: nodes.clone(), unit: None }, Location::Cell)
            }
            (coordinates, faces) => (grid(self.path, coordinates, faces.to_vec())?, Location::Node),
        };
        let (mut names, mut notes) = (Vec::new(), vec![format!("PLUTO grid of {cells:?} cells")]);
        for name in self.file.datasets(&self.group)? {
            let shape = self.file.shape(&format!("{}/{name}", self.group))?;
            let fits = shape.iter().rev().copied().eq(cells.iter().map(|n| *n as u64));
            if fits || DENSITY_NAMES.contains(&name.as_str()) {
                names.push(name);
            } else {
                notes.push(format!("'{name}' was left out: it has shape {shape:?}, unlike the grid"));
            }
        }
        Ok(Mesh {
            geometry,
            location,
            names,
            units: None,
            metadata: self.time.map(|t| ("time".to_owned(), t.to_string())).into_iter().collect(),
            notes,
        })
    }

    /// # Errors
    /// Where it is missing or has another shape than the grid.
    pub fn variable(&self, name: &str) -> Result<(String, Values)> {
        let path = format!("{}/{name}", self.group);
        let expected: Vec<usize> = self.faces[..self.rank].iter().rev().map(|f| f.len() - 1).collect();
        match self.file.array(&path)? {
            // The last index is x1, which runs fastest.
            Some((shape, values)) if shape == expected => Ok((name.to_owned(), values)),
            Some((shape, _)) => {
                let problem = format!("has shape {shape:?}, expected {expected:?} by the nodes");
                Err(self.file.input(format!("dataset '{path}'"), problem))
            }
            None => Err(self.file.input(format!("dataset '{path}'"), "has no numbers")),
        }
    }
}

/// Corners of the cells, as Cartesian coordinates in space or in a plane.
struct Nodes {
    /// Corners along each index, that of x1 last.
    shape: Vec<usize>,
    /// One coordinate after the other.
    values: Vec<Values>,
}

impl Nodes {
    /// As many coordinates as the first has indices: flat grids may have a Z nevertheless.
    fn read(file: &Reader) -> Result<Self> {
        let present = file.datasets("node_coords")?;
        let (mut shape, mut values) = (Vec::new(), Vec::new());
        for (axis, name) in AXES.iter().enumerate() {
            if axis > 0 && axis >= shape.len() || !present.iter().any(|p| p == name) {
                break;
            }
            let location = format!("dataset 'node_coords/{name}'");
            let found = file.array(&format!("node_coords/{name}"))?;
            let Some((own, all)) = found.filter(|(s, _)| (1..=3).contains(&s.len()) && s.iter().all(|n| *n >= 2))
            else {
                return Err(
                    file.input(location, "expected corners of cells in 1 to 3 dimensions, at least 2 along each")
                );
            };
            if axis > 0 && shape != own {
                return Err(file.input(location, format!("has shape {own:?}, unlike the other coordinates")));
            }
            shape = own;
            values.push(all);
        }
        if values.is_empty() || values.len() != shape.len() {
            let problem = format!("has coordinates {present:?} for a grid of {} dimensions", shape.len());
            return Err(file.input("group 'node_coords'", problem));
        }
        Ok(Self { shape, values })
    }

    /// Faces of cells whose coordinates depend on their own index alone.
    fn straight(&self, path: &Path) -> Result<Vec<Vec<f64>>> {
        let mut faces = Vec::new();
        for (axis, values) in self.values.iter().enumerate() {
            let (count, stride) = line(&self.shape, axis);
            let face = |i: usize| values.get(i * stride);
            let extent = face(count - 1) - face(0);
            let bent = |flat: usize| !((values.get(flat) - face(flat / stride % count)).abs() <= STRAIGHT * extent);
            if (0..values.len()).any(bent) {
                let what = format!(
                    "a curvilinear grid: {} does not depend on one index alone; put PLUTO's {GRID_FILE} of the run beside it, \
                     which names the coordinates",
                    AXES[axis]
                );
                return Err(unsupported(path, what));
            }
            faces.push((0..count).map(face).collect());
        }
        Ok(faces)
    }

    /// Faces of the grid that `stated` says, if these corners are its.
    fn of_grid(&self, file: &Reader, stated: &PlutoGrid) -> Result<Vec<Vec<f64>>> {
        let faces = stated.faces()?;
        let rank = self.shape.len();
        let other = |problem: String| {
            Err(file
                .input("group 'node_coords'", format!("{problem}: {GRID_FILE} beside the file is that of another run")))
        };
        let counts: Vec<usize> = faces.iter().map(Vec::len).collect();
        if !self.shape.iter().rev().eq(&counts[..rank]) || counts[rank..].iter().any(|n| *n > 2) {
            let own: Vec<usize> = self.shape.iter().rev().map(|n| n - 1).collect();
            let theirs: Vec<usize> = counts.iter().map(|n| n - 1).collect();
            return other(format!("has {own:?} cells, {GRID_FILE} {theirs:?}"));
        }
        let all = self.values.iter().flat_map(|v| (0..v.len()).map(|i| v.get(i).abs()));
        let largest = all.fold(0.0, f64::max);
        for flat in 0..self.values[0].len() {
            let mut rest = flat;
            let mut u = [0.0; 3];
            for k in 0..rank {
                u[k] = faces[k][rest % counts[k]];
                rest /= counts[k];
            }
            let expected = corner(stated.coordinates, rank, u);
            let found: Vec<f64> = self.values.iter().map(|v| v.get(flat)).collect();
            if !found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= STRAIGHT * largest) {
                return other(format!("has a corner at {found:?}, where {GRID_FILE} has {:?}", &expected[..rank]));
            }
        }
        Ok(faces.to_vec())
    }
}

/// Length and stride of an axis in a shape whose last index is x1.
fn line(shape: &[usize], axis: usize) -> (usize, usize) {
    let mut sizes = shape.iter().rev();
    let stride = sizes.by_ref().take(axis).product();
    (sizes.next().copied().unwrap_or(1), stride)
}
