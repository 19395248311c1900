//! One cell of a piecewise smooth field: of one part, of few, or of many.

use super::hidden::{hidden_end, share_beyond};
use super::integrand::Integrand;
use super::lattice::{axes_across, index, part_count, shares};
use super::line::ACCURACY;
use super::nest::{MOST_EVALUATIONS, Nest};
use super::orders::{Masses, SAME, add, by_orders, orders, total};
use super::window::Window;
use crate::field::cubature::{Seen, axis_at_pole, smooth_rule};
use crate::field::patch::about_pole;
use crate::field::quadrature::rule;
use crate::field::{Enclosure, Level, Trace};

/// Parts that the lattice of a cell shows, beyond which it is better halved.
const MOST_LATTICE_PARTS: usize = 5;
/// How much more the rules of high order cost than those of low order.
const HIGHER_COST: usize = 8;
/// Relative step of the density that is reckoned with where none has been seen.
const UNSEEN: f64 = 0.1;

/// A box within the unit cube, with what it holds.
#[derive(Debug, Clone)]
pub(super) struct Cell<const D: usize> {
    pub lo: [f64; D],
    pub hi: [f64; D],
    pub masses: Masses,
    pub error: f64,
    /// How often the field was evaluated.
    pub evaluations: usize,
    /// The axis along which to halve it.
    axis: usize,
    rule: Rule,
    /// Whether it is of one part, and a better rule is worth a try.
    is_smooth: bool,
    /// Whether its lattice shows one part.
    is_one_part: bool,
    /// The least and the largest value met.
    seen: [f64; 2],
    /// What may lie between the points, once that was asked.
    pub unseen: Option<Unseen>,
    /// What it may hold if there is a pole.
    about_pole: f64,
}

/// What a cell may hold that none of its points has met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unseen {
    pub mass: f64,
    /// Whether there may be a discontinuity or a pole, so that bounds are those of what is there rather than wide.
    pub may_jump: bool,
    /// Along which a pole is parted from the most of the cell.
    axis: Option<usize>,
}

/// What is spent on a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Rule {
    /// Parts are told apart at the lattice alone.
    Crude,
    /// A rule of low degree within a part.
    Low,
    /// One of high degree.
    High,
}

impl<const D: usize> Cell<D> {
    pub fn value(&self) -> f64 {
        total(&self.masses)
    }

    pub fn can_halve(&self) -> bool {
        self.hi[self.axis] - self.lo[self.axis] > 1e-12
    }

    /// The cell by a better rule, or its halves.
    pub fn refined(&self, integrand: &dyn Integrand<D>) -> Vec<Self> {
        if self.is_smooth && self.rule == Rule::Low {
            let better = integrated(integrand, self.lo, self.hi, Rule::High);
            return vec![Self { about_pole: self.about_pole.max(better.about_pole), ..better }];
        }
        self.halves(integrand)
    }

    /// What it may hold that none of its points has met.
    ///
    /// A discontinuity may hide where a level's bounds are far apart beside its values at the lattice, and then all of the cell may be
    /// of another part; else the lattice tells how much may be. Where it shows what is discontinuous, only values are left to be met.
    pub fn look(&self, integrand: &dyn Integrand<D>) -> Unseen {
        let window = Window::new(integrand, self.lo, self.hi);
        let Some(bounds) = integrand.enclosure(&window.place([-1.0; D]), &window.place([1.0; D])) else {
            return Unseen { mass: 0.0, may_jump: false, axis: None };
        };
        let of_values = |bounds: Enclosure| bounds.unseen(self.seen, window.volume(), self.about_pole);
        // A pole at a face counts; what is discontinuous there is so outside.
        let has_pole = || integrand.enclosure(&self.lo, &self.hi).is_some_and(|e| e.has_pole());
        if bounds.has_pole() || of_values(bounds) > 0.0 && has_pole() {
            let at = |a: &[f64; D], b: &[f64; D]| integrand.enclosure(a, b).is_some_and(|e| e.has_pole());
            let axis = Some(axis_at_pole([&self.lo, &self.hi], self.axis, at));
            return Unseen { mass: self.about_pole, may_jump: true, axis };
        }
        if bounds.is_continuous {
            return Unseen { mass: of_values(bounds), may_jump: false, axis: None };
        }
        let lattice = lattice(&window);
        let all = bounds.range() * window.volume();
        if !has_met_levels(&lattice, &bounds) {
            return Unseen { mass: all, may_jump: true, axis: None };
        }
        if self.is_one_part {
            return Unseen { mass: share_between(&window, &lattice) * all, may_jump: true, axis: None };
        }
        Unseen { mass: of_values(bounds.with_met_jumps()), may_jump: false, axis: None }
    }

    /// What it may hold unseen, where that counts: in cells without discontinuities, and in those that may have some.
    pub fn doubt(&self, counts: [bool; 2]) -> f64 {
        self.unseen.filter(|u| counts[usize::from(u.may_jump)]).map_or(0.0, |u| u.mass)
    }

    pub fn halves(&self, integrand: &dyn Integrand<D>) -> Vec<Self> {
        let rule = if self.is_smooth { Rule::High } else { Rule::Low };
        let axis = self.unseen.and_then(|u| u.axis).unwrap_or(self.axis);
        let middle = 0.5 * (self.lo[axis] + self.hi[axis]);
        let (mut left, mut right) = (self.hi, self.lo);
        left[axis] = middle;
        right[axis] = middle;
        let mut halves = vec![integrated(integrand, self.lo, left, rule), integrated(integrand, right, self.hi, rule)];
        // If they differ from the whole by more than its error, theirs are no better known.
        let [left, right] = [halves[0].value(), halves[1].value()];
        for (half, other) in halves.iter_mut().zip([right, left]) {
            half.about_pole = about_pole(self.value(), half.value(), other);
        }
        let step = (left + right - self.value()).abs();
        if step > self.error {
            halves.iter_mut().for_each(|half| half.error = half.error.max(0.5 * step));
        }
        halves
    }
}

/// The box with what it holds of `integrand`.
pub(super) fn integrated<const D: usize>(
    integrand: &dyn Integrand<D>,
    lo: [f64; D],
    hi: [f64; D],
    rule: Rule,
) -> Cell<D> {
    let window = Window::new(integrand, lo, hi);
    let lattice = lattice(&window);
    let is_one_part = lattice.iter().all(|t| t.part == lattice[0].part);
    let outcome = if rule == Rule::Crude {
        crude(&window, &lattice)
    } else if is_one_part {
        smooth(&window, &lattice, rule)
    } else {
        nested(&window, &lattice).unwrap_or_else(|| crude(&window, &lattice))
    };
    let Outcome { masses, error, axis, is_smooth } = outcome;
    let (evaluations, seen) = (window.evaluations(), window.seen());
    let about_pole = total(&masses).abs();
    Cell { lo, hi, masses, error, axis, rule, is_smooth, is_one_part, evaluations, seen, unseen: None, about_pole }
}

struct Outcome {
    masses: Masses,
    error: f64,
    axis: usize,
    is_smooth: bool,
}

/// Traces at the 3^D points at faces and middles; the first coordinate runs fastest.
fn lattice<const D: usize>(window: &Window<D>) -> Vec<Trace> {
    (0..3_usize.pow(D as u32)).map(|i| window.trace(&window.place(shares(i)))).collect()
}

fn longest_axis<const D: usize>(window: &Window<D>) -> usize {
    (1..D).fold(0, |longest, k| {
        let width = |k: usize| window.hi[k] - window.lo[k];
        if width(k) > 1.000_001 * width(longest) { k } else { longest }
    })
}

/// A cell of one part as far as the lattice shows. Where the end of the part may hide between its points, the error
/// grows by what may be beyond it.
fn smooth<const D: usize>(window: &Window<D>, lattice: &[Trace], rule: Rule) -> Outcome {
    let (mut value, mut error, axis) = smooth_rule(&|u: &[f64; D]| window.value(u), window.lo, window.hi);
    if rule == Rule::High {
        let (first, second) = (window.seen(), Seen::default());
        let of_order = |order: usize| vec![(0, product_rule(window, order, &second))];
        let better = by_orders::<D>(of_order(orders::<D>()[0]), |order| Some(of_order(order)));
        // Rules that have not met what another has are sure of themselves.
        let all = window.seen();
        let has_met = |seen: [f64; 2]| all[1] - all[0] <= 2.0 * (seen[1] - seen[0]) + seen[1];
        (value, error) = match better {
            Some(b) if !has_met(first) => (total(&b.0), b.1.max(error)),
            Some(b) if has_met(second.range()) && b.1 < error => (total(&b.0), b.1),
            _ => (value, error),
        };
    }
    let middle = &lattice[lattice.len() / 2];
    let hidden = hidden_share(lattice, |at| step_to(window, at)) * window.volume();
    let is_smooth = hidden <= error;
    let axis = if is_smooth { axis } else { longest_axis(window) };
    Outcome { masses: vec![(middle.piece, value)], error: error + hidden, axis, is_smooth }
}

/// The largest share of the cell of which the lattice's levels show that it may be of another part, times the `weight` of the
/// place that is nearest to that.
fn hidden_share<const D: usize>(lattice: &[Trace], weight: impl Fn([f64; D]) -> f64) -> f64 {
    let count = lattice[lattice.len() / 2].levels().len();
    let levels = |j: usize| lattice.iter().map(|t| t.levels().get(j).copied()).collect::<Option<Vec<Level>>>();
    let shares = (0..count).filter_map(|j| hidden_end::<D>(&levels(j)?)).map(|(share, at)| share * weight(at));
    shares.fold(0.0, f64::max)
}

/// The largest share of the cell of which its levels show that it may be of another part, at the lattice and between its points.
fn share_between<const D: usize>(window: &Window<D>, lattice: &[Trace]) -> f64 {
    let middle = &lattice[lattice.len() / 2];
    let points = 3_usize.pow(D as u32);
    let places: Vec<[f64; D]> = (0..points).map(|i| shares::<D>(i).map(|s| BETWEEN * s)).collect();
    let between: Vec<Trace> = places.iter().map(|s| window.trace(&window.place(*s))).collect();
    if between.iter().any(|t| t.part != middle.part) {
        return 1.0;
    }
    let levels =
        |all: &[Trace], j: usize| all.iter().map(|t| t.levels().get(j).copied()).collect::<Option<Vec<Level>>>();
    let share = |j: usize| {
        let (Some(at), Some(others)) = (levels(lattice, j), levels(&between, j)) else { return 1.0 };
        let others: Vec<([f64; D], f64)> = places.iter().copied().zip(others.iter().map(|l| l.value)).collect();
        share_beyond(&at, &others)
    };
    (0..middle.levels().len()).map(share).fold(0.0, f64::max)
}

/// Where it is looked between the points of the lattice, as shares of the way from the middle to the faces.
const BETWEEN: f64 = 0.6;

/// How much farther apart the bounds of a level may be than its values at the lattice: those of a plane over the box around a turned
/// cube are 3 times as far apart as over the cube.
const WIDE: f64 = 4.0;

/// Whether the lattice shows the course of all levels of its middle that may leave their intervals: that they do, or values about as
/// different as they are in all of the cell.
fn has_met_levels(lattice: &[Trace], bounds: &Enclosure) -> bool {
    let middle = &lattice[lattice.len() / 2];
    let is_as = |a: &Level, b: &Level| a.lo == b.lo && a.hi == b.hi;
    // The first level at which another point differs: the same is asked there as in the middle.
    let parting = |t: &Trace| t.levels().iter().zip(middle.levels()).position(|(a, b)| !is_as(a, b));
    let partings: Vec<usize> = lattice.iter().filter_map(parting).collect();
    // What is discontinuous itself may be compared: where it jumps, both levels part, and the second is on both sides of its bound as well.
    let is_across = |a: &Level, b: &Level| !is_as(a, b) && (a.lo == b.hi || a.hi == b.lo);
    let is_crossed = |j: usize, level: &Level| {
        lattice.iter().any(|t| t.levels().get(j).is_some_and(|other| is_across(level, other)))
    };
    let has_met = |j: usize, level: &Level| {
        let Some([least, most]) = bounds.levels().get(j) else { return false };
        let values = || lattice.iter().filter(|t| t.part == middle.part).filter_map(|t| Some(t.levels().get(j)?.value));
        let met = values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
        level.lo <= *least && *most <= level.hi
            || partings.contains(&j)
            || is_crossed(j, level)
            || most - least <= WIDE * met
    };
    middle.is_complete() && middle.levels().iter().enumerate().all(|(j, level)| has_met(j, level))
}

/// The integral of a smooth function by the rule of `order` along each axis.
fn product_rule<const D: usize>(window: &Window<D>, order: usize, seen: &Seen) -> f64 {
    let points = rule(order);
    let terms = (0..order.pow(D as u32)).map(|i| {
        let at = |k: usize| points[i / order.pow(k as u32) % order];
        let u = sph::array(|k| window.lo[k] + at(k).0 * (window.hi[k] - window.lo[k]));
        seen.noted(window.value(&u)) * (0..D).map(|k| at(k).1).product::<f64>()
    });
    terms.sum::<f64>() * window.volume()
}

/// How much the density may differ beyond the end of a part, which is nearest at the shares `at`.
fn step_to<const D: usize>(window: &Window<D>, at: [f64; D]) -> f64 {
    let [here, there] = [[0.0; D], at].map(|s| window.value_beside(&window.place(s)));
    (here - there).abs().max(UNSEEN * here.abs())
}

/// A cell with too many parts: an estimate to have it halved.
fn crude<const D: usize>(window: &Window<D>, lattice: &[Trace]) -> Outcome {
    let values: Vec<f64> = (0..lattice.len()).map(|i| window.value(&window.place(shares(i)))).collect();
    // Rules that were given up have met values too.
    let [least, most] = window.seen();
    let share = window.volume() / lattice.len() as f64;
    let mut masses = Masses::new();
    lattice.iter().zip(&values).for_each(|(t, v)| add(&mut masses, t.piece, v * share));
    // What lies between the points is not known even where they agree.
    let error = (most - least).max(UNSEEN * most) * window.volume();
    Outcome { masses, error, axis: longest_axis(window), is_smooth: false }
}

/// A cell with few parts; `None` if they are too many.
fn nested<const D: usize>(window: &Window<D>, lattice: &[Trace]) -> Option<Outcome> {
    if part_count(lattice) > MOST_LATTICE_PARTS {
        return None;
    }
    let (masses, error) = across_ends(window, axes_across::<D>(lattice))?;
    let hidden = hidden_in_faces(window, lattice) * window.volume();
    let misplaced = misplaced_ends(window);
    Some(Outcome { masses, error: error + hidden + misplaced, axis: longest_axis(window), is_smooth: false })
}

/// What ends of parts in the cell misplace, which are known no better than places in the unit cube are.
fn misplaced_ends<const D: usize>(window: &Window<D>) -> f64 {
    let [least, most] = window.seen();
    let narrowest = (0..D).map(|k| window.hi[k] - window.lo[k]).fold(f64::INFINITY, f64::min);
    (most - least) * window.volume() * (D as f64 * ACCURACY / narrowest).min(1.0)
}

/// The integral across the ends of parts, and its error.
///
/// Where two rules agree, as they do of polynomials, no higher ones are tried, nor where those cost more than halving
/// the cell.
fn across_ends<const D: usize>(window: &Window<D>, axes: [usize; D]) -> Option<(Masses, f64)> {
    let nest = Nest::new(window, axes)?;
    let lowest = nest.integral(orders::<D>()[0] - 1)?;
    let first = nest.integral(orders::<D>()[0])?;
    let step = (total(&first) - total(&lowest)).abs();
    if step > SAME * total(&first) && window.evaluations() <= MOST_EVALUATIONS / HIGHER_COST {
        return by_orders::<D>(first, |order| nest.integral(order));
    }
    Some((first, step))
}

/// How much the density may differ where the end of a part may hide in a face that has one part as far as the lattice
/// shows, times the share of the cell that this concerns.
fn hidden_in_faces<const D: usize>(window: &Window<D>, lattice: &[Trace]) -> f64 {
    let mut most = 0.0_f64;
    for (k, side) in (0..D).flat_map(|k| [(k, -1.0), (k, 1.0)]) {
        let is_on = |i: &usize| shares::<D>(*i)[k] == side;
        let face: Vec<usize> = (0..lattice.len()).filter(is_on).collect();
        let first = &lattice[face[0]];
        if face.iter().any(|&i| lattice[i].part != first.part) {
            continue;
        }
        for j in 0..first.levels().len() {
            // The face as a cell without extent along k.
            let level = |i: usize| {
                let mut on_face = shares::<D>(i);
                on_face[k] = side;
                lattice[index(on_face)].levels().get(j).copied()
            };
            let levels: Option<Vec<Level>> = (0..lattice.len()).map(level).collect();
            if let Some((share, mut at)) = levels.and_then(|levels| hidden_end(&levels)) {
                at[k] = side;
                most = most.max(share * step_to(window, at));
            }
        }
    }
    most
}
