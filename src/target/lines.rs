//! Masses of boxes that surfaces cross, by lines: the ends of parts along a line are found, wherever it is looked, so that a thin layer is never
//! between the places, and its angle to the axes is of no account.

use super::matter::Matter;
use crate::field::quadrature::rule;

/// Places along a line whose parts are too many to be told.
const PLACES: usize = 16;

/// The mass of a box by so many lines along `axis` for each of the other axes, and its sum of mass times place.
pub(super) fn moments<const D: usize>(
    target: &dyn Matter<D>,
    [lo, hi]: [&[f64; D]; 2],
    axis: usize,
    lines: usize,
) -> (f64, [f64; D]) {
    let (mut mass, mut moment) = (0.0, [0.0; D]);
    each_point(target, [lo, hi], axis, lines, |x, own| {
        mass += own;
        (0..D).for_each(|k| moment[k] += own * x[k]);
    });
    (mass, moment)
}

/// The same mass as points on the lines.
pub(super) fn points<const D: usize>(
    target: &dyn Matter<D>,
    of: [&[f64; D]; 2],
    axis: usize,
    lines: usize,
) -> Vec<([f64; D], f64)> {
    let mut points = Vec::new();
    each_point(target, of, axis, lines, |x, mass| points.push((x, mass)));
    points
}

/// Calls `with` for the points of all lines, and the mass at each: two for each part of a line.
fn each_point<const D: usize>(
    target: &dyn Matter<D>,
    [lo, hi]: [&[f64; D]; 2],
    axis: usize,
    lines: usize,
    mut with: impl FnMut([f64; D], f64),
) {
    let area: f64 = (0..D).filter(|k| *k != axis).map(|k| (hi[k] - lo[k]) / lines as f64).product();
    for x in each([lo, hi], axis, lines) {
        let mut at = |t: f64, width: f64| {
            let mut x = x;
            x[axis] = t;
            with(x, area * width * target.density_inside(&x).unwrap_or(0.0));
        };
        let between = [lo[axis], hi[axis]];
        let Some(parts) = target.parts_along(&x, axis, between) else {
            let step = (between[1] - between[0]) / PLACES as f64;
            (0..PLACES).for_each(|i| at(between[0] + (i as f64 + 0.5) * step, step));
            continue;
        };
        let mut from = between[0];
        for to in parts.iter().skip(1).map(|part| part.from).chain([between[1]]) {
            rule(2).iter().for_each(|(u, weight)| at(from + u * (to - from), weight * (to - from)));
            from = to;
        }
    }
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
            let points = points(&target, [&lo, &hi], axis, 4);
            let sum: f64 = points.iter().map(|point| point.1).sum();
            assert!((sum / mass - 1.0).abs() < 1e-12);
            assert!(points.iter().all(|(x, m)| *m == 0.0 || target.admits(x)));
        }
        assert_eq!(most_crossed(&target, [&[0.0; 2], &[0.4; 2]]), None);
    }
}
