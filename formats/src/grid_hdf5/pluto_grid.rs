//! PLUTO's `grid.out`: the coordinates of a run, and the faces of its cells.
//!
//! Lines of its head begin with `#`, one of them is `# GEOMETRY: SPHERICAL`. Then, for each of three axes, the number of cells and
//! as many lines with number, left and right face.

use super::mesh::unsupported;
use super::schema::NAME;
use crate::error::{FormatError, Result};
use crate::model::Coordinates;
use std::path::Path;

/// What PLUTO writes into the folder of its output.
pub const GRID_FILE: &str = "grid.out";
/// More than the largest grids have.
const MOST_BYTES: u64 = 1 << 28;
/// How far the faces of neighbors may be apart, relative to the cells: they have 12 digits after the point.
const SAME: f64 = 1e-6;

/// What the file says.
pub struct PlutoGrid {
    pub coordinates: Coordinates,
    text: String,
    path: std::path::PathBuf,
}

impl PlutoGrid {
    /// The file beside `output`, if there is one that names its coordinates.
    ///
    /// # Errors
    /// Coordinates that PLUTO does not have.
    pub fn beside(output: &Path) -> Result<Option<Self>> {
        let path = output.with_file_name(GRID_FILE);
        let is_readable = std::fs::metadata(&path).is_ok_and(|m| m.is_file() && m.len() <= MOST_BYTES);
        let Some(bytes) = is_readable.then(|| std::fs::read(&path).ok()).flatten() else { return Ok(None) };
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let stated = text.lines().find_map(|line| line.strip_prefix('#')?.trim().strip_prefix("GEOMETRY:"));
        let coordinates = match stated.map(str::trim) {
            Some("CARTESIAN") => Coordinates::Cartesian,
            Some("SPHERICAL") => Coordinates::Spherical,
            Some("POLAR") => Coordinates::Polar,
            Some("CYLINDRICAL") => Coordinates::Cylindrical,
            Some(other) => {
                let what = format!(
                    "coordinates '{other}' (by {GRID_FILE}); PLUTO has CARTESIAN, CYLINDRICAL, POLAR and SPHERICAL"
                );
                return Err(unsupported(output, what));
            }
            None => return Ok(None),
        };
        Ok(Some(Self { coordinates, text, path }))
    }

    fn wrong(&self, location: impl Into<String>, problem: impl Into<String>) -> FormatError {
        FormatError::input(&self.path, NAME, location, problem)
    }

    /// Faces of the cells along the three coordinates.
    ///
    /// # Errors
    /// The line that is missing or no face.
    pub fn faces(&self) -> Result<[Vec<f64>; 3]> {
        let mut lines = self.text.lines().enumerate().filter(|(_, l)| !l.starts_with('#') && !l.trim().is_empty());
        let mut axis = |name: &str| -> Result<Vec<f64>> {
            let (at, line) =
                lines.next().ok_or_else(|| self.wrong(name, "the file ends before its number of cells"))?;
            let count: usize = line.trim().parse().ok().filter(|n| *n > 0).ok_or_else(|| {
                self.wrong(
                    format!("line {}", at + 1),
                    format!("is '{}', expected the number of cells along {name}", line.trim()),
                )
            })?;
            let mut faces: Vec<f64> = Vec::new();
            for cell in 0..count {
                let missing = || self.wrong(name, format!("the file ends after {cell} of {count} cells"));
                let (at, line) = lines.next().ok_or_else(missing)?;
                let numbers: Vec<f64> = line.split_whitespace().skip(1).filter_map(|w| w.parse().ok()).collect();
                let follows =
                    |left: f64, right: f64| faces.last().is_none_or(|f| (f - left).abs() <= SAME * (right - left));
                match numbers.as_slice() {
                    &[left, right] if left.is_finite() && right.is_finite() && left < right && follows(left, right) => {
                        if faces.is_empty() {
                            faces.push(left);
                        }
                        faces.push(right);
                    }
                    _ => {
                        let problem = format!(
                            "is '{}', expected a number, the left and the right face of cell {} along {name}, where the last cell ends",
                            line.trim(),
                            cell + 1
                        );
                        return Err(self.wrong(format!("line {}", at + 1), problem));
                    }
                }
            }
            Ok(faces)
        };
        Ok([axis("X1")?, axis("X2")?, axis("X3")?])
    }
}

/// Cartesian corners, as far as PLUTO writes them, of the corner of cells at coordinates `u` of a grid of `rank` dimensions.
pub fn corner(coordinates: Coordinates, rank: usize, u: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = u;
    match (coordinates, rank) {
        (Coordinates::Spherical, 3) => [a * b.sin() * c.cos(), a * b.sin() * c.sin(), a * b.cos()],
        // The meridian's plane.
        (Coordinates::Spherical, 2) => [a * b.sin(), a * b.cos(), 0.0],
        (Coordinates::Polar, 2 | 3) => [a * b.cos(), a * b.sin(), c],
        _ => u,
    }
}
