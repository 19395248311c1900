//! Masses of boxes that are crossed by surfaces, from lines through the boxes. The boundaries of parts are located exactly along each line, so
//! that a thin layer cannot be missed between sampling points, whatever its angle to the axes.

use super::matter::Matter;
use crate::field::quadrature::rule;

/// Places along a line whose parts are too many to be told.
const PLACES: usize = 16;
/// Divisions of a part, at most.
const MOST_DIVISIONS: f64 = 8.0;

/// The mass of a box by so many lines along `axis` for each of the other axes, and its sum of mass times place.
pub(super) fn moments<const D: usize>(
    target: &dyn Matter<D>,
    [lo, hi]: [&[f64; D]; 2],
    axis: usize,
    lines: usize,
) -> (f64, [f64; D]) {
    let (mut mass, mut moment) = (0.0, [0.0; D]);
    each_part(target, [lo, hi], axis, lines, |part| {
        part.each_point(target, &mut |x, own| {
            mass += own;
            (0..D).for_each(|k| moment[k] += own * x[k]);
        });
    });
    (mass, moment)
}

/// The same mass as points on the lines, no farther apart along these than cubes of the mass `limit` are wide.
pub(super) fn points<const D: usize>(
    target: &dyn Matter<D>,
    of: [&[f64; D]; 2],
    axis: usize,
    (lines, limit): (usize, f64),
) -> Vec<([f64; D], f64)> {
    let mut points = Vec::new();
    each_part(target, of, axis, lines, |part| {
        let (mass, width) = (part.mass(target), part.to - part.from);
        let apart = (limit * part.area * width / mass).powf(1.0 / D as f64);
        let parts = (width / (part.points as f64 * apart)).ceil().clamp(1.0, MOST_DIVISIONS) as usize;
        part.divided(parts).for_each(|part| part.each_point(target, &mut |x, mass| points.push((x, mass))));
    });
    points
}

/// A part of a line between surfaces, with the area that the line stands for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part<const D: usize> {
    /// A place on the line.
    pub x: [f64; D],
    axis: usize,
    pub from: f64,
    pub to: f64,
    area: f64,
    /// Points at which it is looked at.
    points: usize,
}

impl<const D: usize> Part<D> {
    fn each_point(&self, target: &dyn Matter<D>, with: &mut impl FnMut([f64; D], f64)) {
        let width = self.to - self.from;
        for (u, weight) in rule(self.points) {
            let mut x = self.x;
            x[self.axis] = self.from + u * width;
            with(x, self.area * weight * width * target.density_inside(&x).unwrap_or(0.0));
        }
    }

    pub fn mass(&self, target: &dyn Matter<D>) -> f64 {
        let mut mass = 0.0;
        self.each_point(target, &mut |_, own| mass += own);
        mass
    }

    /// Equal parts of it.
    pub fn divided(self, parts: usize) -> impl Iterator<Item = Self> {
        let place = move |i: usize| self.from + (self.to - self.from) * i as f64 / parts as f64;
        (0..parts).map(move |i| Self { from: place(i), to: if i + 1 < parts { place(i + 1) } else { self.to }, ..self })
    }
}

/// Calls `with` for the parts of all lines, by so many lines along `axis` for each of the other axes.
pub(super) fn each_part<const D: usize>(
    target: &dyn Matter<D>,
    [lo, hi]: [&[f64; D]; 2],
    axis: usize,
    lines: usize,
    mut with: impl FnMut(Part<D>),
) {
    let area: f64 = (0..D).filter(|k| *k != axis).map(|k| (hi[k] - lo[k]) / lines as f64).product();
    for x in each([lo, hi], axis, lines) {
        let whole = Part { x, axis, from: lo[axis], to: hi[axis], area, points: 2 };
        let Some(parts) = target.parts_along(&x, axis, [whole.from, whole.to]) else {
            Part { points: 1, ..whole }.divided(PLACES).for_each(&mut with);
            continue;
        };
        let mut from = whole.from;
        for to in parts.iter().skip(1).map(|part| part.from).chain([whole.to]) {
            with(Part { from, to, ..whole });
            from = to;
        }
    }
}

/// Lines for each axis across them of which there are so many in all, or a few more.
pub(super) fn for_each_axis<const D: usize>(in_all: f64) -> usize {
    in_all.powf(1.0 / (D - 1).max(1) as f64).ceil().max(2.0) as usize
}

/// The axis along which lines meet the most surfaces of a box, with two lines for each of the other axes; none if they meet none.
pub(super) fn most_crossed<const D: usize>(target: &dyn Matter<D>, [lo, hi]: [&[f64; D]; 2]) -> Option<usize> {
    let crossed = |axis: usize| -> usize {
        let parts = |x: [f64; D]| target.parts_along(&x, axis, [lo[axis], hi[axis]]);
        each([lo, hi], axis, 2).map(|x| parts(x).map_or(0, |parts| parts.len() - 1)).sum()
    };
    let all: [usize; D] = sph::array(crossed);
    // Of those that meet as many the longest: it is seen best along it.
    let order = |k: usize| (all[k], hi[k] - lo[k]);
    let best = (1..D).fold(0, |best, k| if order(k) > order(best) { k } else { best });
    (all[best] > 0).then_some(best)
}

/// A place of each line: the middles of equal parts of the box across `axis`.
pub(super) fn each<const D: usize>(
    [lo, hi]: [&[f64; D]; 2],
    axis: usize,
    lines: usize,
) -> impl Iterator<Item = [f64; D]> {
    let (lo, hi) = (*lo, *hi);
    (0..lines.pow(D as u32 - 1)).map(move |line| {
        let mut rest = line;
        sph::array(|k| {
            if k == axis {
                return lo[k];
            }
            let place = rest % lines;
            rest /= lines;
            lo[k] + (place as f64 + 0.5) / lines as f64 * (hi[k] - lo[k])
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::AnalyticField;
    use crate::target::Target;
    use sph::domain::{Axis, Domain, Region};

    /// Of a layer from corner to corner, by its area.
    #[test]
    fn a_layer_across_a_box_has_its_mass_and_center() {
        let domain = Domain::new([0.0; 2], [1.0; 2], [Axis::OPEN; 2], Region::Box).unwrap();
        let half = 1e-5;
        let text = format!("if(abs(x + y - 1) < {half}, 1, 0)");
        let field = AnalyticField::<2>::new("density", &text, [0.5; 2]).unwrap();
        let area = 2.0 * half - half * half;
        let target = Target::of_equal_masses(&domain, &field, 1000, area);
        let (lo, hi) = ([0.0; 2], [1.0; 2]);
        assert!(most_crossed(&target, [&lo, &hi]).is_some());
        for axis in [0, 1] {
            let (mass, moment) = moments(&target, [&lo, &hi], axis, 4);
            assert!((mass / 1000.0 - 1.0).abs() < 1e-4, "{mass}");
            assert!(moment.iter().all(|m| (m / mass - 0.5).abs() < 1e-4), "{moment:?}");
            let points = points(&target, [&lo, &hi], axis, (4, f64::INFINITY));
            let sum: f64 = points.iter().map(|point| point.1).sum();
            assert!((sum / mass - 1.0).abs() < 1e-12);
            assert!(points.iter().all(|(x, m)| *m == 0.0 || target.admits(x)));
        }
        assert_eq!(most_crossed(&target, [&[0.0; 2], &[0.4; 2]]), None);
    }
}
