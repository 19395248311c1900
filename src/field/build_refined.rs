//! Builds sources from cells of several sizes.

use super::build_input::Input;
use super::check::point_text;
use super::grid::Grid;
use super::grid_axis::AxisTable;
use super::refined::Refined;
use super::sampled::Sampler;
use super::{Centering, Interpolation, Period, Source};
use crate::error::{Error, Result};
use sph::domain::Domain;
use sph_formats::{Location, RefinedGrid, Values, Variable};
use std::sync::Arc;

/// Where all blocks are of one level they are the cells of a uniform grid, and are treated as these.
pub(crate) fn refined<const D: usize>(mut input: Input<'_, D>, grid: RefinedGrid) -> Result<Source<D>> {
    let name = input.density.name.clone();
    if input.options.centering == Centering::Nodes {
        let problem = format!("is nodes, but the file says that the values of '{name}' belong to cells; leave it out");
        return Err(Error::scene("input.centering", problem));
    }
    if let Err((location, problem)) = grid.validate() {
        return Err(Error::field(name, format!("{location} {problem}")));
    }
    let mut all = std::iter::once(&input.density).chain(&input.others);
    if let Some(v) = all.find(|v| v.location != Location::Cell) {
        return Err(Error::field(&v.name, "is not given in cells, as all variables of a refined grid must be"));
    }
    input.check(&|i| place(&grid, i))?;
    let periods: [Option<Period>; D] = sph::array(|k| {
        input.options.periodic[k].or(grid.axes.get(k).filter(|axis| axis.is_periodic).map(|_| Period::Auto))
    });
    for (axis, asked) in grid.axes.iter().zip(&input.options.periodic) {
        if axis.is_periodic && asked.is_none() {
            input.notes.push(format!("the file says that it repeats along axis '{}' (domain.boundary)", axis.name));
        }
    }
    let interpolation = input.options.interpolation;
    let is_uniform = grid.blocks.iter().all(|b| b.level == grid.blocks[0].level);
    if is_uniform {
        let level = grid.blocks[0].level;
        input.density = in_order(&grid, level, input.density);
        input.others = std::mem::take(&mut input.others).into_iter().map(|v| in_order(&grid, level, v)).collect();
        let axes = axes(&grid, level, periods)?;
        let sampler = Grid::new(axes, interpolation.unwrap_or(Interpolation::PiecewiseLinear));
        let domain = sampler.domain()?;
        return finish(input, sampler, domain);
    }
    let sampler = Refined::new(&name, grid, periods, interpolation)?;
    let domain = sampler.domain()?;
    finish(input, sampler, domain)
}

fn finish<const D: usize, S>(input: Input<'_, D>, sampler: S, domain: Domain<D>) -> Result<Source<D>>
where
    S: Sampler<D> + 'static,
{
    let sampler = Arc::new(sampler);
    let own = Arc::clone(&sampler);
    input.finish(sampler, domain, &|_| Ok(Arc::clone(&own) as Arc<dyn Sampler<D>>))
}

fn place(grid: &RefinedGrid, value: usize) -> String {
    let Some((block, at)) = grid.place(value) else { return format!("cell {value}") };
    let middle = |k: usize| {
        let face = |i| grid.face(k, block.level, block.first[k] + i);
        0.5 * face(at[k]) + 0.5 * face(at[k] + 1)
    };
    let position: Vec<f64> = (0..grid.dimension()).map(middle).collect();
    let within: Vec<String> = at[..grid.dimension()].iter().map(u64::to_string).collect();
    format!(
        "cell ({}) of block {} of level {}, position {}",
        within.join(", "),
        block.number,
        block.level,
        point_text(&position)
    )
}

/// The axes of the only level.
fn axes<const D: usize>(grid: &RefinedGrid, level: u8, periods: [Option<Period>; D]) -> Result<[AxisTable; D]> {
    let table = |k: usize| {
        let faces: Vec<f64> = (0..=grid.cells_along(k, level)).map(|i| grid.face(k, level, i)).collect();
        let centers = faces.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect();
        AxisTable::cells(&grid.axes[k].name, faces, centers, periods[k])
    };
    let tables: Vec<AxisTable> = (0..grid.dimension()).map(table).collect::<Result<_>>()?;
    tables.try_into().map_err(|_| Error::field("density", format!("is on a grid of {} axes", grid.dimension())))
}

/// A variable of blocks of one level in the order of a grid of cells.
fn in_order(grid: &RefinedGrid, level: u8, mut variable: Variable) -> Variable {
    let total: [usize; 3] = sph::array(|k| if k < grid.dimension() { grid.cells_along(k, level) as usize } else { 1 });
    variable.values = match &variable.values {
        Values::F32(v) => Values::F32(reordered(grid, total, variable.components, v)),
        Values::F64(v) => Values::F64(reordered(grid, total, variable.components, v)),
        Values::I64(v) => Values::I64(reordered(grid, total, variable.components, v)),
    };
    variable
}

/// Row by row of each block.
fn reordered<T: Copy + Default>(grid: &RefinedGrid, total: [usize; 3], components: usize, values: &[T]) -> Vec<T> {
    let mut all = vec![T::default(); values.len()];
    let mut from = 0;
    for block in &grid.blocks {
        let [x, y, z] = block.first.map(|n| n as usize);
        let [nx, ny, nz] = block.cells.map(|n| n as usize);
        let row = components * nx;
        for (j, k) in (0..nz).flat_map(|k| (0..ny).map(move |j| (j, k))) {
            let to = components * (x + total[0] * (y + j + total[1] * (z + k)));
            all[to..to + row].copy_from_slice(&values[from..from + row]);
            from += row;
        }
    }
    all
}
