//! Determines whether the nodes of a periodic axis are cell centers, so that N of them span N dx, or include both ends of the period, the last
//! repeating the first, so that they span (N - 1) dx.
//!
//! Values alone do not say it: those of two slices may agree by chance. What decides, in this order, is a statement of the
//! file (bounds of cells, cell data), one of the scene (`input.centering`, or a box that has one of the two lengths), and
//! where the nodes lie in a range that starts at zero or is symmetric about it.

use super::grid_axis::AxisTable;
use super::{Centering, Period};
use crate::error::{Error, Result};

/// Steps may differ by this fraction of themselves, and nodes lie so far from where they should be, in steps: coordinates may
/// be stored in f32.
pub(crate) const SLACK: f64 = 1e-3;
/// Lengths that a scene states agree with those of the grid to this.
const STATED: f64 = 1e-6;

/// What is known of a periodic axis beside its nodes.
pub(crate) struct Known<'a> {
    pub(crate) centering: Centering,
    /// The edges of the scene's box, where it is periodic along this axis.
    pub(crate) stated: Option<[f64; 2]>,
    /// Whether the first and the last slice are equal in every variable.
    pub(crate) ends_agree: &'a dyn Fn() -> bool,
}

/// The table of an axis whose values are points without bounds, and how it was decided.
///
/// # Errors
/// [`Error::Scene`] where nothing decides, or what is stated cannot be.
pub(crate) fn periodic_axis(
    name: &str,
    (axis, nodes): (&str, &[f64]),
    known: &Known<'_>,
) -> Result<(AxisTable, Option<String>)> {
    let n = nodes.len();
    let (first, last) = (nodes[0], nodes[n - 1]);
    let (span, step) = (last - first, even_step(nodes));
    let table = |period, repeats| AxisTable::nodes(axis, nodes.to_vec(), period, repeats);
    let ask = |problem: String| Err(Error::scene("input.centering", format!("axis '{axis}' of '{name}' {problem}")));
    let (cells, repeated) = match known.centering {
        Centering::Cells => return cell_axis((axis, nodes), Some(Period::Auto)).map(|table| (table, None)),
        Centering::Nodes if !(known.ends_agree)() => {
            let remedy = match step {
                Some(_) => "write `centering: cells` if its period is one step longer than its nodes are apart",
                None => BY_BOUNDS,
            };
            return ask(format!(
                "has different values in its first and last slice, which cannot be one node of a periodic box; {remedy}"
            ));
        }
        Centering::Nodes => (false, true),
        Centering::Points | Centering::Unknown => match known.stated.map(|edges| by_box(edges, first, last, step, n)) {
            Some(Some(found)) => found,
            Some(None)
                if known
                    .stated
                    .is_some_and(|[lo, hi]| lo >= first && hi <= last && hi - lo < span * (1.0 - STATED)) =>
            {
                // A part of the grid: what repeats is the box of the scene, within which values are known.
                return Ok((table(None, false)?, None));
            }
            _ => by_place(nodes, step, known),
        },
    };
    match (cells, repeated, step) {
        (true, false, Some(step)) => {
            let period = step * n as f64;
            let lo = first - 0.5 * step;
            let table = table(Some(Period::Length(period)), false)?;
            let note = format!(
                "axis '{axis}': its {n} nodes are taken for the middles of cells, its period is {period} (input.centering)"
            );
            Ok((table.starting_at(lo), Some(note)))
        }
        (false, true, _) => {
            let table = table(Some(Period::Auto), true)?;
            let note = format!(
                "axis '{axis}': the last of its {n} nodes is taken for the first again, its period is {span} (input.centering)"
            );
            Ok((table, Some(note)))
        }
        (both, ..) => {
            let lengths = step.map_or_else(
                || format!("{span}, or that and one more of its uneven steps, which only bounds of cells can tell"),
                |step| format!("{} (cells) or {span} (the last node is the first again)", step * n as f64),
            );
            let remedy = match step {
                Some(_) => "write `centering: cells` or `centering: nodes`".to_owned(),
                None => format!("write `centering: nodes` if the last node is the first again; else {BY_BOUNDS}"),
            };
            let why = if both { "both fit where the nodes lie" } else { "neither fits where the nodes lie" };
            ask(format!(
                "is periodic, but whether its period is {lengths} is not known: {n} nodes run from {first} to {last}, and {why}; \
                 {remedy}"
            ))
        }
    }
}

/// What there is to do about an axis with uneven steps, whose cells nobody knows.
const BY_BOUNDS: &str = "give the file bounds of its cells, or the axis another boundary than periodic";

/// The table of an axis whose nodes are the middles of even cells, periodic or not.
///
/// # Errors
/// [`Error::Scene`] where steps are uneven, so that the faces of cells are not known.
pub(crate) fn cell_axis((axis, nodes): (&str, &[f64]), period: Option<Period>) -> Result<AxisTable> {
    let Some(step) = even_step(nodes) else {
        let problem = format!(
            "is cells, but axis '{axis}' has uneven steps, so that faces of cells are not known; give the file bounds of cells"
        );
        return Err(Error::scene("input.centering", problem));
    };
    let faces = (0..=nodes.len()).map(|i| nodes[0] + step * (i as f64 - 0.5)).collect();
    AxisTable::cells(axis, faces, nodes.to_vec(), period)
}

/// The step of nodes that are evenly apart.
pub(crate) fn even_step(nodes: &[f64]) -> Option<f64> {
    let n = nodes.len();
    if n < 2 {
        return None;
    }
    let step = (nodes[n - 1] - nodes[0]) / (n - 1) as f64;
    let is_even = |w: &[f64]| (w[1] - w[0] - step).abs() <= SLACK * step;
    (step > 0.0 && nodes.windows(2).all(is_even)).then_some(step)
}

/// Cells, or a repeated node, by the length of a box; `None` where it is neither's.
fn by_box([lo, hi]: [f64; 2], first: f64, last: f64, step: Option<f64>, n: usize) -> Option<(bool, bool)> {
    let is = |length: f64| ((hi - lo) / length - 1.0).abs() <= STATED;
    let found = (step.is_some_and(|step| is(step * n as f64)), is(last - first));
    (found.0 != found.1).then_some(found)
}

/// Whether nodes lie as the middles of cells do, and as nodes that end where they begin.
fn by_place(nodes: &[f64], step: Option<f64>, known: &Known<'_>) -> (bool, bool) {
    let (first, last) = (nodes[0], nodes[nodes.len() - 1]);
    let slack = SLACK * (last - first) / (nodes.len() - 1) as f64;
    let near = |a: f64, b: f64| (a - b).abs() <= slack;
    let is_symmetric = near(first, -last);
    let from_zero = step.is_some_and(|step| near(first, 0.5 * step) || near(last, -0.5 * step));
    let has_ends = is_symmetric || near(first, 0.0) || near(last, 0.0);
    let repeated = has_ends && (known.ends_agree)();
    // Point data of a format that has cell data as well are no cells where both would fit.
    let points = known.centering == Centering::Points && repeated;
    let cells = step.is_some() && (from_zero || is_symmetric) && !points;
    (cells, repeated)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decide(nodes: &[f64], centering: Centering, stated: Option<[f64; 2]>, agree: bool) -> Result<[f64; 2]> {
        let known = Known { centering, stated, ends_agree: &|| agree };
        periodic_axis("rho", ("x", nodes), &known).map(|(table, _)| [table.lo, table.hi])
    }

    const FROM_ZERO: [f64; 4] = [0.5, 1.5, 2.5, 3.5];
    const AT_ZERO: [f64; 4] = [0.0, 1.0, 2.0, 3.0];
    const SYMMETRIC: [f64; 4] = [-1.5, -0.5, 0.5, 1.5];
    const ELSEWHERE: [f64; 4] = [7.2, 8.2, 9.2, 10.2];

    #[test]
    fn places_decide_where_they_can() {
        let auto = |nodes: &[f64], agree| decide(nodes, Centering::Unknown, None, agree).ok();
        // Equal slices change nothing where nodes lie half a cell from zero.
        assert_eq!(auto(&FROM_ZERO, false), Some([0.0, 4.0]));
        assert_eq!(auto(&FROM_ZERO, true), Some([0.0, 4.0]));
        assert_eq!(auto(&[-3.5, -2.5, -1.5, -0.5], true), Some([-4.0, 0.0]));
        assert_eq!(auto(&AT_ZERO, true), Some([0.0, 3.0]));
        assert_eq!(auto(&SYMMETRIC, false), Some([-2.0, 2.0]));
        assert_eq!(auto(&[0.0, 1.0, 5.0, 6.0], true), Some([0.0, 6.0]), "uneven, from zero, and the ends agree");
    }

    #[test]
    fn what_does_not_decide_is_asked_for() {
        for (nodes, agree, part) in [
            (&AT_ZERO[..], false, "neither fits"),
            (&SYMMETRIC, true, "both fit"),
            (&ELSEWHERE, true, "neither fits"),
            (&ELSEWHERE, false, "neither fits"),
            (&[0.5, 1.5, 5.0, 6.0], false, "neither fits"),
        ] {
            let error = decide(nodes, Centering::Unknown, None, agree).unwrap_err().to_string();
            assert!(error.contains("input.centering") && error.contains(part), "{nodes:?}: {error}");
        }
    }

    /// What one message proposes another must not refuse.
    #[test]
    fn uneven_steps_are_not_said_to_be_cells() {
        let nodes = &[0.5, 1.5, 5.0, 6.0];
        for (centering, agree) in [(Centering::Unknown, false), (Centering::Nodes, false), (Centering::Cells, true)] {
            let error = decide(nodes, centering, None, agree).unwrap_err().to_string();
            assert!(error.contains("give the file bounds of") && !error.contains("`centering: cells`"), "{error}");
        }
    }

    #[test]
    fn statements_come_first() {
        assert_eq!(decide(&AT_ZERO, Centering::Cells, None, true).unwrap(), [-0.5, 3.5]);
        assert_eq!(decide(&ELSEWHERE, Centering::Nodes, None, true).unwrap(), [7.2, 10.2]);
        assert_eq!(decide(&SYMMETRIC, Centering::Points, None, true).unwrap(), [-1.5, 1.5], "point data");
        assert_eq!(decide(&AT_ZERO, Centering::Unknown, Some([0.0, 4.0]), true).unwrap(), [-0.5, 3.5]);
        assert_eq!(decide(&SYMMETRIC, Centering::Unknown, Some([-1.5, 1.5]), true).unwrap(), [-1.5, 1.5]);
        // A box within the grid repeats by itself.
        assert_eq!(decide(&AT_ZERO, Centering::Unknown, Some([0.5, 2.0]), false).unwrap(), [0.0, 3.0]);
        let error = decide(&AT_ZERO, Centering::Nodes, None, false).unwrap_err().to_string();
        assert!(error.contains("different values in its first and last slice"), "{error}");
        let error = decide(&[0.0, 1.0, 5.0], Centering::Cells, None, false).unwrap_err().to_string();
        assert!(error.contains("uneven steps"), "{error}");
    }
}
