//! PLUTO: one step on a static grid.

use super::mesh::{Mesh, grid, unsupported};
use super::schema::DENSITY_NAMES;
use crate::common::hdf5_read::Reader;
use crate::error::Result;
use crate::model::{Geometry, Location, Values};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Names of the coordinates.
const AXES: [&str; 3] = ["X", "Y", "Z"];
/// What PLUTO writes into the folder of its output, and whose head names the coordinates.
const GRID_FILE: &str = "grid.out";
const GRID_HEAD: u64 = 4096;
/// How far the corners of a line of cells may be apart, relative to the extent: they are stored in f32.
const STRAIGHT: f64 = 1e-5;

/// The only step of a file.
pub struct Step<'a> {
    file: &'a Reader<'a>,
    path: &'a Path,
    /// Group of the variables.
    group: String,
    time: Option<f64>,
    /// Faces along x1, x2, x3, as far as the grid has axes.
    faces: Vec<Vec<f64>>,
    radial: bool,
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
        let faces = faces(file, path)?;
        let radial = is_radial(path, &faces)?;
        Ok(Self { file, path, group: format!("{step}/vars"), time, faces, radial })
    }

    /// # Errors
    /// Where the grid is a single cell.
    pub fn mesh(&self) -> Result<Mesh> {
        let cells: Vec<usize> = self.faces.iter().map(|f| f.len() - 1).collect();
        let (geometry, location) = match self.faces.as_slice() {
            [nodes] if self.radial => (Geometry::Radial { nodes: nodes.clone(), unit: None }, Location::Cell),
            faces => (grid(self.path, faces.to_vec())?, Location::Node),
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
            metadata: self.time.map(|t| ("time".to_owned(), t.to_string())).into_iter().collect(),
            notes,
        })
    }

    /// # Errors
    /// Where it is missing or has another shape than the grid.
    pub fn variable(&self, name: &str) -> Result<(String, Values)> {
        let path = format!("{}/{name}", self.group);
        let expected: Vec<usize> = self.faces.iter().rev().map(|f| f.len() - 1).collect();
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

/// Whether the coordinates are radii of a sphere; the alternative are Cartesian ones.
///
/// In fewer than three dimensions the corners of cells look alike in all of PLUTO's geometries.
fn is_radial(path: &Path, faces: &[Vec<f64>]) -> Result<bool> {
    match (stated_geometry(path).as_deref(), faces) {
        (Some("CARTESIAN"), _) | (None, [_, _, _]) => Ok(false),
        (Some("SPHERICAL"), [_]) => Ok(true),
        (Some(other), _) => {
            let what = format!(
                "coordinates '{other}' (by {GRID_FILE}); known are CARTESIAN ones, and SPHERICAL in one dimension: \
                 resample it to either"
            );
            Err(unsupported(path, what))
        }
        (None, faces) if faces.first().and_then(|x| x.first()).is_some_and(|x| *x < 0.0) => Ok(false),
        (None, faces) => {
            let what = format!(
                "a grid of {} dimensions whose first coordinate may be x or a radius, which the file does not say; put \
                 PLUTO's {GRID_FILE} of the run beside it",
                faces.len()
            );
            Err(unsupported(path, what))
        }
    }
}

/// The coordinates that the head of `grid.out` names, if there is such a file.
fn stated_geometry(path: &Path) -> Option<String> {
    let mut head = Vec::new();
    File::open(path.with_file_name(GRID_FILE)).ok()?.take(GRID_HEAD).read_to_end(&mut head).ok()?;
    let text = String::from_utf8_lossy(&head);
    let stated = text.lines().find_map(|line| line.strip_prefix('#')?.trim().strip_prefix("GEOMETRY:"));
    stated.map(|name| name.trim().to_owned())
}

fn faces(file: &Reader, path: &Path) -> Result<Vec<Vec<f64>>> {
    let present = file.datasets("node_coords")?;
    let mut faces = Vec::new();
    let mut shape = None;
    for (axis, name) in AXES.iter().enumerate() {
        let location = format!("dataset 'node_coords/{name}'");
        let rank = shape.as_ref().map_or(axis + 1, Vec::len);
        // Flat grids may have a Z nevertheless.
        if axis >= rank || !present.iter().any(|p| p == name) {
            break;
        }
        let found = file.array(&format!("node_coords/{name}"))?;
        let Some((own, values)) = found.filter(|(s, _)| (1..=3).contains(&s.len()) && s.iter().all(|n| *n >= 2)) else {
            return Err(file.input(location, "expected corners of cells in 1 to 3 dimensions, at least 2 along each"));
        };
        if shape.get_or_insert_with(|| own.clone()) != &own {
            return Err(file.input(location, format!("has shape {own:?}, unlike the other coordinates")));
        }
        let (count, stride) = line(&own, axis);
        let face = |i: usize| values.get(i * stride);
        let line: Vec<f64> = (0..count).map(face).collect();
        let extent = face(count - 1) - face(0);
        let bent = |flat: usize| !((values.get(flat) - face(flat / stride % count)).abs() <= STRAIGHT * extent);
        if (0..values.len()).any(bent) {
            let what = format!("a curvilinear grid: {name} does not depend on one index alone; resample it first");
            return Err(unsupported(path, what));
        }
        faces.push(line);
    }
    let rank = shape.map_or(0, |s| s.len());
    if rank == 0 || faces.len() != rank {
        let problem = format!("has coordinates {present:?} for a grid of {rank} dimensions");
        return Err(file.input("group 'node_coords'", problem));
    }
    Ok(faces)
}

/// Length and stride of an axis in a shape whose last index is x1.
fn line(shape: &[usize], axis: usize) -> (usize, usize) {
    let mut sizes = shape.iter().rev();
    let stride = sizes.by_ref().take(axis).product();
    (sizes.next().copied().unwrap_or(1), stride)
}
