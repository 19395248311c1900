//! Where the cells go.

use super::cell::{Cell, Rule, integrated};
use super::integrand::Integrand;
use crate::field::cubature::worst;
use crate::field::quadrature::{Sum, binade};
use crate::field::{MassEstimate, Trace};
use sph::{parallel, reduce};
use std::collections::BTreeMap;

/// Cells between two looks at the evaluations spent.
const BATCH: usize = 32;
/// Relative error of sums and of the ends of parts by rounding.
const ROUNDING: f64 = 1e-12;

/// An integral and its pieces, by their numbers.
#[derive(Debug, Clone)]
pub(crate) struct PieceIntegrals {
    pub total: MassEstimate,
    pub pieces: BTreeMap<u64, MassEstimate>,
}

/// The integrand in units of a power of two, so that it neither overflows nor vanishes.
struct InUnit<'a, const D: usize> {
    integrand: &'a dyn Integrand<D>,
    unit: f64,
}

impl<const D: usize> Integrand<D> for InUnit<'_, D> {
    fn value(&self, u: &[f64; D]) -> f64 {
        self.integrand.value(u) / self.unit
    }

    fn trace(&self, u: &[f64; D]) -> Trace {
        self.integrand.trace(u)
    }
}

/// Integral of `integrand` over `[0, 1]^D` to a relative `tolerance`, or to the error that some `max_evaluations` leave.
pub(crate) fn integrate_pieces<const D: usize>(
    integrand: &dyn Integrand<D>,
    tolerance: f64,
    max_evaluations: usize,
) -> PieceIntegrals {
    let starts = starts::<D>();
    let center = |(lo, hi): &([f64; D], [f64; D])| std::array::from_fn(|k| 0.5 * (lo[k] + hi[k]));
    let peak = reduce::max(starts.len(), |i| integrand.value(&center(&starts[i])).abs());
    let unit = if peak > 0.0 && peak.is_finite() { binade(peak) } else { 1.0 };
    let integrand = InUnit { integrand, unit };
    let mut work = Work { evaluations: 0, most: max_evaluations / 4 * 3 };
    let mut cells = work.in_batches(&starts, |(lo, hi)| vec![integrated(&integrand, *lo, *hi, Rule::Low)]);
    let left = starts[cells.len()..].iter().map(|(lo, hi)| integrated(&integrand, *lo, *hi, Rule::Crude));
    cells.extend(left.map(|cell| vec![cell]).collect::<Vec<_>>());
    let mut cells: Vec<Cell<D>> = cells.into_iter().flatten().collect();
    work.most = max_evaluations;
    while let Some(chosen) = to_refine(&cells, tolerance).filter(|_| work.evaluations < work.most) {
        let refined = work.in_batches(&chosen, |&i| cells[i].refined(&integrand));
        for (i, parts) in chosen.into_iter().zip(refined) {
            let mut parts = parts.into_iter();
            if let Some(first) = parts.next() {
                cells[i] = first;
            }
            cells.extend(parts);
        }
    }
    summed(&cells, unit)
}

/// The cells with most of the error; `None` where it is small enough, or none can be refined.
fn to_refine<const D: usize>(cells: &[Cell<D>], tolerance: f64) -> Option<Vec<usize>> {
    let value = cells.iter().map(Cell::value).collect::<Sum>().value();
    let error = cells.iter().map(|c| c.error).collect::<Sum>().value();
    if error <= tolerance * value.abs() {
        return None;
    }
    let errors: Vec<f64> = cells.iter().map(|c| if c.can_halve() { c.error } else { 0.0 }).collect();
    Some(worst(&errors, error, cells.len())).filter(|chosen| !chosen.is_empty())
}

/// Evaluations spent, and after how many no more cells are begun.
struct Work {
    evaluations: usize,
    most: usize,
}

impl Work {
    /// `f` of the items, in parallel, batch by batch until the evaluations are spent.
    fn in_batches<T: Sync, const D: usize>(
        &mut self,
        items: &[T],
        f: impl Fn(&T) -> Vec<Cell<D>> + Sync,
    ) -> Vec<Vec<Cell<D>>> {
        let mut all = Vec::with_capacity(items.len());
        for batch in items.chunks(BATCH) {
            if self.evaluations >= self.most {
                break;
            }
            let done = parallel::tasks(batch.len(), |i| f(&batch[i]));
            self.evaluations += done.iter().flatten().map(|c| c.evaluations).sum::<usize>();
            all.extend(done);
        }
        all
    }
}

/// Cells of equal size to begin with.
fn starts<const D: usize>() -> Vec<([f64; D], [f64; D])> {
    let per_axis = [0_usize, 32, 16, 8][D];
    let corner = |i: usize, k: usize| i / per_axis.pow(k as u32) % per_axis;
    let face = |j: usize| j as f64 / per_axis as f64;
    let cell = |i| (std::array::from_fn(|k| face(corner(i, k))), std::array::from_fn(|k| face(corner(i, k) + 1)));
    (0..per_axis.pow(D as u32)).map(cell).collect()
}

fn summed<const D: usize>(cells: &[Cell<D>], unit: f64) -> PieceIntegrals {
    let mut sums: BTreeMap<u64, (Sum, Sum)> = BTreeMap::new();
    let mut errors = Sum::default();
    for cell in cells {
        errors.add(cell.error);
        for &(piece, mass) in &cell.masses {
            let sums = sums.entry(piece).or_default();
            sums.0.add(mass);
            sums.1.add(cell.error);
        }
    }
    let estimate =
        |value: f64, error: f64| MassEstimate { value: value * unit, error: (error + ROUNDING * value.abs()) * unit };
    let value: Sum = sums.values().map(|s| s.0.value()).collect();
    let pieces = sums.iter().map(|(piece, s)| (*piece, estimate(s.0.value(), s.1.value()))).collect();
    PieceIntegrals { total: estimate(value.value(), errors.value()), pieces }
}
