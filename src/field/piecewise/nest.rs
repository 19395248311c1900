//! Integration of a cell across the boundaries of parts, axis by axis.
//!
//! Along the innermost axis the ends are found to rounding, and Gauss-Legendre rules between them meet a smooth function.
//! What that leaves as a function of the outer coordinates is smooth but where ends of parts leave the cell through a
//! face or meet each other; those places are found the same way (Saye 2015, doi 10.1137/140966290, who takes the ends
//! from level sets).

use super::change::{Pattern, Seen, change};
use super::line::{Stretch, stretches};
use super::orders::{Masses, add};
use super::window::Window;
use crate::field::quadrature::rule;

/// Stretches narrower than this, as a share of the domain, hold nothing.
const NARROW: f64 = 1e-13;
/// Distance from the ends of a stretch within a cell at which the inner parts are compared, as a share of it.
const NEXT_TO_END: f64 = 1e-6;
/// How well places are found at which the inner parts change, as a share of the stretch.
const CHANGE_ACCURACY: f64 = 1e-6;
/// Stretches along one axis of a cell, at most.
const MOST_CHANGES: usize = 16;
/// Evaluations within a cell, beyond which it is better halved.
pub(super) const MOST_EVALUATIONS: usize = 40_000;

/// The order of the axes, and what is found once along the first of them.
pub(super) struct Nest<'a, 'b, const D: usize> {
    window: &'a Window<'b, D>,
    /// The outermost first.
    axes: [usize; D],
    /// Ends of the stretches along the first of them.
    outermost: Vec<f64>,
}

impl<'a, 'b, const D: usize> Nest<'a, 'b, D> {
    /// `None` if the cell has too many parts.
    pub fn new(window: &'a Window<'b, D>, axes: [usize; D]) -> Option<Self> {
        let mut nest = Self { window, axes, outermost: Vec::new() };
        if D > 1 {
            nest.outermost = nest.smooth_stretches(0, &window.lo)?;
        }
        Some(nest)
    }

    /// The integral over the cell by the rule of `order`; `None` if it has too many parts.
    pub fn integral(&self, order: usize) -> Option<Masses> {
        let mut masses = Masses::new();
        self.integrate(order, 0, &mut self.window.lo.clone(), 1.0, &mut masses)?;
        Some(masses)
    }

    /// Adds the integral over the axes from `depth` on by the rule of `order`, with the others at `u`.
    fn integrate(&self, order: usize, depth: usize, u: &mut [f64; D], weight: f64, masses: &mut Masses) -> Option<()> {
        let axis = self.axes[depth];
        if depth + 1 == D {
            for stretch in self.parts(axis, u)? {
                let width = stretch.to - stretch.from;
                let mut sum = 0.0;
                for &(t, w) in rule(order) {
                    u[axis] = stretch.from + t * width;
                    sum += w * self.window.value(u);
                }
                add(masses, stretch.piece, weight * width * sum);
            }
            return Some(());
        }
        let deeper = if depth > 0 { self.smooth_stretches(depth, u)? } else { Vec::new() };
        for ends in if depth > 0 { &deeper } else { &self.outermost }.windows(2) {
            let width = ends[1] - ends[0];
            if width > NARROW {
                for &(t, w) in rule(order) {
                    u[axis] = ends[0] + t * width;
                    self.integrate(order, depth + 1, u, weight * width * w, masses)?;
                }
            }
        }
        Some(())
    }

    /// The parts along `axis` through `u`.
    fn parts(&self, axis: usize, u: &[f64; D]) -> Option<Vec<Stretch>> {
        if self.window.evaluations() > MOST_EVALUATIONS {
            return None;
        }
        let at = |t: f64| {
            let mut x = *u;
            x[axis] = t;
            self.window.trace(&x)
        };
        let [lo, hi] = self.window.inner_faces(axis);
        let mut found = stretches(&at, [lo, hi], 0.0)?;
        found.first_mut().into_iter().for_each(|s| s.from = self.window.lo[axis]);
        found.last_mut().into_iter().for_each(|s| s.to = self.window.hi[axis]);
        Some(found)
    }

    /// Ends of the stretches along the axis of `depth` between which the integral over the deeper axes is smooth.
    fn smooth_stretches(&self, depth: usize, u: &[f64; D]) -> Option<Vec<f64>> {
        let known = self.ends_at_faces(depth, u)?;
        let mut all = vec![known[0]];
        for ends in known.windows(2) {
            if ends[1] - ends[0] > NARROW {
                self.add_changes(depth, u, [ends[0], ends[1]], &mut all)?;
            }
            all.push(ends[1]);
        }
        Some(all)
    }

    /// Ends of parts along the axis of `depth`, on the faces of the deeper axes.
    fn ends_at_faces(&self, depth: usize, u: &[f64; D]) -> Option<Vec<f64>> {
        let axis = self.axes[depth];
        let mut ends = vec![self.window.lo[axis], self.window.hi[axis]];
        let deeper = &self.axes[depth + 1..];
        for corner in 0..1_usize << deeper.len() {
            let shares = sph::array(|k| match deeper.iter().position(|a| *a == k) {
                Some(i) if corner >> i & 1 == 1 => 1.0,
                _ => -1.0,
            });
            let face = self.window.place(shares);
            let mut at = *u;
            deeper.iter().for_each(|&k| at[k] = face[k]);
            ends.extend(self.parts(axis, &at)?.iter().skip(1).map(|s| s.from));
        }
        ends.sort_unstable_by(f64::total_cmp);
        ends.dedup_by(|b, a| *b - *a < NARROW);
        Some(ends)
    }

    /// Places of a stretch at which deeper parts are compared: right at the faces of the cell, next to other ends, between.
    fn compared(&self, depth: usize, [a, b]: [f64; 2]) -> [f64; 5] {
        let [face, opposite] = self.window.inner_faces(self.axes[depth]);
        let step = NEXT_TO_END * (b - a);
        let first = if a < face { face } else { a + step };
        let last = if b > opposite { opposite } else { b - step };
        let between = |share: f64| a + share * (b - a);
        [first, between(0.25), between(0.5), between(0.75), last]
    }

    /// Adds where the pattern of the deeper parts changes between two places, as ends on the faces do not show.
    fn add_changes(&self, depth: usize, u: &[f64; D], ends: [f64; 2], found: &mut Vec<f64>) -> Option<()> {
        let accuracy = CHANGE_ACCURACY * (ends[1] - ends[0]) + NARROW;
        let at = |t: f64| Some(Seen { t, pattern: self.pattern(depth, u, t)? });
        let places = self.compared(depth, ends);
        let mut left = at(places[0])?;
        let step = if depth + 2 < D { 1 } else { 2 };
        for t in places.into_iter().skip(step).step_by(step) {
            let right = at(t)?;
            while !left.is_as(&right) {
                let [within, beyond] = change(&at, left, right.clone(), accuracy)?;
                found.push(0.5 * (within.t + beyond.t));
                if found.len() > MOST_CHANGES {
                    return None;
                }
                left = beyond;
            }
            left = right;
        }
        Some(())
    }

    /// The parts over the axes deeper than `depth`, whose own coordinate is `t`: those of the line, or of lines across the
    /// section next to its ends and between the ends of parts on its faces.
    fn pattern(&self, depth: usize, u: &[f64; D], t: f64) -> Option<Pattern> {
        let mut at = *u;
        at[self.axes[depth]] = t;
        let mut all = Pattern::default();
        if depth + 2 == D {
            self.parts(self.axes[D - 1], &at)?.iter().for_each(|s| all.push(s.part, s.to - s.from));
            return Some(all);
        }
        let ends = self.ends_at_faces(depth + 1, &at)?;
        let [first, .., last] = self.compared(depth + 1, [ends[0], ends[ends.len() - 1]]);
        all.extend(0, &self.pattern(depth + 1, &at, first)?);
        for e in ends.windows(2) {
            let line = self.pattern(depth + 1, &at, 0.5 * (e[0] + e[1]))?;
            all.push(line.number(), e[1] - e[0]);
            all.extend(1, &line);
        }
        all.extend(2, &self.pattern(depth + 1, &at, last)?);
        Some(all)
    }
}
