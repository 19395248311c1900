//! The maps that can be drawn of particles: density in slices and along lines of sight, error, motion, materials.

use super::axis::{Axis, rounded};
use super::color::MATERIALS;
use super::map::{Arrow, Map, Scale};
use super::portrait::{Portrait, Side};
use super::profile::steepest;
use super::raster::{Depth, View, sums};
use super::statistics::quantile;
use crate::error::Result;
use std::collections::BTreeMap;

/// Share of space that particles have to fill for a pixel to be shown.
const FILLED: f64 = 0.3;
/// Pixels to an arrow.
const ARROW: usize = 17;
/// Of the largest arrow, in its share of the picture.
const ARROW_REACH: f64 = 0.9;
/// Least range of the colors of errors.
const LEAST_ERROR: f64 = 0.002;

const NAMES: [&str; 3] = ["x", "y", "z"];

/// A view with its title.
fn views(portrait: &Portrait) -> Vec<(View, String)> {
    let middle = portrait.middle();
    let name = |k: usize| match portrait.side {
        Side::Radius(_) => format!("slice through the center, {} up", NAMES[k]),
        Side::Axis => format!("slice through the middle, {} up", NAMES[k]),
    };
    match portrait.dimension {
        1 => Vec::new(),
        2 => vec![(View::new(portrait, [0, 1], Depth::Flat), String::new())],
        _ => {
            let slice = |up: usize| (View::new(portrait, [0, up], Depth::Slice(3 - up, middle[3 - up])), name(up));
            // Layers that go on sideways show in a slice across them.
            let has_layers = portrait.periodic[0] && portrait.periodic[1] && steepest(portrait) == 2;
            let first = if has_layers { 2 } else { 1 };
            vec![slice(first), slice(3 - first)]
        }
    }
}

fn titled(what: &str, of: &str) -> String {
    if of.is_empty() { what.into() } else { format!("{what}: {of}") }
}

fn labels(portrait: &Portrait, view: &View) -> [String; 2] {
    view.axes.map(|k| portrait.length_label(NAMES[k]))
}

/// Density in the file's units, with the share of space that is filled, at each pixel.
pub(super) fn densities(portrait: &Portrait, view: &View) -> Vec<[f64; 2]> {
    sums(portrait, view, |i| [portrait.masses[i], portrait.masses[i] / portrait.detail.density[i]])
}

/// The view of the small picture: the slice that the page begins with.
pub(super) fn first_view(portrait: &Portrait) -> Option<View> {
    views(portrait).into_iter().next().map(|v| v.0)
}

/// The density of a view as it is shown, with its colors.
pub(super) fn density_shades(portrait: &Portrait, view: &View) -> (Vec<f64>, Scale) {
    let factor = portrait.labels.density_factor;
    let sums = densities(portrait, view);
    // So few particles that nothing is filled are shown as far as they reach.
    let least = if sums.iter().any(|[_, filled]| *filled > FILLED) { FILLED } else { 0.0 };
    let shown = |[rho, filled]: &[f64; 2]| if *filled > least { rho * factor } else { f64::NAN };
    let values: Vec<f64> = sums.iter().map(shown).collect();
    let scale = Scale::sequential(portrait.density_label(), &values);
    (values, scale)
}

/// All maps of particles as HTML; none in 1-D, where the profile shows the same.
pub(super) fn all(portrait: &Portrait) -> Result<Vec<String>> {
    let mut out = Vec::new();
    let views = views(portrait);
    for (i, (view, of)) in views.iter().enumerate() {
        let (values, scale) = density_shades(portrait, view);
        let arrows = if i == 0 { arrows(portrait, view) } else { None };
        let (arrows, caption) = arrows.unwrap_or_default();
        let what = if arrows.is_empty() { "Density" } else { "Density and velocity" };
        let labels = labels(portrait, view);
        out.push(Map { title: titled(what, of), caption, view, labels, values, scale, arrows }.html()?);
    }
    if portrait.dimension == 3 {
        out.push(projection(portrait)?);
    }
    if let Some((view, of)) = views.first() {
        out.extend(errors(portrait, view, titled("Density error", of), None)?);
        out.extend(materials(portrait, view, of)?);
    }
    Ok(out)
}

/// The density alone.
pub(super) fn density(portrait: &Portrait, title: &str) -> Result<Option<String>> {
    let Some(view) = first_view(portrait) else { return Ok(None) };
    let (values, scale) = density_shades(portrait, &view);
    let (title, labels) = (title.to_owned(), labels(portrait, &view));
    Map { title, caption: String::new(), view: &view, labels, values, scale, arrows: Vec::new() }.html().map(Some)
}

/// The error alone, with colors up to `range` per cent.
pub(super) fn error(portrait: &Portrait, title: &str, range: f64) -> Result<Option<String>> {
    first_view(portrait).map_or(Ok(None), |view| errors(portrait, &view, title.to_owned(), Some(range)))
}

fn projection(portrait: &Portrait) -> Result<String> {
    let view = View::new(portrait, [0, 1], Depth::Along(2));
    // Mass, and the volume that is filled with its mean support radius.
    let columns = sums(portrait, &view, |i| {
        let volume = portrait.masses[i] / portrait.detail.density[i];
        [portrait.masses[i], volume, volume * portrait.detail.support[i]]
    });
    let total = columns.iter().map(|c| c[0]).fold(0.0, f64::max);
    // Over the largest, which needs no unit of its own; where less is filled than half a support radius is the edge.
    let shown = |[mass, depth, reach]: &[f64; 3]| {
        if *mass > 0.0 && depth * depth > 0.5 * reach { mass / total } else { f64::NAN }
    };
    let values: Vec<f64> = columns.iter().map(shown).collect();
    let scale = Scale::sequential("column density [of the largest]".into(), &values);
    let (labels, caption) = (labels(portrait, &view), String::new());
    let title = "Projection along z".into();
    Map { title, caption, view: &view, labels, values, scale, arrows: Vec::new() }.html()
}

/// rho/rho* - 1 where there are particles.
fn errors(portrait: &Portrait, view: &View, title: String, range: Option<f64>) -> Result<Option<String>> {
    if (0..portrait.count()).all(|i| portrait.error(i).is_none()) {
        return Ok(None);
    }
    let sums = sums(portrait, view, |i| {
        let volume = portrait.masses[i] / portrait.detail.density[i];
        let volume = if volume.is_finite() { volume } else { 0.0 };
        portrait.error(i).map_or([0.0, 0.0], |e| [volume, volume * e])
    });
    let values: Vec<f64> = sums.iter().map(|[w, e]| if *w > FILLED { 100.0 * e / w } else { f64::NAN }).collect();
    let mut sizes: Vec<f64> = values.iter().filter(|v| v.is_finite()).map(|v| v.abs()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    // What surfaces and jumps do to any arrangement does not take the colors of all others.
    let resolved = (0..portrait.count()).filter(|i| portrait.is_resolved(*i) == Some(true));
    let mut followed: Vec<f64> = resolved.filter_map(|i| Some(100.0 * portrait.error(i)?.abs())).collect();
    followed.sort_unstable_by(f64::total_cmp);
    let followed = quantile(&followed, 0.99).map_or(0.0, |e| 1.5 * e);
    let usual = quantile(&sizes, 0.75).unwrap_or(0.0).max(followed);
    let most = range.unwrap_or(usual.max(100.0 * LEAST_ERROR));
    let beyond = sizes.iter().filter(|v| **v > most).count();
    let axis = Axis::linear("\u{3c1}/\u{3c1}* \u{2212} 1 [%]");
    let caption = if beyond > 0 {
        format!(
            "{:.0} % of the area is beyond the colors, up to {} %.",
            100.0 * beyond as f64 / sizes.len() as f64,
            rounded(sizes.last().copied().unwrap_or(0.0))
        )
    } else {
        String::new()
    };
    let labels = labels(portrait, view);
    let scale = Scale::Diverging(axis, most);
    Map { title, caption, view, labels, values, scale, arrows: Vec::new() }.html().map(Some)
}

/// Mean velocities in the plane, with what their lengths mean; none where nothing moves there.
fn arrows(portrait: &Portrait, view: &View) -> Option<(Vec<Arrow>, String)> {
    let velocities = portrait.velocities.as_ref()?;
    let coarse = view.coarse(ARROW);
    let [a, b] = view.axes;
    // Of the whole plane at once: the finest support is that of a coarse pixel.
    let sums = sums(portrait, &coarse, |i| {
        let volume = portrait.masses[i] / portrait.detail.density[i];
        [volume, volume * velocities[i][a], volume * velocities[i][b]]
    });
    let mean = |s: &[f64; 3]| (s[0] > FILLED).then(|| [s[1] / s[0], s[2] / s[0]]);
    let largest = sums.iter().filter_map(mean).map(|v| v[0].hypot(v[1])).fold(0.0, f64::max);
    if !(largest > 0.0 && largest.is_finite()) {
        return None;
    }
    let pixel = coarse.pixel();
    let reach = ARROW_REACH * pixel[0].min(pixel[1]);
    let mut out = Vec::new();
    for (p, sum) in sums.iter().enumerate() {
        let Some(v) = mean(sum) else { continue };
        let (column, row) = (p % coarse.pixels[0], p / coarse.pixels[0]);
        let by = v.map(|c| c / largest * reach);
        let center = [view.lo[0] + (column as f64 + 0.5) * pixel[0], view.lo[1] + (row as f64 + 0.5) * pixel[1]];
        out.push(Arrow { from: sph::array(|k| center[k] - 0.5 * by[k]), by });
    }
    let speed = rounded(largest * portrait.labels.velocity_factor);
    Some((out, format!("The longest arrow is {speed} {}.", portrait.labels.velocity)))
}

/// The material that fills most of each pixel.
fn materials(portrait: &Portrait, view: &View, of: &str) -> Result<Option<String>> {
    let Some(ids) = &portrait.materials else { return Ok(None) };
    let mut counts: BTreeMap<i64, usize> = BTreeMap::new();
    ids.iter().for_each(|id| *counts.entry(*id).or_default() += 1);
    let mut known: Vec<(i64, usize)> = counts.into_iter().collect();
    known.sort_by_key(|(id, count)| (std::cmp::Reverse(*count), *id));
    let others = known.len() > MATERIALS;
    known.truncate(MATERIALS);
    known.sort_unstable();
    let place = |id: i64| known.iter().position(|k| k.0 == id).unwrap_or(MATERIALS);
    let sums = sums(portrait, view, |i| {
        let mut out = [0.0; MATERIALS + 1];
        out[place(ids[i])] = portrait.masses[i] / portrait.detail.density[i];
        out
    });
    let most = |s: &[f64; MATERIALS + 1]| {
        let filled = s.iter().sum::<f64>() > FILLED;
        let first = (0..s.len()).max_by(|a, b| s[*a].total_cmp(&s[*b]).then(b.cmp(a)));
        first.filter(|_| filled).map_or(f64::NAN, |i| i as f64)
    };
    let values = sums.iter().map(most).collect();
    let mut names: Vec<String> = known.iter().map(|k| k.0.to_string()).collect();
    if others {
        names.resize(MATERIALS, String::new());
        names.push("others".into());
    }
    let (title, labels) = (titled("Materials", of), labels(portrait, view));
    let caption = "Numbers of the materials (MaterialIDs), without unit.".into();
    let scale = Scale::Categories(names);
    Map { title, caption, view, labels, values, scale, arrows: Vec::new() }.html().map(Some)
}
