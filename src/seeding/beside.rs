//! Parts with one particle that have a thin layer, or a filament, at an angle or bent, and something about it: the middle of their mass is in neither.

use super::kronecker;
use crate::target::Target;
use crate::target::cells::Cell;
use crate::target::edges::ways;

/// Density of the layer over that at the middle of the part, at least: that of bodies of their own.
const CONTRAST: f64 = std::f64::consts::E * std::f64::consts::E;
/// Density at the middle over that of the whole part, at most: a smooth part has as much in its middle as on average.
const MOST: f64 = 0.9;
/// How far from its corners a part is looked at, over its size.
const INWARDS: f64 = 0.1;
/// Looks on a line, and steps to the middle of what was found.
const LOOKS: usize = 32;
const STEPS: usize = 24;

/// Where the particle of a part, with the corners of the box about its cells, goes whose middle, with the density there, is beside a layer: into it, as
/// near as may be, or into the rest, by their shares of the mass and its `number`, so that of many parts each gets as many as it has mass for. None where
/// there is no such layer.
pub(super) fn of_layer_or_medium<const D: usize>(
    target: &Target<'_, D>,
    (cells, [lo, hi]): (&[Cell<D>], [[f64; D]; 2]),
    (middle, here): (&[f64; D], f64),
    number: usize,
) -> Option<[f64; D]> {
    let volume: f64 = (0..D).map(|k| hi[k] - lo[k]).product();
    let whole = cells.iter().map(|cell| cell.mass).sum::<f64>() / volume;
    if !(here < MOST * whole) {
        return None;
    }
    let layer = nearest(target, [&lo, &hi], middle, whole.max(CONTRAST * here)).filter(|x| target.admits(x))?;
    let [draw, share] = kronecker::point(&kronecker::generator::<2>(), number);
    let around = around(target, [&lo, &hi]).min(here);
    if draw * whole >= around {
        return Some(layer);
    }
    let is_beside = |cell: &&Cell<D>| cell.mass < (CONTRAST * around).min(whole) * cell.volume();
    let rest: Vec<&Cell<D>> = cells.iter().filter(is_beside).collect();
    // Anywhere in it: of a part that is all along a layer the middle of the rest is in that again.
    let mut before = share * rest.iter().map(|cell| cell.volume()).sum::<f64>();
    let within = rest.iter().find(|cell| {
        before -= cell.volume();
        before < 0.0
    });
    within.map(|cell| cell.center()).filter(|x| target.admits(x) && target.number_density(x) < whole)
}

/// Density about a layer in a box: the median at its corners.
fn around<const D: usize>(target: &Target<'_, D>, [lo, hi]: [&[f64; D]; 2]) -> f64 {
    let inwards = |k: usize, is_upper: bool| {
        let (from, to) = if is_upper { (hi[k], lo[k]) } else { (lo[k], hi[k]) };
        from + INWARDS * (to - from)
    };
    let corner = |c: usize| -> [f64; D] { sph::array(|k| inwards(k, c >> k & 1 == 1)) };
    let mut found: Vec<f64> =
        (0..1 << D).map(corner).filter(|x| target.admits(x)).map(|x| target.number_density(&x)).collect();
    found.sort_by(f64::total_cmp);
    found.get(found.len() / 2).copied().unwrap_or(0.0)
}

/// The nearest place on lines through `from`, within a box, from which on the density is at least `least`, where it is highest there.
fn nearest<const D: usize>(
    target: &Target<'_, D>,
    [lo, hi]: [&[f64; D]; 2],
    from: &[f64; D],
    least: f64,
) -> Option<[f64; D]> {
    let place = |way: &[f64; D], at: f64| -> [f64; D] { sph::array(|k| from[k] + at * way[k]) };
    let density = |way: &[f64; D], at: f64| {
        let x = place(way, at);
        if target.admits(&x) { target.number_density(&x) } else { 0.0 }
    };
    let mut found: Option<(f64, [f64; D])> = None;
    for way in ways::<D>().flat_map(|way| [way, way.map(|w| -w)]) {
        let to_face = |k: usize| ((if way[k] > 0.0 { hi[k] } else { lo[k] }) - from[k]) / way[k];
        let face = (0..D).filter(|k| way[*k] != 0.0).map(to_face).fold(f64::INFINITY, f64::min);
        let end = found.map_or(face, |(distance, _)| face.min(distance));
        let step = end / LOOKS as f64;
        let Some(first) = (1..=LOOKS).find(|i| density(&way, *i as f64 * step) >= least) else { continue };
        let top = highest(|at| density(&way, at), first as f64 * step, (step, end));
        found = Some((top, place(&way, top)));
    }
    found.map(|f| f.1)
}

/// Where a function is highest from `from` on, before it falls, by steps that shrink; between 0 and `end`.
fn highest(f: impl Fn(f64) -> f64, from: f64, (mut step, end): (f64, f64)) -> f64 {
    let (mut at, mut most) = (from, f(from));
    for _ in 0..STEPS {
        let next = [at + step, at - step].into_iter().filter(|x| (0.0..=end).contains(x)).map(|x| (x, f(x)));
        match next.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, value)| *value > most) {
            Some(higher) => (at, most) = higher,
            None => step *= 0.5,
        }
    }
    at
}
