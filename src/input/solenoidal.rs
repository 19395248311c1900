//! Checks whether a magnetic field that a scene states is free of divergence; codes would carry a divergence along.

use crate::field::{CarriedField, probes};
use crate::input::differences::{REACH, slope};
use crate::input::internal_units::Prepared;
use crate::scene::Scene;
use sph::domain::{Axis, Domain};
use sph_formats::common::particle_names as names;

/// Step of the differences over the width of the domain, and what |div B| may be times the width over |B|: differences of smooth fields
/// are no better than this.
const STEP: f64 = 1e-4;
const MOST: f64 = 1e-2;
/// Change of the field from one periodic face to the other, over the largest field.
const JUMP: f64 = 1e-2;

/// What is said of a field with sources, or of one that does not repeat with its box.
pub(crate) fn doubts<const D: usize>(scene: &Scene, prepared: &Prepared<D>) -> Vec<String> {
    let is_stated = scene.fields.stated().any(|(name, _)| matches!(name, "magnetic_field" | "vector_potential"));
    let carried = prepared.source.carried.iter().find(|f| f.info().name == names::MAGNETIC_FIELD);
    let Some(field) = carried.filter(|f| is_stated && f.info().components >= D && D > 1) else { return Vec::new() };
    let domain = &prepared.source.domain;
    let places = probes(domain);
    let strongest = places.iter().map(|x| norm(&at(field.as_ref(), x))).fold(0.0, f64::max);
    if !(strongest > 0.0 && strongest.is_finite()) {
        return Vec::new();
    }
    let mut all = Vec::new();
    let sources = places.iter().filter_map(|x| divergence(field.as_ref(), domain, x)).fold(0.0, f64::max);
    let sources = sources * domain.size() / strongest;
    if sources > MOST {
        let is_potential = scene.fields.stated().any(|(name, _)| name == "vector_potential");
        let remedy = match is_potential {
            true => "its vector potential jumps or bends somewhere, where there is no curl: state a smooth one",
            false => "state a `vector_potential`, whose curl has none",
        };
        all.push(format!(
            "the magnetic field is not free of divergence: its divergence is up to {sources:.1e} times the largest \
             field over the width of the domain; {remedy}"
        ));
    }
    let jump = (0..D).filter(|&k| domain.axes[k] == Axis::Periodic).map(|k| jump(field.as_ref(), domain, &places, k));
    let jump = jump.fold(0.0, f64::max) / strongest;
    if jump > JUMP {
        all.push(format!(
            "the magnetic field has a divergence at the faces of the periodic box, across which it changes by up to \
             {jump:.1e} of the largest: state one that repeats \
             with the box"
        ));
    }
    all
}

/// The components along the axes.
fn at<const D: usize>(field: &dyn CarriedField<D>, x: &[f64; D]) -> [f64; D] {
    let mut all = vec![0.0; field.info().components];
    field.evaluate(x, &mut all);
    sph::array(|k| all[k])
}

fn norm<const D: usize>(v: &[f64; D]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// |div B| by central differences; none next to an edge.
fn divergence<const D: usize>(field: &dyn CarriedField<D>, domain: &Domain<D>, x: &[f64; D]) -> Option<f64> {
    let step = STEP * domain.size();
    let beside = |k: usize, by: f64| {
        let mut y = *x;
        y[k] += by;
        y
    };
    let is_within = (0..D).all(|k| [-REACH, REACH].into_iter().all(|steps| domain.contains(&beside(k, steps * step))));
    is_within.then(|| (0..D).map(|k| slope(step, |by| at(field, &beside(k, by))[k])).sum::<f64>().abs())
}

/// The largest difference of the component across the faces of axis `k` between places of both: lines of force that end
/// there have sources.
fn jump<const D: usize>(field: &dyn CarriedField<D>, domain: &Domain<D>, places: &[[f64; D]], k: usize) -> f64 {
    let inset = 1e-9 * domain.extent()[k];
    let on = |x: &[f64; D], end: f64| {
        let mut y = *x;
        y[k] = end;
        at(field, &y)
    };
    let between = |x: &[f64; D]| (on(x, domain.lo[k] + inset)[k] - on(x, domain.hi[k] - inset)[k]).abs();
    places.iter().map(between).filter(|d| d.is_finite()).fold(0.0, f64::max)
}
