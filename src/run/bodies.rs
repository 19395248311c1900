//! A scene of several bodies: each is placed and balanced as a separate scene; then they are moved to their initial positions and joined in one
//! file.
//!
//! Two bodies on an
//! orbit have their center of mass at rest in the middle of the box.

use super::ambient;
use super::assembly::{self, Body, Frame, Middle, Origin, State};
use super::bodies_report::{BodiesReport, BodyFigures, BodyReport, OrbitFigures};
use super::cache::{PlacedBody, Recipe};
use super::destination::{Destination, intended_format};
use super::drawings::Drawing;
use super::forecast::{ForecastOfBodies, ForeseenBody, ForeseenMedium};
use super::settling;
use super::shares::{Common, Shared, shared};
use super::states::{moving, stopped};
use super::variables::lost;
use super::{memory, overlap, pipeline, turning};
use crate::error::{Error, Result};
use crate::input::core::PART_TYPE;
use crate::output::origin;
use crate::output::parameters::Physics;
use crate::output::particle_file::provenance;
use crate::relaxation::{Control, StopReason};
use crate::scene::{BodyInput, BoundaryName, Conversion, DEFAULT_PARTICLES, Quantity, Scene, in_body, values};
use sph_formats::common::particle_names as names;
use sph_formats::{FormatSpec, ParticleFile, UnitDimension};
use std::path::Path;
use std::time::Instant;

/// Places the bodies of a scene, in the output's units; nothing is written.
///
/// # Errors
/// Any of [`Error`]; those of one body name it.
pub fn place_bodies(
    scene: &Scene,
    formats: &[FormatSpec],
    control: &Control<'_>,
) -> Result<(ParticleFile, BodiesReport)> {
    let start = Instant::now();
    let (Shared { common, gas, scenes, notes, .. }, format) = before(scene, formats)?;
    let code = settling::code_of(scene, format)?;
    let title = |i: usize| scene.bodies[i].title(i);
    let of_gas: Vec<(usize, Scene)> = gas.iter().copied().zip(scenes.iter().cloned()).collect();
    let known = |k| Known::of(&scenes, k, scene.cache.as_deref(), formats);
    let known = (0..scenes.len()).map(known).collect::<Result<Vec<Known>>>()?;
    let count = |(alone, known): (&Scene, &Known)| match known {
        Known::Not if alone.input.keeps_particles() => 0,
        Known::Not => alone.particles.unwrap_or(DEFAULT_PARTICLES),
        Known::As(_) | Known::Kept(_) => 0,
    };
    let shares = shares_of_time(&scenes.iter().zip(&known).map(count).collect::<Vec<_>>(), scene.ambient.is_some());
    let mut placed: Vec<Placed> = Vec::new();
    for (k, (known, share)) in known.into_iter().zip(shares).enumerate() {
        placed.push(match known {
            Known::As(earlier) => placed[earlier].clone(),
            Known::Kept(body) => Placed { body: *body, is_cached: true },
            Known::Not => {
                let (control, cache) = (control.sharing(share), scene.cache.as_deref());
                Placed::new(&scenes[k], cache, (formats, &control)).map_err(|e| in_body(&title(gas[k]), e))?
            }
        });
    }
    let header = placed[0].body.file.header.clone();
    let conversion = common.conversion(&header.units);
    let (mut bodies, mut reports, mut cut_out) = (Vec::new(), Vec::new(), Vec::new());
    let mut placed = placed.into_iter();
    for (i, input) in scene.bodies.iter().enumerate() {
        if let Some(mass) = &input.point_mass {
            let mass = mass.value(&format!("bodies[{}].point_mass", title(i)), UnitDimension::MASS, &conversion)?;
            let mut radii = Vec::new();
            for (name, key, radius) in input.radii() {
                let key = format!("bodies[{}].{key}", title(i));
                radii.push((name, radius.value(&key, UnitDimension::LENGTH, &conversion)?));
            }
            let part_type = input.part_type.unwrap_or(PART_TYPE);
            bodies.push(Body::point(title(i), mass, &radii, (common.dimension, part_type)));
            reports.push(None);
        } else if let Some(Placed { body, is_cached, .. }) = placed.next() {
            let radius = body.figures.radius;
            cut_out.extend(of_a_box(&title(i), &body.file));
            bodies.push(
                Body::new(title(i), body.file, middle_of(input, &of_gas, i))?
                    .reaching(radius)
                    .turned(&input.orientation)?,
            );
            reports.push(Some((body.figures, body.report, is_cached)));
        }
    }
    let mut notes = notes;
    notes.extend(common.equalize(scene, formats, &mut bodies)?);
    let relative =
        scene.orbit.as_ref().map(|o| common.relative(o, &bodies, (&header.units, &conversion))).transpose()?;
    let mut states = common.states(scene, &bodies, relative.as_ref(), &conversion)?;
    match &relative {
        Some(relative) => notes.extend(bodies.iter_mut().filter_map(|body| stopped(body, relative))),
        None => notes.extend(bodies.iter().filter_map(moving)),
    }
    if relative.is_some() {
        assembly::about_center_of_mass(&bodies, &mut states);
    }
    if scene.certify_at_once().is_some() && scene.orbit.as_ref().is_some_and(|o| o.corotation) {
        notes.push("certify follows each body by itself, without the rotation of its orbit".to_owned());
    }
    let own = box_of(scene, common.dimension, &conversion)?;
    overlap::refuse_out_of_box(&bodies, &states, own.as_ref())?;
    overlap::refuse_overlap(&bodies, &states, own.as_ref())?;
    overlap::refuse_coincident_points(&bodies, &states)?;
    let mut warnings = Vec::from_iter(scene.has_several_gases());
    warnings.extend(cut_out.into_iter().filter(|_| scene.ambient.is_none()));
    let has_gravity = common.dimension == 3 && (common.has_units() || scene.own_gravity().is_some());
    let constant = has_gravity.then(|| common.gravity_in(&header.units));
    let supports: Vec<Option<f64>> = reports.iter().map(|r| r.as_ref().and_then(|r| r.0.support)).collect();
    let turning = turning::of_bodies((&bodies, &states), &supports, (constant, scene.settle.is_some()));
    notes.extend(overlap::points_within(&bodies, &states));
    warnings.extend(overlap::parting(&bodies, &states));
    warnings.extend(overlap::folded(&bodies, &states, own.as_ref()));
    let out = (header.units, common.name.as_str());
    let medium = ambient::placed(scene, (formats, control), (&bodies, &states, &of_gas), out, own.as_ref())?;
    if let Some(medium) = medium {
        if relative.is_some() {
            notes.push(ambient::within_orbit(&medium, &bodies, &states));
        }
        if scene.certify_at_once().is_some() && !scene.holds_its_medium() {
            notes.push("certify follows each body by itself, without the medium".to_owned());
        }
        bodies.push(medium.body);
        states.push(medium.state);
        reports.push(Some((medium.figures, String::new(), false)));
    }
    let (center, velocity) = assembly::center_of_mass(&bodies, &states);
    let mut frame = match own {
        Some(frame) => frame,
        None => assembly::frame(&bodies, &states, relative.map(|_| center), scene.output.box_factor),
    };
    let is_periodic = frame.periodic.contains(&true);
    let wanted = origin::wanted(scene, format, (is_periodic, !is_periodic));
    let place = (frame.lo, frame.edges, center);
    frame.origin = wanted.map(|wanted| origin::among_bodies(&wanted, place, &conversion)).transpose()?;
    let place = |x: &[f64; 3]| format!("{:?}", &x[..common.dimension]);
    notes.push(match frame.origin {
        None => format!("the origin of the scene is at {} in the box", place(&frame.lo.map(|v| 0.0 - v))),
        Some(point) => format!("the origin of the file is at {} in the scene (output.origin)", place(&point)),
    });
    if let Some((relative, contact)) =
        relative.zip(bodies.first().zip(bodies.get(1)).map(|(a, b)| a.surface + b.surface))
        && relative.pericenter < contact
    {
        notes.push(format!(
            "the bodies meet: as points they would pass each other at {:.6e}, and they touch at {contact:.6e}",
            relative.pericenter
        ));
    }
    let stop = worst(reports.iter().flatten().map(|r| r.0.stop));
    let mut figures = figures(&bodies, &states, reports);
    let particles = bodies.iter().map(Body::count).sum();
    let mass = bodies.iter().map(|b| b.mass).sum();
    let sums = (header.kernel.as_str(), header.kernel_neighbors);
    let origin = Origin {
        units: header.units,
        provenance: provenance(scene, &format!("{stop:?}"), sums),
        kernel: header.kernel,
        kernel_neighbors: header.kernel_neighbors,
    };
    let (mut file, more) = assembly::assemble(bodies, &states, &frame, origin)?;
    notes.extend(more);
    if scene.ambient.is_some() {
        let shown = ambient::sum_together(scene, &mut file)?;
        let of_medium = figures.last_mut().and_then(|medium| medium.figures.as_mut());
        of_medium.into_iter().for_each(|f| (f.mean_error, f.epsilon) = (shown.mean, shown.mean_square));
        warnings.extend(shown.doubt());
    }
    let orbit = relative.map(|r| OrbitFigures::new(&r));
    let settled = match scene.holds_its_medium() {
        true => settling::in_medium(scene, code.as_ref(), &mut file, control)?,
        false => settling::settle(scene, code.as_ref(), &mut file, control)?,
    };
    let stop = settled.as_ref().and_then(|s| s.stop).unwrap_or(stop);
    let closest_pair = settled.as_ref().and_then(|s| s.closest_pair);
    let settled_pair = closest_pair.zip(code.as_ref().map(|code| code.kernel.title()));
    let (settled, certificate) = settled.map_or((None, None), |s| {
        notes.extend(s.notes);
        (s.damped, s.free)
    });
    let mut report = BodiesReport {
        output: scene.output.file.as_ref().map_or_else(String::new, |f| f.display().to_string()),
        units: common.name,
        dimension: common.dimension,
        particles,
        mass,
        stop,
        center_of_mass: center,
        momentum: velocity.map(|v| v * mass),
        orbit,
        bodies: figures,
        settled,
        certificate,
        warnings,
        turning,
        settled_pair,
        verdict: Vec::new(),
        notes,
        seconds: start.elapsed().as_secs_f64(),
        peak_memory: memory::peak(),
    };
    report.judge();
    Ok((file, report))
}

/// Of a disc about others that of its fields: about its center it turns. Particles that hold each other are about their center of mass.
fn middle_of(input: &BodyInput, of_gas: &[(usize, Scene)], index: usize) -> Middle {
    let is_in_field = of_gas.iter().any(|(i, alone)| *i == index && !alone.gravity_of.is_empty());
    if is_in_field && input.input.disc().is_some() { Middle::OfBox } else { Middle::OfMass }
}

/// Of a periodic box's edge, along which its gas is all of it.
const FILLED: f64 = 0.9;

/// What is said of a body that fills a periodic box, of which it is one piece here.
fn of_a_box(title: &str, file: &ParticleFile) -> Option<String> {
    let header = &file.header;
    let gas = &file.species.iter().find(|s| s.part_type == 0)?.table;
    let places = gas.column(names::COORDINATES)?;
    let along = |k: usize| (0..gas.count).map(move |i| places.values.get(i * places.components + k));
    let is_filled = |&k: &usize| {
        let extent = along(k).fold(f64::NEG_INFINITY, f64::max) - along(k).fold(f64::INFINITY, f64::min);
        header.periodic[k] && extent > FILLED * header.box_size[k]
    };
    (0..header.dimension).find(is_filled).map(|k| {
        format!(
            "body {title} fills a periodic box of edge {:.4e} along {}, and is one piece of it here: its gas ends at the faces, beyond which nothing holds its \
             pressure",
            header.box_size[k],
            ["x", "y", "z"][k]
        )
    })
}

/// The share that each body has of the time that those before it leave: by particles, none of those that take no time. A medium about them is taken
/// to have as many as all bodies.
fn shares_of_time(counts: &[usize], has_medium: bool) -> Vec<f64> {
    let all: usize = counts.iter().sum();
    let mut left = if has_medium { 2 * all } else { all };
    let share = |count: &usize| {
        let share = *count as f64 / left.max(1) as f64;
        left -= count;
        share
    };
    counts.iter().map(share).collect()
}

/// What is known, and refused, before a body is placed.
fn before<'a>(scene: &Scene, formats: &'a [FormatSpec]) -> Result<(Shared, Option<&'a FormatSpec>)> {
    scene.validate()?;
    if scene.bodies.is_empty() {
        return Err(Error::scene("bodies", "are none; a scene without them is placed by itself"));
    }
    let all = shared(scene, formats)?;
    if let Some(medium) = &scene.ambient {
        // What is wrong with it is not to be found when the bodies are placed.
        ambient::refuse_plain(scene, all.common.has_units())?;
        all.medium(scene, medium, formats).map_err(ambient::of_medium)?;
    }
    let periodic = &periodic_axes(scene, all.common.dimension)[..all.common.dimension];
    let format = intended_format(scene, formats)?;
    origin::refuse(scene, format, periodic)?;
    ambient::refuse_masses(scene, format)?;
    Ok((all, format))
}

/// What [`run_bodies`] would do: all that it does before it places particles, with what the stages of each body will take.
///
/// # Errors
/// Those of [`run_bodies`] up to there.
pub fn forecast_bodies(scene: &Scene, formats: &[FormatSpec], control: &Control<'_>) -> Result<ForecastOfBodies> {
    let (shared, format) = before(scene, formats)?;
    settling::code_of(scene, format)?;
    let Shared { gas, scenes, .. } = &shared;
    let mut bodies: Vec<ForeseenBody> = Vec::new();
    for (i, &index) in gas.iter().enumerate() {
        let (name, alone) = (scene.bodies[index].title(index), &scenes[i]);
        let known = Known::of(scenes, i, scene.cache.as_deref(), formats)?;
        let forecast = match known {
            Known::Not => Some(pipeline::forecast(alone, formats, control).map_err(|e| in_body(&name, e))?),
            Known::As(_) | Known::Kept(_) => None,
        };
        let is_cached = matches!(known, Known::Kept(_));
        let same_as = if let Known::As(k) = known { Some(bodies[k].name.clone()) } else { None };
        bodies.push(ForeseenBody { name, same_as, is_cached, forecast });
    }
    let medium = scene.ambient.as_ref().map(|ambient| -> Result<ForeseenMedium> {
        let (alone, most) = shared.medium(scene, ambient, formats).map_err(ambient::of_medium)?;
        let forecast = most.map(|_| pipeline::forecast(&alone, formats, control).map_err(ambient::of_medium));
        Ok(ForeseenMedium { density: ambient.density.text(), most, forecast: forecast.transpose()? })
    });
    Ok(ForecastOfBodies { bodies, ambient: medium.transpose()?, notes: shared.notes })
}

/// Runs a scene of bodies from inputs to the output file.
///
/// # Errors
/// Any of [`Error`]; nothing is left half-written.
pub fn run_bodies(scene: &Scene, formats: &[FormatSpec], control: &Control<'_>) -> Result<BodiesReport> {
    run_bodies_as(scene, formats, control, "")
}

/// [`run_bodies`], with the command for a page of the run.
///
/// # Errors
/// Those of [`run_bodies`].
pub fn run_bodies_as(
    scene: &Scene,
    formats: &[FormatSpec],
    control: &Control<'_>,
    command: &str,
) -> Result<BodiesReport> {
    scene.validate()?;
    let start = Instant::now();
    let destination = Destination::new(scene, formats)?;
    destination.refuse_overwriting_inputs(scene)?;
    let (file, mut report) = place_bodies(scene, formats, control)?;
    let written =
        destination.write(scene, formats, (&file, &Drawing::default()), Physics::of(scene, report.units != "code"))?;
    if let Some(format) = destination.format {
        let is_told =
            |text: &String| report.bodies.iter().filter_map(|b| b.figures.as_ref()).any(|f| f.warnings.contains(text));
        let lost = lost(&file, &[], (format.name, format.capabilities.columns));
        report.warnings.extend(lost.into_iter().filter(|text| !is_told(text)).collect::<Vec<_>>());
    }
    report.judge();
    written.tell(&mut report.notes, &mut report.verdict);
    report.seconds = start.elapsed().as_secs_f64();
    report.peak_memory = memory::peak();
    report.write_page(scene, &file, command)?;
    Ok(report)
}

/// By what a body is found in the folder `cache`.
fn kept<'a>(alone: &Scene, cache: Option<&'a Path>, formats: &[FormatSpec]) -> Result<Option<(Recipe, &'a Path)>> {
    let Some(folder) = cache else { return Ok(None) };
    let format = match alone.output.file.as_deref() {
        Some(_) => intended_format(alone, formats)?.map_or("", |f| f.name),
        None => "",
    };
    Ok(Some((Recipe::new(alone, format)?, folder)))
}

/// What is there of a body before it is placed.
enum Known {
    /// It comes out the same as an earlier one.
    As(usize),
    Kept(Box<PlacedBody>),
    Not,
}

impl Known {
    /// Of one of the bodies that are placed.
    fn of(scenes: &[Scene], k: usize, cache: Option<&Path>, formats: &[FormatSpec]) -> Result<Self> {
        if let Some(earlier) = scenes[..k].iter().position(|other| *other == scenes[k]) {
            return Ok(Self::As(earlier));
        }
        let found = kept(&scenes[k], cache, formats)?.and_then(|(recipe, folder)| recipe.find(folder));
        Ok(found.map_or(Self::Not, |body| Self::Kept(Box::new(body))))
    }
}

/// A body as it was placed by itself.
#[derive(Clone)]
struct Placed {
    body: PlacedBody,
    is_cached: bool,
}

impl Placed {
    /// Anew; it is kept in the folder `cache`.
    fn new(alone: &Scene, cache: Option<&Path>, (formats, control): (&[FormatSpec], &Control<'_>)) -> Result<Self> {
        let (file, mut report) = pipeline::place(alone, formats, control)?;
        let figures = BodyFigures::new(&mut report);
        let body = PlacedBody { file, report: report.json(), figures };
        if let Some((recipe, folder)) = kept(alone, cache, formats)?.filter(|_| !report.stop.is_cut()) {
            recipe.keep(folder, &body)?;
        }
        Ok(Self { body, is_cached: false })
    }
}

impl Common {
    /// One particle mass to the last bit where the format has no place for more.
    fn equalize(&self, scene: &Scene, formats: &[FormatSpec], bodies: &mut [Body]) -> Result<Option<String>> {
        let format = scene.output.file.as_ref().map_or(Ok(None), |_| intended_format(scene, formats))?;
        if !format.is_some_and(|f| f.capabilities.equal_masses) {
            return Ok(None);
        }
        let mut gas: Vec<&mut Body> = bodies.iter_mut().filter(|b| b.is_gas()).collect();
        let uneven = gas.iter().map(|b| (b, b.range_of_first())).find(|(_, (least, most))| most - least > EVEN * most);
        if let Some((body, (least, most))) = uneven {
            let problem = format!(
                "has one mass for all particles, but those of body {} have {least:.6e} to {most:.6e}; state `particles` for it, which places it anew",
                body.title
            );
            return Err(Error::scene("output.format", problem));
        }
        let own: Vec<(f64, f64)> = gas.iter().map(|b| b.first()).map(|(n, mass)| (n as f64, mass)).collect();
        let total: f64 = own.iter().map(|(_, mass)| mass).sum();
        let particle = total / own.iter().map(|(n, _)| n).sum::<f64>();
        let change = own.iter().map(|(n, mass)| (particle * n / mass - 1.0).abs()).fold(0.0, f64::max);
        // More than rounding to whole particles makes.
        let most = own.iter().map(|(n, _)| 1.0 / n).fold(0.0, f64::max);
        if change > most {
            let problem = "has one mass for all particles; leave `particles` of the bodies to their masses";
            return Err(Error::scene("output.format", problem));
        }
        gas.iter_mut().for_each(|b| b.set_particle_mass(particle));
        Ok(Some(format!(
            "the format has one mass for all particles: the masses of bodies are rounded to whole particles, by {change:.1e} at most"
        )))
    }
}

/// Of a mass: rounding in single precision.
const EVEN: f64 = 1e-6;

/// Which of `d` axes the scene's own box is periodic along.
fn periodic_axes(scene: &Scene, d: usize) -> [bool; 3] {
    let stated = |k: usize| scene.domain.boundary.get(k).or(scene.domain.boundary.first());
    let is_box = scene.domain.bounds.is_some();
    sph::array(|k| is_box && k < d && stated(k) == Some(&BoundaryName::Periodic))
}

/// The scene's own box.
fn box_of(scene: &Scene, d: usize, conversion: &Conversion) -> Result<Option<Frame>> {
    let Some([lo, hi]) = &scene.domain.bounds else { return Ok(None) };
    let corner = |key: &str, q: &[Quantity]| match values(key, q, UnitDimension::LENGTH, conversion)? {
        v if v.len() == d => Ok(std::array::from_fn::<f64, 3, _>(|k| v.get(k).copied().unwrap_or(0.0))),
        v => Err(Error::scene("domain.box", format!("has a corner of {} coordinates, expected {d}", v.len()))),
    };
    let (lo, hi) = (corner("domain.box[0]", lo)?, corner("domain.box[1]", hi)?);
    if let Some(k) = (0..d).find(|&k| !(lo[k] < hi[k])) {
        return Err(Error::scene("domain.box", format!("runs from {} to {} on axis {k}", lo[k], hi[k])));
    }
    let (edges, periodic) = (sph::array(|k| hi[k] - lo[k]), periodic_axes(scene, d));
    Ok(Some(Frame { lo, edges, periodic, origin: None }))
}

/// What is said of the whole: that of the body that came off worst.
fn worst(stops: impl Iterator<Item = StopReason>) -> StopReason {
    let rank = |stop: &StopReason| match stop {
        StopReason::NotNeeded => 0,
        StopReason::ToleranceReached => 1,
        StopReason::Stagnated => 2,
        StopReason::IterationLimit => 3,
        StopReason::ToleranceMissed => 4,
        StopReason::TimeLimit => 5,
        StopReason::Interrupted => 6,
    };
    stops.max_by_key(rank).unwrap_or(StopReason::NotNeeded)
}

fn figures(bodies: &[Body], states: &[State], reports: Vec<Option<(BodyFigures, String, bool)>>) -> Vec<BodyReport> {
    let mut first = 1;
    let mut all = Vec::new();
    for ((body, state), report) in bodies.iter().zip(states).zip(reports) {
        let ids = [first, first + body.count() - 1];
        first += body.count();
        let (figures, report, cached) = match report {
            Some((figures, report, cached)) => (Some(figures), report, cached),
            None => (None, String::new(), false),
        };
        all.push(BodyReport {
            name: body.title.clone(),
            ids,
            mass: body.mass,
            particle_mass: {
                let (n, mass) = body.first();
                mass / n as f64
            },
            radius: body.radius,
            position: state.position,
            velocity: body.velocity(state),
            spin: state.spin,
            figures,
            report: serde_json::from_str(&report).unwrap_or_default(),
            cached,
        });
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_is_shared_by_particles_among_those_that_take_some() {
        let spent = |counts: &[usize], has_medium| {
            let mut left = 1.0;
            let spent = |share: f64| {
                let spent = share * left;
                left -= spent;
                spent
            };
            shares_of_time(counts, has_medium).into_iter().map(spent).collect::<Vec<f64>>()
        };
        assert_eq!(spent(&[100, 0, 300], false), [0.25, 0.0, 0.75]);
        assert_eq!(spent(&[100, 300], true), [0.125, 0.375]);
        assert_eq!(spent(&[0, 0], true), [0.0, 0.0]);
    }
}
