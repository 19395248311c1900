//! Cells that a file marks as belonging to another piece, or as hidden; they are ignored.
//!
//! `vtkGhostType` of cells has bits (`vtkDataSetAttributes::CellGhostTypes`): 1 for a cell that another piece has, 32 for a hidden one. Before VTK 6.3
//! `vtkGhostLevels` told how far a cell lies within another piece.

use super::dataset::{DataArray, Dataset, Shape};
use super::schema::NAME;
use crate::error::{FormatError, Result};
use crate::model::{Cells, Values};
use std::path::Path;

const TYPES: &str = "vtkGhostType";
const LEVELS: &str = "vtkGhostLevels";
const DUPLICATE: i64 = 1;
const HIDDEN: i64 = 32;

/// The dataset without such cells, and without the arrays that mark them.
///
/// # Errors
/// [`FormatError::Unsupported`] where cells of a grid are marked: its other cells make no grid.
pub(super) fn left_out(path: &Path, mut dataset: Dataset, notes: &mut Vec<String>) -> Result<Dataset> {
    let is_mark = |array: &DataArray| [TYPES, LEVELS].contains(&array.name.as_str());
    dataset.point_data.retain(|array| !is_mark(array));
    let Some(place) = dataset.cell_data.iter().position(is_mark) else { return Ok(dataset) };
    let marks = dataset.cell_data.remove(place);
    let is_out = |i: usize| match marks.values.get(i) as i64 {
        level if marks.name == LEVELS => level > 0,
        bits => bits & (DUPLICATE | HIDDEN) != 0,
    };
    let count = marks.values.len();
    let left: Vec<bool> = (0..count).map(|i| !is_out(i)).collect();
    let out = left.iter().filter(|is_left| !**is_left).count();
    if out == 0 {
        return Ok(dataset);
    }
    let Shape::Cells { points, cells } = dataset.shape else {
        let what = format!(
            "'{}', which marks {out} cells of a grid as no part of it; extract the others as a mesh (.vtu)",
            marks.name
        );
        return Err(FormatError::Unsupported { path: path.into(), format: NAME, what });
    };
    if cells.types.len() != count {
        let problem = format!("has {count} values, expected one for each of {} cells", cells.types.len());
        return Err(FormatError::input(path, NAME, format!("array '{}'", marks.name), problem));
    }
    notes.push(format!(
        "{out} of {count} cells are left out, which '{}' marks as those of other pieces or hidden",
        marks.name
    ));
    dataset.cell_data.iter_mut().for_each(|array| keep(array, &left));
    dataset.shape = Shape::Cells { points, cells: kept_cells(&cells, &left) };
    Ok(dataset)
}

fn kept_cells(cells: &Cells, left: &[bool]) -> Cells {
    let mut kept = Cells { types: Vec::new(), offsets: vec![0], connectivity: Vec::new() };
    for i in (0..left.len()).filter(|&i| left[i]) {
        let Some(points) = cells.offsets.get(i..i + 2).and_then(|w| cells.connectivity.get(w[0]..w[1])) else {
            continue;
        };
        kept.types.push(cells.types[i]);
        kept.connectivity.extend_from_slice(points);
        kept.offsets.push(kept.connectivity.len());
    }
    kept
}

/// Values of the cells that are left; an array of another length is refused later.
fn keep(array: &mut DataArray, left: &[bool]) {
    fn rows<T: Copy>(values: &[T], components: usize, left: &[bool]) -> Vec<T> {
        values.chunks(components).zip(left).filter(|(_, is_left)| **is_left).flat_map(|(row, _)| row).copied().collect()
    }
    if array.components == 0 || array.values.len() != left.len() * array.components {
        return;
    }
    array.values = match &array.values {
        Values::F32(v) => Values::F32(rows(v, array.components, left)),
        Values::F64(v) => Values::F64(rows(v, array.components, left)),
        Values::I64(v) => Values::I64(rows(v, array.components, left)),
    };
}
