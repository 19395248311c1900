//! Adaptive refinement: decides which cells are divided.

use super::cell::{Cell, Rule, integrated};
use super::integrand::Integrand;
use crate::field::cubature::{MAX_SEARCH, Search, worst};
use crate::field::patch::{ENOUGH, UNSEEN};
use crate::field::quadrature::{Sum, binade};
use crate::field::{Enclosure, MassEstimate, Trace};
use sph::{parallel, reduce};
use std::collections::BTreeMap;

/// Cells between two looks at the evaluations spent.
const BATCH: usize = 32;
/// Part of the evaluations after which it is first looked for what no point has met.
const FIRST_LOOK: usize = 4;
/// Relative error that is worth some millions of evaluations more.
const NEARLY: f64 = 1e-8;
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

    fn enclosure(&self, lo: &[f64; D], hi: &[f64; D]) -> Option<Enclosure> {
        self.integrand.enclosure(lo, hi).map(|e| e.times([1.0 / self.unit; 2]))
    }
}

/// Integral of `integrand` over `[0, 1]^D` to a relative `tolerance`, or to the error that some `max_evaluations` leave; once a
/// quarter of them is spent, what particle masses need is enough.
pub(crate) fn integrate_pieces<const D: usize>(
    integrand: &dyn Integrand<D>,
    tolerance: f64,
    max_evaluations: usize,
) -> PieceIntegrals {
    let starts = starts::<D>();
    let center = |(lo, hi): &([f64; D], [f64; D])| sph::array(|k| 0.5 * (lo[k] + hi[k]));
    let peak = reduce::max(starts.len(), |i| integrand.value(&center(&starts[i])).abs());
    let unit = if peak > 0.0 && peak.is_finite() { binade(peak) } else { 1.0 };
    let integrand = InUnit { integrand, unit };
    let mut work = Work { evaluations: 0, most: max_evaluations / 4 * 3 };
    let mut cells = work.in_batches(&starts, |(lo, hi)| vec![integrated(&integrand, *lo, *hi, Rule::Low)]);
    let left = starts[cells.len()..].iter().map(|(lo, hi)| integrated(&integrand, *lo, *hi, Rule::Crude));
    cells.extend(left.map(|cell| vec![cell]).collect::<Vec<_>>());
    let mut cells: Vec<Cell<D>> = cells.into_iter().flatten().collect();
    work.most = max_evaluations;
    while let Some(chosen) = to_refine(&cells, tolerance).filter(|_| work.evaluations < max_evaluations / FIRST_LOOK) {
        let refined = work.in_batches(&chosen, |&i| cells[i].refined(&integrand));
        replace(&mut cells, chosen, refined);
    }
    // From here on with what no point has met.
    let before = State::of(&cells);
    let search = Search { value: before.value, error: before.error, until: work.evaluations + MAX_SEARCH };
    let known = summed(&cells, unit, [false; 2]);
    let (state, doubts) = loop {
        let state = State::of(&cells);
        look(&mut cells, &integrand);
        let may_search = search.has_found(state.value) || work.evaluations < search.until;
        let [jump, smooth] = [true, false].map(|may_jump| state.matters(hidden(&cells, may_jump)));
        let doubts = [smooth && may_search, jump];
        let aim = tolerance.max(aim_after(work.evaluations, max_evaluations));
        let is_known = state.error <= aim * state.value.abs() && doubts == [false; 2];
        let chosen = if is_known || work.evaluations >= work.most { Vec::new() } else { most_doubtful(&cells, doubts) };
        if chosen.is_empty() {
            break (state, [smooth && search.has_found(state.value), is_more(hidden(&cells, true), state.value)]);
        }
        let refined = work.in_batches(&chosen, |&i| match cells[i].doubt(doubts) > cells[i].error {
            true => cells[i].halves(&integrand),
            false => cells[i].refined(&integrand),
        });
        replace(&mut cells, chosen, refined);
    };
    let stands = search.stands(tolerance, state.value) && doubts == [false; 2];
    if stands { known } else { summed(&cells, unit, doubts) }
}

/// What is enough once so many evaluations of so many are spent: in the end what particle masses need.
fn aim_after(evaluations: usize, max_evaluations: usize) -> f64 {
    match evaluations {
        few if few < max_evaluations / FIRST_LOOK => 0.0,
        many if many < max_evaluations / 8 * 3 => NEARLY,
        _ => ENOUGH,
    }
}

/// Puts parts in the place of the first cells of those chosen, as far as there are any.
fn replace<const D: usize>(cells: &mut Vec<Cell<D>>, chosen: Vec<usize>, refined: Vec<Vec<Cell<D>>>) {
    for (i, parts) in chosen.into_iter().zip(refined) {
        let mut parts = parts.into_iter();
        if let Some(first) = parts.next() {
            cells[i] = first;
        }
        cells.extend(parts);
    }
}

/// The cells with most of the error and of what may be hidden, where that counts.
fn most_doubtful<const D: usize>(cells: &[Cell<D>], doubts: [bool; 2]) -> Vec<usize> {
    let all: Vec<f64> = cells.iter().map(|c| c.error + c.doubt(doubts)).collect();
    let total = all.iter().copied().collect::<Sum>().value();
    let open: Vec<f64> = cells.iter().zip(&all).map(|(c, doubt)| if c.can_halve() { *doubt } else { 0.0 }).collect();
    worst(&open, total, cells.len())
}

/// The integral as it is known.
#[derive(Debug, Clone, Copy)]
struct State {
    value: f64,
    error: f64,
}

impl State {
    fn of<const D: usize>(cells: &[Cell<D>]) -> Self {
        let value = cells.iter().map(Cell::value).collect::<Sum>().value();
        let error = cells.iter().map(|c| c.error).collect::<Sum>().value();
        Self { value, error }
    }

    /// Whether as much as this matters beside what is not known anyway.
    fn matters(self, unseen: f64) -> bool {
        unseen > self.error && is_more(unseen, self.value)
    }
}

/// Whether more than next to nothing may be hidden.
fn is_more(unseen: f64, value: f64) -> bool {
    unseen > UNSEEN * value.abs()
}

/// Asks the cells that were not asked yet what they may hold that their points have not met.
fn look<const D: usize>(cells: &mut [Cell<D>], integrand: &dyn Integrand<D>) {
    let new: Vec<usize> = (0..cells.len()).filter(|&i| cells[i].unseen.is_none()).collect();
    let found = parallel::tasks(new.len(), |i| cells[new[i]].look(integrand));
    new.into_iter().zip(found).for_each(|(i, unseen)| cells[i].unseen = Some(unseen));
}

/// All that may be hidden where there may be discontinuities, or where there are none.
fn hidden<const D: usize>(cells: &[Cell<D>], may_jump: bool) -> f64 {
    let of = |c: &Cell<D>| c.unseen.filter(|u| u.may_jump == may_jump).map(|u| u.mass);
    cells.iter().filter_map(of).collect::<Sum>().value()
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
    let cell = |i| (sph::array(|k| face(corner(i, k))), sph::array(|k| face(corner(i, k) + 1)));
    (0..per_axis.pow(D as u32)).map(cell).collect()
}

/// The sums, with what may be hidden where that counts.
fn summed<const D: usize>(cells: &[Cell<D>], unit: f64, doubts: [bool; 2]) -> PieceIntegrals {
    let mut sums: BTreeMap<u64, (Sum, Sum)> = BTreeMap::new();
    let mut errors = Sum::default();
    for cell in cells {
        let error = cell.error + cell.doubt(doubts);
        errors.add(error);
        for &(piece, mass) in &cell.masses {
            let sums = sums.entry(piece).or_default();
            sums.0.add(mass);
            sums.1.add(error);
        }
    }
    let estimate =
        |value: f64, error: f64| MassEstimate { value: value * unit, error: (error + ROUNDING * value.abs()) * unit };
    let value: Sum = sums.values().map(|s| s.0.value()).collect();
    let pieces = sums.iter().map(|(piece, s)| (*piece, estimate(s.0.value(), s.1.value()))).collect();
    PieceIntegrals { total: estimate(value.value(), errors.value()), pieces }
}
