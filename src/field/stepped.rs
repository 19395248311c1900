//! Densities given per grid cell, for example those of images. Neighboring cells belong together unless their densities differ by a large factor;
//! such jumps divide the field into pieces.

use super::grid::Grid;
use super::grid_axis::AxisTable;
use super::sampled::{Outside, SampledDensity, Sampler};
use super::{Interpolation, MassEstimate, ScalarField};
use sph::domain::{Domain, Region};
use sph_formats::Values;
use std::collections::BTreeMap;

/// A grid's density with the number of the piece that each cell is of.
pub(crate) struct Stepped<const D: usize> {
    density: SampledDensity<Grid<D>>,
    /// As values of the grid; 0 in vacuum.
    pieces: Values,
    count: usize,
}

/// Change of ln rho between neighbors from which on they are apart: that of bodies of a target.
const APART: f64 = 2.0;
/// With more pieces than this a grid shows noise or a steep slope, not things.
const MOST_PIECES: usize = 64;

impl<const D: usize> Stepped<D> {
    /// The density with its pieces.
    ///
    /// # Errors
    /// The density as it was, where it has fewer than two pieces or too many, or is not one of cells.
    pub(crate) fn of(density: SampledDensity<Grid<D>>) -> Result<Self, SampledDensity<Grid<D>>> {
        let is_of_cells = density.sampler.axes.iter().all(AxisTable::is_cells);
        if !is_of_cells
            || !matches!(density.sampler.interpolation, Interpolation::Constant | Interpolation::PiecewiseLinear)
        {
            return Err(density);
        }
        let roots = components(&density.sampler, &density.values);
        let mut numbers = BTreeMap::new();
        for root in roots.iter().enumerate().filter(|(cell, _)| density.values.get(*cell) > 0.0).map(|(_, root)| *root)
        {
            let next = numbers.len() + 1;
            numbers.entry(root).or_insert(next);
            if numbers.len() > MOST_PIECES {
                return Err(density);
            }
        }
        if numbers.len() < 2 {
            return Err(density);
        }
        let number = |root: &usize| numbers.get(root).map_or(0, |n| *n as i64);
        let pieces = Values::I64(roots.iter().map(number).collect());
        Ok(Self { density, pieces, count: numbers.len() })
    }

    fn number(&self, x: &[f64; D]) -> usize {
        let grid = &self.density.sampler;
        grid.admit(x, Outside::Reject)
            .map_or(0, |inside| self.pieces.get(grid.number_of(&grid.cell_around(&inside))) as usize)
    }
}

impl<const D: usize> ScalarField<D> for Stepped<D> {
    fn value(&self, x: &[f64; D]) -> f64 {
        self.density.value(x)
    }

    fn piece(&self, x: &[f64; D]) -> u64 {
        self.number(x) as u64
    }

    fn is_piecewise(&self) -> bool {
        true
    }

    fn integral(&self, domain: &Domain<D>) -> Option<MassEstimate> {
        self.density.integral(domain)
    }

    fn integral_of_box(&self, lo: &[f64; D], hi: &[f64; D], has: &dyn Fn(u64) -> bool) -> Option<f64> {
        let is_own = |cell: usize| has(self.pieces.get(cell) as u64);
        self.density.sampler.integral_of_box(&self.density.values, [lo, hi], &is_own)
    }

    fn piece_integrals(&self, domain: &Domain<D>) -> Option<Vec<(u64, MassEstimate)>> {
        if !matches!(domain.region, Region::Box) {
            return None;
        }
        let of = |piece: usize| {
            let is_own = |i: usize| self.pieces.get(i) as usize == piece;
            let integral = self.density.sampler.integral_of_own(&self.density.values, domain, Some(&is_own));
            (piece as u64, integral)
        };
        Some((1..=self.count).map(of).collect())
    }
}

/// For each cell the first of those that it belongs together with.
fn components<const D: usize>(grid: &Grid<D>, values: &Values) -> Vec<usize> {
    let mut parents: Vec<usize> = (0..values.len()).collect();
    let mut step = 1;
    for axis in &grid.axes {
        for cell in 0..values.len() {
            let along = cell / step % axis.len();
            let next = match along + 1 < axis.len() {
                true => cell + step,
                false if axis.is_periodic() => cell - along * step,
                false => continue,
            };
            let [a, b] = [values.get(cell), values.get(next)];
            if a > 0.0 && b > 0.0 && (a / b).ln().abs() < APART {
                join(&mut parents, cell, next);
            }
        }
        step *= axis.len();
    }
    (0..values.len()).map(|cell| root(&mut parents, cell)).collect()
}

/// The first cell of its component, with the ways there cut short.
fn root(parents: &mut [usize], mut cell: usize) -> usize {
    while parents[cell] != cell {
        parents[cell] = parents[parents[cell]];
        cell = parents[cell];
    }
    cell
}

fn join(parents: &mut [usize], a: usize, b: usize) {
    let (a, b) = (root(parents, a), root(parents, b));
    parents[a.max(b)] = a.min(b);
}

#[cfg(test)]
mod tests {
    use super::super::grid_axis::AxisTable;
    use super::*;
    use std::sync::Arc;

    fn cells(n: usize) -> AxisTable {
        let edges: Vec<f64> = (0..=n).map(|i| i as f64).collect();
        let centers = (0..n).map(|i| i as f64 + 0.5).collect();
        AxisTable::cells("x", edges, centers, None).unwrap()
    }

    fn picture(values: &[f64], interpolation: Interpolation) -> SampledDensity<Grid<2>> {
        let grid = Grid::new([cells(4), cells(3)], interpolation);
        SampledDensity { sampler: Arc::new(grid), values: Values::F64(values.to_vec()) }
    }

    #[test]
    fn bright_and_dark_cells_are_pieces_with_their_masses() {
        // Two bright cells that touch at a corner alone, which part the dark ones with a vacuum's help; a slope holds together.
        let values = [100.0, 1.0, 1.5, 2.0, 1.0, 120.0, 1.0, 2.5, 1.0, 1.0, 0.0, 3.0];
        let field = Stepped::of(picture(&values, Interpolation::Constant)).ok().expect("it has jumps");
        let piece = |x: f64, y: f64| field.piece(&[x, y]);
        assert_eq!((piece(0.2, 0.9), piece(1.5, 1.5), piece(2.5, 2.5)), (1, 4, 0));
        for (x, y, wanted) in [(1.5, 0.5, 2), (3.5, 2.9, 2), (2.5, 1.5, 2), (0.1, 1.5, 3), (1.5, 2.5, 3)] {
            assert_eq!(piece(x, y), wanted, "{x} {y}");
        }
        let domain = field.density.sampler.domain().unwrap();
        let masses = field.piece_integrals(&domain).unwrap();
        let expected = [(1, 100.0), (2, 1.0 + 1.5 + 2.0 + 1.0 + 2.5 + 3.0), (3, 1.0 + 1.0 + 1.0), (4, 120.0)];
        for ((piece, mass), (wanted, of)) in masses.iter().zip(expected) {
            assert!(*piece == wanted && (mass.value / of - 1.0).abs() < 1e-14, "{masses:?}");
        }
        assert_eq!(masses.len(), 4);
        let in_box = |piece: u64| field.integral_of_box(&[0.0, 0.0], &[4.0, 3.0], &|p| p == piece).unwrap();
        assert!(masses.iter().all(|(piece, mass)| (in_box(*piece) / mass.value - 1.0).abs() < 1e-14));
        // Half of the first bright cell with a quarter of the dark one beside it.
        let part = |has: &dyn Fn(u64) -> bool| field.integral_of_box(&[0.0, 0.5], &[1.5, 1.0], has).unwrap();
        assert!((part(&|_| true) - 50.25).abs() < 1e-12 && (part(&|p| p == 1) - 50.0).abs() < 1e-12);
    }

    #[test]
    fn slopes_and_smooth_interpolants_have_no_pieces() {
        let slope: Vec<f64> = (0..12).map(|i| 1.5_f64.powi(i % 4)).collect();
        assert!(Stepped::of(picture(&slope, Interpolation::Constant)).is_err());
        let jump: Vec<f64> = (0..12).map(|i| if i % 4 < 2 { 1.0 } else { 100.0 }).collect();
        assert!(Stepped::of(picture(&jump, Interpolation::Linear)).is_err());
        assert!(Stepped::of(picture(&jump, Interpolation::Constant)).is_ok());
    }
}
