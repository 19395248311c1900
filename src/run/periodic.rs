//! What does not go on across periodic faces, where the code will see a jump.

use crate::field::{CarriedField, CarriedInfo, ScalarField, probes};
use crate::input::internal_units::Prepared;
use crate::input::thermal;
use crate::scene::Scene;
use sph::domain::{Axis, Domain};
use sph_formats::common::particle_names as names;

/// Share of the extent from a periodic face at which densities on both of its sides are compared, and by what factor they differ where that is
/// not a steep place but a jump.
const BESIDE_A_FACE: f64 = 1e-6;
const JUMP: f64 = 1.3;

/// Places along a line through the box at which densities are compared with each other: a field of cells, or one with jumps, has steps everywhere.
const STEPS: usize = 64;
/// Lines that are enough to know that.
const LINES: usize = 256;
/// The same of fields, each of whose values may take long.
const LINES_OF_FIELDS: usize = 64;
/// Of a field whose sign may change: its difference between the faces over that of neighboring places within, and over its range, which are a jump.
const STEP: f64 = 4.0;
const OF_RANGE: f64 = 0.05;
/// Of its largest value: no jump.
const ROUNDING: f64 = 1e-6;

const AXES: [&str; 3] = ["x", "y", "z"];

/// What is said of the density, of a resolution, of fields that codes read, and of a rotation of all.
pub(crate) fn doubts<const D: usize>(scene: &Scene, prepared: &Prepared<D>) -> Vec<String> {
    let domain = &prepared.source.domain;
    let axes = || (0..D).filter(|&k| domain.axes[k] == Axis::Periodic && prepared.of_snapshot.is_none());
    let mut doubts: Vec<String> = axes().filter_map(|k| density_across(prepared, k)).collect();
    if scene.resolution.is_some() {
        doubts.extend(axes().filter_map(|k| resolution_across(prepared, k)));
    }
    for field in prepared.source.carried.iter().filter(|field| is_read(&field.info().name)) {
        doubts.extend(axes().filter_map(|k| field_across(prepared, field.as_ref(), k)));
    }
    doubts.extend(axes().find_map(|k| rotation_across(scene, prepared, k)));
    doubts
}

/// A density that does not go on across periodic faces along axis `k`.
fn density_across<const D: usize>(prepared: &Prepared<D>, k: usize) -> Option<String> {
    let [lo, hi] = jump_across(prepared, prepared.source.density.as_ref(), k)?;
    Some(format!(
        "the box is periodic along {0}, but the density is not: in the median it is {1:.3} times as high at its \
         {2} face as at the other, and the code will see this jump as well; state `boundary: open` along {0} if \
         the box ends there",
        AXES[k],
        (hi / lo).max(lo / hi),
        if hi > lo { "upper" } else { "lower" }
    ))
}

/// The same of the numbers of particles that a resolution asks for.
fn resolution_across<const D: usize>(prepared: &Prepared<D>, k: usize) -> Option<String> {
    let [lo, hi] = jump_across(prepared, prepared.target().resolution_field(), k)?;
    Some(format!(
        "the box is periodic along {}, but the resolution is not: in the median it asks for {:.3} times as many particles at its {} face as at the \
         other, so that particles of different masses meet there; state one that is the same at both",
        AXES[k],
        (hi / lo).max(lo / hi),
        if hi > lo { "upper" } else { "lower" }
    ))
}

/// Whether codes read a column of that name, and compute with it.
fn is_read(name: &str) -> bool {
    let standard = names::standard(name).unwrap_or(name);
    [names::VELOCITIES, names::MAGNETIC_FIELD].contains(&standard) || thermal::name_of(name).is_some()
}

/// A field that does not go on across periodic faces along axis `k`, where there is matter.
fn field_across<const D: usize>(prepared: &Prepared<D>, field: &dyn CarriedField<D>, k: usize) -> Option<String> {
    let domain = &prepared.source.domain;
    let CarriedInfo { name, components, .. } = field.info();
    let at = |x: [f64; D]| {
        let mut row = vec![0.0; *components];
        field.evaluate(&x, &mut row);
        row
    };
    let is_filled = |x: &[f64; D]| is_filled(prepared, x, k);
    let places: Vec<[f64; D]> = probes(domain).into_iter().filter(is_filled).take(LINES_OF_FIELDS).collect();
    let faces: Vec<[Vec<f64>; 2]> = places.iter().map(|x| beside_faces(domain, x, k).map(at)).collect();
    let lines: Vec<Vec<Vec<f64>>> = places.iter().map(|x| line(domain, x, k).map(at).collect()).collect();
    let largest_step = |line: &Vec<Vec<f64>>, c: usize| {
        line.windows(2).map(|pair| (pair[1][c] - pair[0][c]).abs()).fold(0.0, f64::max)
    };
    let jumps = |c: &usize| {
        let jump = median(faces.iter().map(|[lo, hi]| (hi[*c] - lo[*c]).abs()).collect())?;
        let step = median(lines.iter().map(|line| largest_step(line, *c)).collect())?;
        let values = || lines.iter().flatten().map(|row| row[*c]);
        let (least, most) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        let is_rounding = jump <= ROUNDING * least.abs().max(most.abs());
        (jump > STEP * step && jump > OF_RANGE * (most - least) && !is_rounding).then_some(jump)
    };
    let jump = (0..*components).find_map(|c| jumps(&c))?;
    Some(format!(
        "the box is periodic along {0}, but '{name}' is not: in the median it differs by {jump:.3e} between the two faces, and the code will see this \
         jump as well; state `boundary: open` along {0} if the box ends there",
        AXES[k]
    ))
}

/// A rotation of a box whose images do not rotate with it.
fn rotation_across<const D: usize>(scene: &Scene, prepared: &Prepared<D>, k: usize) -> Option<String> {
    let rate = &scene.motion.rotation;
    let is_across = match rate.len() {
        3 => (0..3).any(|axis| axis != k && rate[axis].number() != 0.0),
        _ => rate.iter().any(|rate| rate.number() != 0.0),
    };
    let domain = &prepared.source.domain;
    let is_filled = is_across && probes(domain).iter().any(|x| is_filled(prepared, x, k));
    is_filled.then(|| {
        format!(
            "motion.rotation turns a box that is periodic along {0}, whose images do not turn with it: velocities jump at its faces; state `boundary: open` \
             along {0}, or leave the rotation out",
            AXES[k]
        )
    })
}

/// Whether there is matter at both faces along axis `k`.
fn is_filled<const D: usize>(prepared: &Prepared<D>, x: &[f64; D], k: usize) -> bool {
    beside_faces(&prepared.source.domain, x, k).iter().all(|x| prepared.source.density.value(x) > 0.0)
}

/// A place moved along axis `k` to beside both faces.
fn beside_faces<const D: usize>(domain: &Domain<D>, x: &[f64; D], k: usize) -> [[f64; D]; 2] {
    let step = BESIDE_A_FACE * domain.extent()[k];
    [domain.lo[k] + step, domain.hi[k] - step].map(|at| moved(x, k, at))
}

/// Places from one face to the other.
fn line<const D: usize>(domain: &Domain<D>, x: &[f64; D], k: usize) -> impl Iterator<Item = [f64; D]> {
    let (x, lo, length) = (*x, domain.lo[k], domain.extent()[k]);
    (0..STEPS).map(move |i| moved(&x, k, lo + (i as f64 + 0.5) / STEPS as f64 * length))
}

fn moved<const D: usize>(x: &[f64; D], k: usize, at: f64) -> [f64; D] {
    let mut x = *x;
    x[k] = at;
    x
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// What a field has at both of the periodic faces along axis `k`, in the median of places there, where it does not go on across them.
fn jump_across<const D: usize>(prepared: &Prepared<D>, field: &dyn ScalarField<D>, k: usize) -> Option<[f64; 2]> {
    let domain = &prepared.source.domain;
    let both = |x: [f64; D]| beside_faces(domain, &x, k).map(|x| field.value(&x));
    let places = probes(domain);
    let mut sides: Vec<[f64; 2]> = places.iter().copied().map(both).filter(|[lo, hi]| *lo > 0.0 && *hi > 0.0).collect();
    let ratio = |[lo, hi]: &[f64; 2]| (hi / lo).max(lo / hi);
    sides.sort_by(|a, b| ratio(a).total_cmp(&ratio(b)));
    let [lo, hi] = *sides.get(sides.len() / 2)?;
    if ratio(&[lo, hi]) <= JUMP {
        return None;
    }
    let largest_within = |x: &[f64; D]| {
        let along: Vec<f64> = line(domain, x, k).map(|x| field.value(&x)).collect();
        let steps = along.windows(2).filter(|pair| pair[0] > 0.0 && pair[1] > 0.0);
        steps.map(|pair| ratio(&[pair[0], pair[1]])).fold(1.0, f64::max)
    };
    let within = median(places.iter().take(LINES).map(largest_within).collect())?;
    (ratio(&[lo, hi]) > JUMP * within).then_some([lo, hi])
}
