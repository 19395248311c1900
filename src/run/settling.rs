//! Damps the motion of placed particles if a scene asks for it (`settle`), and then evolves them in time (`certify`).

use super::assembly::{self, BODY_ID, row};
use super::checkpoint::refuse_interrupted;
use crate::codes::TargetCode;
use crate::error::{Error, Result};
use crate::follow::{Options, Outcome, follow_file};
use crate::input::particles::is_zero;
use crate::relaxation::{CERTIFICATE, Certificate, Control, Event, SETTLING, Step, StopReason};
use crate::scene::Scene;
use nalgebra::SVector;
use serde::Serialize;
use sph::geometry::distance;
use sph_formats::common::particle_names as names;
use sph_formats::{Column, FormatSpec, ParticleFile, UnitSystem, Values};
use std::time::Instant;

/// What became of particles whose motion was damped.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Settling {
    /// While it was damped; `None` for what was followed alone.
    pub damped: Option<Certificate>,
    /// Free from there, for as long as the scene's `certify` says.
    pub free: Option<Certificate>,
    /// Smallest distance of two particles after it was, over the spacing there.
    pub closest_pair: Option<f64>,
    pub seconds: f64,
    /// Why it ended early, if it did.
    pub stop: Option<StopReason>,
    #[serde(skip)]
    pub notes: Vec<String>,
}

/// What the figures of a report are of.
const BEFORE: &str = "density error, noise, mass in place and balance are those before the particles settled; `sph-prep check` measures the file";

/// The code whose forces settle particles, or show what becomes of bodies and a medium together.
///
/// # Errors
/// A scene that settles for no code.
pub(super) fn code_of(scene: &Scene, format: Option<&FormatSpec>) -> Result<Option<TargetCode>> {
    let key = match (scene.settle, scene.certify.filter(|_| scene.holds_its_medium())) {
        (Some(_), _) => "settle",
        (None, Some(_)) => "certify",
        (None, None) => return Ok(None),
    };
    let known = scene.code().or_else(|| format.and_then(|f| TargetCode::of_format(f.name)));
    known.map(Some).ok_or_else(|| {
        Error::scene(key, "needs to know for which code: state target_code, or write a file in the format of one")
    })
}

/// Damps the motion of a scene's particles with the forces of `code`, and follows them on from there.
///
/// # Errors
/// Those of [`follow_file`], and gas that nothing holds.
pub(super) fn settle(
    scene: &Scene,
    code: Option<&TargetCode>,
    file: &mut ParticleFile,
    control: &Control<'_>,
) -> Result<Option<Settling>> {
    let (Some(code), Some(time)) = (code, scene.settle) else { return Ok(None) };
    let own = scene.own_gravity().filter(|_| file.header.units == UnitSystem::CODE);
    let is_held = file.header.periodic[..file.header.dimension].iter().all(|p| *p)
        || (file.header.dimension == 3 && (own.is_some() || file.header.units != UnitSystem::CODE));
    if !is_held {
        let problem =
            "would let the gas flow out: neither its own gravity in 3-D nor a periodic box holds it; leave it out";
        return Err(Error::scene("settle", problem));
    }
    let begin = Instant::now();
    control.tell(Event::Begin(Step::Relax(SETTLING)));
    let before = (centers(file), angular_momentum(file), turning(file));
    let mut whole = [names::COORDINATES, names::VELOCITIES].map(|name| mean(file, name));
    let drifts = |field: &String| field.starts_with('v') && field != "v_phi";
    let moves = !scene.motion.bulk.is_empty() || scene.fields.0.keys().any(drifts) || scene.input.file.is_some();
    if scene.bodies.is_empty() && !moves {
        // What turns about the middle of its domain moves as a whole by what its particles are off there.
        whole[1] = whole[1].map(|_| [0.0; 3]);
    }
    let duration = scene.certify.unwrap_or(0.0);
    let options = Options { duration, gravity: own, settle: Some(time), ..Options::default() };
    let Outcome { certificate, settled, notes } =
        follow_file(file, code, &options, control).map_err(|e| under("settle", e))?;
    refuse_interrupted(scene, control)?;
    let Some(settled) = settled else { return Ok(None) };
    *file = settled.file;
    if file.header.periodic == [false; 3] {
        // Damping and gravity by a tree keep neither to the last digits.
        for (name, before) in [names::COORDINATES, names::VELOCITIES].into_iter().zip(whole) {
            let moved = before.zip(mean(file, name));
            moved.into_iter().for_each(|(before, now)| shift(file, name, &sph::array(|k| before[k] - now[k])));
        }
    }
    let mut notes: Vec<String> = notes.into_iter().map(|note| format!("settled: {note}")).collect();
    notes.push(BEFORE.to_owned());
    notes.extend(moved((&before.0, before.1), (&centers(file), angular_momentum(file))));
    notes.extend(before.2.zip(turning(file)).map(|(before, after)| {
        let percent = 100.0 * (after / before - 1.0);
        format!(
            "settled: the gas turns at a mean rate of {after:.4e} per unit of time, {percent:+.1} % from {before:.4e}"
        )
    }));
    Ok(Some(Settling {
        closest_pair: Some(settled.closest_pair),
        stop: settled.certificate.cut.or(scene.certify.and(certificate.cut)),
        damped: Some(settled.certificate),
        free: scene.certify.map(|_| certificate),
        seconds: begin.elapsed().as_secs_f64(),
        notes,
    }))
}

/// Settles and follows bodies and the medium about them together, as the scene asks for, in the box that holds them. They settle at rest: the
/// velocities of the scene are those of the particles again afterwards.
///
/// # Errors
/// Those of [`follow_file`].
pub(super) fn in_medium(
    scene: &Scene,
    code: Option<&TargetCode>,
    file: &mut ParticleFile,
    control: &Control<'_>,
) -> Result<Option<Settling>> {
    let Some(code) = code else { return Ok(None) };
    let begin = Instant::now();
    let gravity = match scene.own_gravity() {
        None => Some(0.0),
        own => own.filter(|_| file.header.units == UnitSystem::CODE),
    };
    let walls = scene.walls_of_medium(file.header.dimension);
    let options = Options { duration: 0.0, gravity, walls, ..Options::default() };
    let (mut notes, mut damped, mut stop, mut closest_pair) = (Vec::new(), None, None, None);
    if let Some(time) = scene.settle {
        control.tell(Event::Begin(Step::Relax(SETTLING)));
        let motion = at_rest(file);
        let outcome = follow_file(file, code, &Options { settle: Some(time), ..options }, control);
        let Outcome { settled, notes: said, .. } = outcome.map_err(|e| under("settle", e))?;
        refuse_interrupted(scene, control)?;
        let Some(settled) = settled else { return Ok(None) };
        *file = settled.file;
        put_back(file, motion, &mut notes);
        notes.extend(said.into_iter().map(|note| format!("settled: {note}")));
        notes.push(BEFORE.to_owned());
        stop = settled.certificate.cut;
        closest_pair = Some(settled.closest_pair);
        damped = Some(settled.certificate);
    }
    let mut free = None;
    if let Some(duration) = scene.certify {
        control.tell(Event::Begin(Step::Relax(CERTIFICATE)));
        let outcome = follow_file(file, code, &Options { duration, ..options }, control);
        let Outcome { certificate, notes: said, .. } = outcome.map_err(|e| under("certify", e))?;
        refuse_interrupted(scene, control)?;
        if damped.is_none() {
            notes.extend(said.into_iter().map(|note| format!("certificate: {note}")));
        }
        stop = stop.or(certificate.cut);
        free = Some(certificate);
    }
    Ok(Some(Settling { damped, free, closest_pair, seconds: begin.elapsed().as_secs_f64(), stop, notes }))
}

/// The mean of a vector over the mass of all types of particles; none where some have none.
fn mean(file: &ParticleFile, name: &str) -> Option<[f64; 3]> {
    let columns: Vec<(&Column, &Column)> = file
        .species
        .iter()
        .map(|s| Some((s.table.column(name)?, s.table.column(names::MASSES)?)))
        .collect::<Option<_>>()?;
    let rows = columns.iter().flat_map(|&(x, m)| (0..m.values.len()).map(move |i| (m.values.get(i), row(x, i))));
    Some(assembly::mean(rows))
}

/// Adds `by` to a vector of all particles.
fn shift(file: &mut ParticleFile, name: &str, by: &[f64; 3]) {
    let columns = file.species.iter_mut().flat_map(|s| &mut s.table.columns).filter(|c| c.name == name);
    for column in columns {
        let (width, values) = (column.components.max(1), &column.values);
        let moved = |i: usize| values.get(i) + by.get(i % width).copied().unwrap_or(0.0);
        column.values = Values::F64((0..values.len()).map(moved).collect());
    }
}

/// Sets all velocities of a file to 0. Returns what they were.
fn at_rest(file: &mut ParticleFile) -> Vec<Values> {
    let columns = file.species.iter_mut().flat_map(|s| &mut s.table.columns).filter(|c| c.name == names::VELOCITIES);
    let taken = columns.map(|c| {
        let still = Values::F64(vec![0.0; c.values.len()]);
        std::mem::replace(&mut c.values, still)
    });
    taken.collect()
}

fn put_back(file: &mut ParticleFile, motion: Vec<Values>, notes: &mut Vec<String>) {
    if !motion.iter().all(is_zero) {
        notes.push(
            "settled: the particles were settled at rest, and then given the velocities of the \
                    scene"
                .to_owned(),
        );
    }
    let columns = file.species.iter_mut().flat_map(|s| &mut s.table.columns).filter(|c| c.name == names::VELOCITIES);
    columns.zip(motion).for_each(|(column, values)| column.values = values);
}

/// Under the scene's own key.
fn under(asked: &str, error: Error) -> Error {
    match error {
        Error::Field { name, problem } => Error::scene(asked, format!("'{name}' {problem}")),
        Error::Scene { key, problem } => Error::scene(asked, format!("{key} {problem}")),
        other => other,
    }
}

/// The number and the center of mass of each body of a file that has several.
fn centers(file: &ParticleFile) -> Vec<(i64, [f64; 3])> {
    let mut sums: std::collections::BTreeMap<i64, (f64, [f64; 3])> = std::collections::BTreeMap::new();
    for table in file.species.iter().map(|s| &s.table) {
        let columns = [BODY_ID, names::COORDINATES, names::MASSES].map(|name| table.column(name));
        let [Some(body), Some(x), Some(m)] = columns else { continue };
        let stride = x.components.max(1);
        for i in 0..table.count {
            let (mass, place) = sums.entry(body.values.get(i) as i64).or_insert((0.0, [0.0; 3]));
            let own = m.values.get(i);
            *mass += own;
            (0..stride.min(3)).for_each(|k| place[k] += own * x.values.get(i * stride + k));
        }
    }
    sums.into_iter().map(|(body, (mass, place))| (body, place.map(|v| v / mass))).collect()
}

/// The largest component of the angular momentum about the origin of the file, of particles and points.
fn angular_momentum(file: &ParticleFile) -> f64 {
    let mut sum = [0.0_f64; 3];
    for table in file.species.iter().map(|s| &s.table) {
        let columns = [names::COORDINATES, names::VELOCITIES, names::MASSES].map(|name| table.column(name));
        let [Some(x), Some(v), Some(m)] = columns else { continue };
        let get =
            |c: &Column, i: usize, k: usize| if k < c.components { c.values.get(i * c.components + k) } else { 0.0 };
        for (k, sum) in sum.iter_mut().enumerate() {
            let (a, b) = ((k + 1) % 3, (k + 2) % 3);
            let of = |i: usize| m.values.get(i) * (get(x, i, a) * get(v, i, b) - get(x, i, b) * get(v, i, a));
            *sum += (0..table.count).map(of).sum::<f64>();
        }
    }
    sum.into_iter().fold(0.0, |most, l| if l.abs() > most { l.abs() } else { most })
}

/// Angular momentum over moment of inertia of the gas about its center of mass, where most of its motion about that is such a rotation.
fn turning(file: &ParticleFile) -> Option<f64> {
    let table = &file.species.iter().find(|s| s.part_type == 0)?.table;
    let [x, v, m] = [names::COORDINATES, names::VELOCITIES, names::MASSES].map(|name| table.column(name));
    let (x, v, m) = (x?, v?, m?);
    let d = x.components.min(v.components);
    if !(2..=3).contains(&d) {
        return None;
    }
    let row = |c: &Column, i: usize| -> SVector<f64, 3> {
        SVector::from_fn(|k, _| if k < d { c.values.get(i * c.components + k) } else { 0.0 })
    };
    let mean = |c: &Column| {
        let (mut sum, mut mass) = (SVector::<f64, 3>::zeros(), 0.0);
        (0..table.count).for_each(|i| (sum, mass) = (sum + m.values.get(i) * row(c, i), mass + m.values.get(i)));
        sum / mass
    };
    let (center, drift) = (mean(x), mean(v));
    let parts = || (0..table.count).map(|i| (m.values.get(i), row(x, i) - center, row(v, i) - drift));
    let momentum: SVector<f64, 3> = parts().map(|(m, x, v)| m * x.cross(&v)).sum();
    let axis = momentum.try_normalize(0.0)?;
    let inertia: f64 = parts().map(|(m, x, _)| m * axis.cross(&x).norm_squared()).sum();
    let kinetic: f64 = parts().map(|(m, _, v)| m * v.norm_squared()).sum();
    let rate = momentum.norm() / inertia;
    (rate.is_finite() && rate * momentum.norm() > 0.5 * kinetic).then_some(rate)
}

/// How far apart two bodies are now, and how much angular momentum they have.
fn moved(before: (&[(i64, [f64; 3])], f64), after: (&[(i64, [f64; 3])], f64)) -> Option<String> {
    let apart = |of: &[(i64, [f64; 3])]| match of {
        [a, b] => Some(distance(&a.1, &b.1)),
        _ => None,
    };
    let now = apart(after.0)?;
    let percent = |after: f64, before: f64| 100.0 * (after / before - 1.0);
    let change = percent(now, apart(before.0)?);
    let turn = match before.1 > 0.0 {
        true => format!(", with {:+.2} % of angular momentum", percent(after.1, before.1)),
        false => String::new(),
    };
    Some(format!("settled: the centers of the bodies are {now:.6e} apart, {change:+.2} % from where they were{turn}"))
}
