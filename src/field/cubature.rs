//! Globally adaptive cubature over a box.
//!
//! Genz and Malik's rule of degree 7 with its embedded rule of degree 5 (1980, J. Comput. Appl. Math. 6, 295)
//! in two and three dimensions, Gauss-Legendre of 9 and 6 points in one. The cells that hold most of the error
//! are halved along the axis of the largest fourth difference, round by round; rounds run in parallel, sums
//! in cell order, so that the result is the same for any number of threads.
//!
//! A rule that has not met a feature is sure of itself. Where bounds of the integrand over whole cells are known, cells that may
//! hold what none of their points has met are halved until they hold next to nothing, and what they may hold still is part of the error.

use super::patch::{UNSEEN, about_pole};
use super::quadrature::{Sum, binade, rule};
use super::{Enclosure, MassEstimate};
use sph::{parallel, reduce};
use std::cell::Cell as Counter;

/// Evaluations that a search takes that finds nothing, at most.
pub(crate) const MAX_SEARCH: usize = 400_000;
/// Share of the error that is not worth a round.
const LITTLE: f64 = 0.01;
/// Share of the error that each round tackles.
const SHARE: f64 = 0.75;

#[derive(Debug, Clone, Copy)]
struct Cell<const D: usize> {
    lo: [f64; D],
    hi: [f64; D],
    value: f64,
    error: f64,
    axis: usize,
    /// The least and the largest value at the points of the rule.
    seen: [f64; 2],
    /// What may lie between them, once that was asked, and whether that is about a pole.
    unseen: Option<(f64, bool)>,
    /// What it may hold if there is a pole.
    about_pole: f64,
}

impl<const D: usize> Cell<D> {
    fn new(lo: [f64; D], hi: [f64; D]) -> Self {
        Self { lo, hi, value: 0.0, error: 0.0, axis: 0, seen: [0.0; 2], unseen: None, about_pole: 0.0 }
    }

    fn axis_at_pole(&self, enclosing: Enclosing<D>) -> usize {
        if !self.unseen.is_some_and(|u| u.1) {
            return self.axis;
        }
        axis_at_pole([&self.lo, &self.hi], self.axis, |a, b| enclosing(a, b).is_some_and(|e| e.has_pole()))
    }
}

/// The axis along which to halve a box so that as few halves as can be have a pole: `axis`, where all are alike.
pub(crate) fn axis_at_pole<const D: usize>(
    [lo, hi]: [&[f64; D]; 2],
    axis: usize,
    has_pole: impl Fn(&[f64; D], &[f64; D]) -> bool,
) -> usize {
    let with_pole = |k: usize| {
        let middle = 0.5 * (lo[k] + hi[k]);
        let (mut left, mut right) = (*hi, *lo);
        (left[k], right[k]) = (middle, middle);
        usize::from(has_pole(lo, &left)) + usize::from(has_pole(&right, hi))
    };
    (0..D).fold(axis, |best, k| if with_pole(k) < with_pole(best) { k } else { best })
}

/// Bounds of an integrand between two corners of a cell, where they are known.
pub(crate) type Enclosing<'a, const D: usize> = &'a (dyn Fn(&[f64; D], &[f64; D]) -> Option<Enclosure> + Sync);

/// Integral of `f` over `[0, 1]^D` to a relative `tolerance`, or to the error that `max_evaluations` leave.
pub(crate) fn integrate_unit_box<const D: usize>(
    f: &(dyn Fn(&[f64; D]) -> f64 + Sync),
    tolerance: f64,
    max_evaluations: usize,
) -> MassEstimate {
    integrate_enclosed(f, &|_, _| None, tolerance, max_evaluations)
}

/// [`integrate_unit_box`] of a function without discontinuities that has bounds. Where these show that something may be hidden it
/// is looked for; bounds that are wide rather than right cost a few more evaluations and leave the integral as it was.
pub(crate) fn integrate_enclosed<const D: usize>(
    f: &(dyn Fn(&[f64; D]) -> f64 + Sync),
    enclosing: Enclosing<D>,
    tolerance: f64,
    max_evaluations: usize,
) -> MassEstimate {
    let per_axis = [0_usize, 32, 8, 4][D];
    let starts: Vec<Cell<D>> = (0..per_axis.pow(D as u32)).map(|i| start_cell(i, per_axis)).collect();
    let center = |c: &Cell<D>| sph::array(|k| 0.5 * (c.lo[k] + c.hi[k]));
    let peak = reduce::max(starts.len(), |i| f(&center(&starts[i])).abs());
    // Sums of squares and products must neither overflow nor vanish.
    let unit = if peak > 0.0 && peak.is_finite() { binade(peak) } else { 1.0 };
    let scaled = |x: &[f64; D]| f(x) / unit;
    let mut cells: Vec<Cell<D>> = parallel::tasks(starts.len(), |i| evaluate(&scaled, starts[i]));
    let mut evaluations = cells.len() * points::<D>();
    for axis in 0..D {
        cells.iter_mut().for_each(|c| c.axis = axis);
        cells = halves(&scaled, &cells).into_iter().flatten().collect();
        evaluations += cells.len() * points::<D>();
    }
    let mut search: Option<Search> = None;
    let mut most = max_evaluations;
    loop {
        let value: Sum = cells.iter().map(|c| c.value).collect();
        let error: Sum = cells.iter().map(|c| c.error).collect();
        let (value, error) = (value.value(), error.value());
        let left = |limit: usize| limit.saturating_sub(evaluations).div_ceil(2 * points::<D>());
        let mut chosen = if error <= tolerance * value.abs() || evaluations >= most {
            vec![]
        } else {
            let errors: Vec<f64> = cells.iter().map(|c| if can_halve(c) { c.error } else { 0.0 }).collect();
            worst(&errors, error, left(most))
        };
        if chosen.is_empty() {
            let [between, about_poles] = look(&mut cells, enclosing, unit);
            let unseen = between + about_poles;
            let search = search.get_or_insert(Search { value, error, until: evaluations + MAX_SEARCH });
            if search.has_found(value) {
                most = 2 * max_evaluations;
            }
            if unseen > error.max(UNSEEN * value.abs()) {
                let most = if search.has_found(value) { most } else { search.until };
                // First of all what is about poles, which is part of the error in any case.
                let at_poles = about_poles > error.max(UNSEEN * value.abs());
                let is_asked = |c: &Cell<D>, at_pole: bool| can_halve(c) && (at_pole || !at_poles);
                let hidden = |c: &Cell<D>| c.unseen.filter(|u| is_asked(c, u.1)).map_or(0.0, |u| u.0);
                let unseen = if at_poles { about_poles } else { unseen };
                chosen = worst(&cells.iter().map(hidden).collect::<Vec<_>>(), unseen, left(most));
                for &i in &chosen {
                    cells[i].axis = cells[i].axis_at_pole(enclosing);
                }
            }
            if chosen.is_empty() {
                let (value, error) = search.outcome(tolerance, (value, error), [between, about_poles]);
                let rounding = 64.0 * f64::EPSILON * value.abs();
                return MassEstimate { value: value * unit, error: (error + rounding) * unit };
            }
        }
        let whole: Vec<Cell<D>> = chosen.iter().map(|&i| cells[i]).collect();
        evaluations += 2 * whole.len() * points::<D>();
        for (i, [left, right]) in chosen.into_iter().zip(halves(&scaled, &whole)) {
            cells[i] = left;
            cells.push(right);
        }
    }
}

/// An integral before it was looked for what is hidden.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Search {
    pub value: f64,
    pub error: f64,
    /// Evaluations until which it is looked where nothing is found.
    pub until: usize,
}

impl Search {
    /// Whether the integral changed by more than it should.
    pub fn has_found(&self, value: f64) -> bool {
        (value - self.value).abs() > self.error
    }

    /// Whether it was good enough as it was, and still is.
    pub fn stands(&self, tolerance: f64, value: f64) -> bool {
        !self.has_found(value) && self.error <= tolerance * self.value.abs()
    }

    /// The integral and its error, with what may be about poles, and between points where something was.
    fn outcome(&self, tolerance: f64, (value, error): (f64, f64), [between, about_poles]: [f64; 2]) -> (f64, f64) {
        let about_poles = if about_poles > UNSEEN * value.abs() { about_poles } else { 0.0 };
        match self.has_found(value) {
            true => (value, error + between + about_poles),
            false if self.stands(tolerance, value) => (self.value, self.error + about_poles),
            false => (value, error + about_poles),
        }
    }
}

/// What all cells may hold that their points have not met, where there is no pole and where there is one; cells that were not asked yet are.
fn look<const D: usize>(cells: &mut [Cell<D>], enclosing: Enclosing<D>, unit: f64) -> [f64; 2] {
    let new: Vec<usize> = (0..cells.len()).filter(|&i| cells[i].unseen.is_none()).collect();
    let found = parallel::tasks(new.len(), |i| {
        let c = &cells[new[i]];
        let volume = (0..D).map(|k| c.hi[k] - c.lo[k]).product();
        let bounds = enclosing(&c.lo, &c.hi).map(|e| e.times([1.0 / unit; 2]));
        bounds.map_or((0.0, false), |e| (e.unseen(c.seen, volume, c.about_pole), e.has_pole()))
    });
    new.into_iter().zip(found).for_each(|(i, unseen)| cells[i].unseen = Some(unseen));
    [false, true]
        .map(|pole| cells.iter().filter_map(|c| c.unseen).filter(|u| u.1 == pole).map(|u| u.0).collect::<Sum>().value())
}

fn start_cell<const D: usize>(mut i: usize, per_axis: usize) -> Cell<D> {
    let (mut lo, mut hi) = ([0.0; D], [0.0; D]);
    for k in 0..D {
        let j = i % per_axis;
        i /= per_axis;
        (lo[k], hi[k]) = (j as f64 / per_axis as f64, (j + 1) as f64 / per_axis as f64);
    }
    Cell::new(lo, hi)
}

/// Numbers of the cells with most of the error, ascending, from the errors of those that can be halved and 0 for others.
pub(crate) fn worst(errors: &[f64], error: f64, limit: usize) -> Vec<usize> {
    // Where nearly all of it is in cells that are as small as can be, the rest does not matter.
    if errors.iter().copied().collect::<Sum>().value() < LITTLE * error {
        return Vec::new();
    }
    let mut order: Vec<usize> = (0..errors.len()).filter(|&i| errors[i] > 0.0).collect();
    order.sort_unstable_by(|&i, &j| errors[j].total_cmp(&errors[i]).then(i.cmp(&j)));
    let mut covered = 0.0;
    let count = order
        .iter()
        .take_while(|&&i| {
            let more = covered < SHARE * error;
            covered += errors[i];
            more
        })
        .count();
    order.truncate(count.min(limit));
    order.sort_unstable();
    order
}

/// Both halves of every cell.
fn halves<const D: usize>(f: &(dyn Fn(&[f64; D]) -> f64 + Sync), cells: &[Cell<D>]) -> Vec<[Cell<D>; 2]> {
    parallel::tasks(cells.len(), |i| split(f, &cells[i]))
}

fn can_halve<const D: usize>(c: &Cell<D>) -> bool {
    c.hi[c.axis] - c.lo[c.axis] > 1e-14
}

/// Both halves. A step from the whole to its halves that exceeds their own errors is the better error.
fn split<const D: usize>(f: &(dyn Fn(&[f64; D]) -> f64 + Sync), c: &Cell<D>) -> [Cell<D>; 2] {
    let mid = 0.5 * (c.lo[c.axis] + c.hi[c.axis]);
    let (mut left, mut right) = (*c, *c);
    left.hi[c.axis] = mid;
    right.lo[c.axis] = mid;
    let mut halves = [left, right].map(|half| evaluate(f, half));
    let step = (halves[0].value + halves[1].value - c.value).abs();
    let [left, right] = halves.map(|half| half.value);
    for (half, other) in halves.iter_mut().zip([right, left]) {
        half.error = half.error.max(0.5 * step);
        half.about_pole = about_pole(c.value, half.value, other);
    }
    halves
}

const fn points<const D: usize>() -> usize {
    match D {
        1 => 17,
        2 => 21,
        _ => 39,
    }
}

fn evaluate<const D: usize>(f: &(dyn Fn(&[f64; D]) -> f64 + Sync), cell: Cell<D>) -> Cell<D> {
    let seen = Seen::default();
    let (value, error, axis) = smooth_rule(&|x| seen.noted(f(x)), cell.lo, cell.hi);
    Cell { value, error, axis, seen: seen.range(), unseen: None, about_pole: value.abs(), ..cell }
}

/// The values that a rule has met.
#[derive(Debug)]
pub(crate) struct Seen(Counter<[f64; 2]>);

impl Default for Seen {
    fn default() -> Self {
        Self(Counter::new([f64::INFINITY, f64::NEG_INFINITY]))
    }
}

impl Seen {
    pub(crate) fn noted(&self, value: f64) -> f64 {
        let [least, most] = self.0.get();
        self.0.set([least.min(value), most.max(value)]);
        value
    }

    /// The least and the largest.
    pub(crate) fn range(&self) -> [f64; 2] {
        self.0.get()
    }
}

/// Integral over the box `lo` to `hi`, its error and the axis along which to halve it.
pub(crate) fn smooth_rule<const D: usize>(
    f: &dyn Fn(&[f64; D]) -> f64,
    lo: [f64; D],
    hi: [f64; D],
) -> (f64, f64, usize) {
    let cell = Cell::new(lo, hi);
    if D == 1 { gauss_pair(f, &cell) } else { genz_malik(f, &cell) }
}

fn gauss_pair<const D: usize>(f: &dyn Fn(&[f64; D]) -> f64, cell: &Cell<D>) -> (f64, f64, usize) {
    let width = cell.hi[0] - cell.lo[0];
    let [coarse, fine] =
        [6, 9].map(|order| width * rule(order).iter().map(|&(t, w)| w * f(&[cell.lo[0] + t * width; D])).sum::<f64>());
    let rule = rule(6);
    let nodes: [f64; 6] = sph::array(|i| 2.0 * rule[i].0 - 1.0);
    let at = |u: f64| f(&[cell.lo[0] + 0.5 * (u + 1.0) * width; D]);
    let hidden = END_SHARE * width * end_residual(&nodes, &nodes.map(at), &at);
    (fine, (fine - coarse).abs().max(hidden), 0)
}

/// Bound on the share of a cell that lies beyond the outermost points of its rules.
const END_SHARE: f64 = 0.05;

/// The ends of a cell, less a share that rounding cannot bridge: a discontinuity right at the face of a cell does no
/// harm.
const END: f64 = 1.0 - 1e-7;

/// How far the values at the ends of a line through the cell are from the polynomial through the nodes. This
/// shows a discontinuity between the outermost points and the face, where both rules agree on a wrong value.
fn end_residual<const N: usize>(nodes: &[f64; N], values: &[f64; N], at: &dyn Fn(f64) -> f64) -> f64 {
    let extrapolated = |x: f64| -> f64 {
        (0..N)
            .map(|i| {
                let basis: f64 = (0..N).filter(|&j| j != i).map(|j| (x - nodes[j]) / (nodes[i] - nodes[j])).product();
                basis * values[i]
            })
            .sum()
    };
    [-END, END].iter().map(|&x| (at(x) - extrapolated(x)).abs()).fold(0.0, f64::max)
}

/// Value, error and the axis along which to halve.
fn genz_malik<const D: usize>(f: &dyn Fn(&[f64; D]) -> f64, cell: &Cell<D>) -> (f64, f64, usize) {
    let n = D as f64;
    let lambda2 = (9.0_f64 / 70.0).sqrt();
    let lambda4 = (9.0_f64 / 10.0).sqrt();
    let lambda5 = (9.0_f64 / 19.0).sqrt();
    let center: [f64; D] = sph::array(|k| 0.5 * (cell.lo[k] + cell.hi[k]));
    let half: [f64; D] = sph::array(|k| 0.5 * (cell.hi[k] - cell.lo[k]));
    let at = |shift: [f64; D]| f(&sph::array(|k| center[k] + shift[k] * half[k]));
    let f1 = at([0.0; D]);
    let (mut f2, mut f3, mut f4, mut f5) = (0.0, 0.0, 0.0, 0.0);
    let mut axis = (0, -1.0);
    let mut hidden = 0.0_f64;
    for k in 0..D {
        let on_axis = |u: f64| {
            let mut shift = [0.0; D];
            shift[k] = u;
            at(shift)
        };
        let nodes = [-lambda4, -lambda2, 0.0, lambda2, lambda4];
        let values = [on_axis(-lambda4), on_axis(-lambda2), f1, on_axis(lambda2), on_axis(lambda4)];
        let (near, far) = (values[1] + values[3], values[0] + values[4]);
        f2 += near;
        f3 += far;
        let residual = END_SHARE * end_residual(&nodes, &values, &on_axis);
        hidden = hidden.max(residual);
        let difference = (near - 2.0 * f1 - (far - 2.0 * f1) / 7.0).abs() + residual + 1e-12 * half[k];
        if difference > axis.1 {
            axis = (k, difference);
        }
    }
    for i in 0..D {
        for j in i + 1..D {
            for signs in 0..4 {
                let mut shift = [0.0; D];
                shift[i] = if signs & 1 == 0 { lambda4 } else { -lambda4 };
                shift[j] = if signs & 2 == 0 { lambda4 } else { -lambda4 };
                f4 += at(shift);
            }
        }
    }
    for signs in 0..1_usize << D {
        f5 += at(sph::array(|k| if signs >> k & 1 == 0 { lambda5 } else { -lambda5 }));
    }
    let volume: f64 = (0..D).map(|k| 2.0 * half[k]).product();
    let seventh = (12824.0 - 9120.0 * n + 400.0 * n * n) / 19683.0 * f1
        + 980.0 / 6561.0 * f2
        + (1820.0 - 400.0 * n) / 19683.0 * f3
        + 200.0 / 19683.0 * f4
        + 6859.0 / 19683.0 / f64::from(1 << D) * f5;
    let fifth = (729.0 - 950.0 * n + 50.0 * n * n) / 729.0 * f1
        + 245.0 / 486.0 * f2
        + (265.0 - 100.0 * n) / 1458.0 * f3
        + 25.0 / 729.0 * f4;
    (volume * seventh, volume * (seventh - fifth).abs().max(hidden), axis.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exact_to_degree_seven<const D: usize>() {
        for degree in 0..=7 {
            let f = |x: &[f64; D]| (0..D).map(|k| (x[k] * (1.0 + k as f64)).powi(degree)).sum::<f64>();
            let expected: f64 = (0..D).map(|k| (1.0 + k as f64).powi(degree) / (f64::from(degree) + 1.0)).sum();
            let cell = evaluate(&f, Cell::new([0.0; D], [1.0; D]));
            assert!((cell.value / expected - 1.0).abs() < 1e-12, "{D} {degree}: {}", cell.value);
        }
        let mixed = |x: &[f64; D]| x.iter().map(|v| v * v).product::<f64>();
        let cell = evaluate(&mixed, Cell::new([0.0; D], [1.0; D]));
        assert!((cell.value * 3f64.powi(D as i32) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn rules_have_their_degree() {
        exact_to_degree_seven::<1>();
        exact_to_degree_seven::<2>();
        exact_to_degree_seven::<3>();
    }

    #[test]
    fn smooth_integrands_reach_the_tolerance() {
        let f = |x: &[f64; 2]| (-30.0 * ((x[0] - 0.3).powi(2) + (x[1] - 0.6).powi(2))).exp();
        let e = integrate_unit_box(&f, 1e-10, 10_000_000);
        // erf by the same Gaussian in one dimension each, to 12 digits.
        let g = |c: f64| integrate_unit_box::<1>(&|x| (-30.0 * (x[0] - c).powi(2)).exp(), 1e-14, 1_000_000).value;
        assert!((e.value - g(0.3) * g(0.6)).abs() < 1e-10 * e.value && e.error <= 1e-10 * e.value);
    }

    #[test]
    fn discontinuities_have_an_honest_error() {
        let disc = |x: &[f64; 2]| f64::from((x[0] - 0.4).powi(2) + (x[1] - 0.5).powi(2) < 0.09);
        let e = integrate_unit_box(&disc, 1e-4, 2_000_000);
        let expected = std::f64::consts::PI * 0.09;
        assert!((e.value - expected).abs() <= e.error && e.error < 2e-3 * expected, "{e:?}");
        let aligned = |x: &[f64; 3]| if x[1] < 0.123_456 { 2.0 } else { 1.0 };
        let e = integrate_unit_box(&aligned, 1e-8, 4_000_000);
        assert!((e.value - 1.123_456).abs() <= e.error && e.error < 1e-5, "{e:?}");
    }

    #[test]
    fn thread_counts_do_not_matter() {
        let f = |x: &[f64; 3]| (5.0 * x[0] * x[1]).sin().abs() + x[2];
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| integrate_unit_box(&f, 1e-6, 300_000))
        };
        assert_eq!(run(1), run(3));
    }
}
