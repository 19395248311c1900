//! The medium around bodies (`ambient`): a separate scene in the box of the whole, with the bodies as obstacles; and the sums over neighbors of
//! all gas together, which extend across surfaces.

use super::assembly::{Body, Frame, Middle, State};
use super::bodies_report::BodyFigures;
use super::carving::{Obstacle, Obstacles};
use super::pipeline;
use crate::error::{Error, Result};
use crate::field::{FreeSpace, rotated};
use crate::metrics::Measured;
use crate::relaxation::Control;
use crate::scene::{BoundaryName, MatchName, Scene};
use crate::target::{Positions, at};
use sph::domain::{Axis, Domain, Region};
use sph_formats::common::particle_names as names;
use sph_formats::{FormatSpec, ParticleFile, ParticleTable, UnitSystem, Values};

/// What it is called among bodies.
pub(super) const TITLE: &str = "ambient";

/// The placed medium.
pub(super) struct Medium {
    pub body: Body,
    pub state: State,
    pub figures: BodyFigures,
}

/// Places the medium of a scene, if it has one, about `bodies` in their `states`; `alone` are the bodies of gas as scenes, with their index.
///
/// # Errors
/// Those of placing it.
pub(super) fn placed(
    scene: &Scene,
    (formats, control): (&[FormatSpec], &Control<'_>),
    (bodies, states, alone): (&[Body], &[State], &[(usize, Scene)]),
    (units, name): (UnitSystem, &str),
    frame: Option<&Frame>,
) -> Result<Option<Medium>> {
    let Some((ambient, frame)) = scene.ambient.as_ref().zip(frame) else { return Ok(None) };
    let dimension = scene.domain.bounds.as_ref().map_or(3, |b| b[0].len());
    let obstacles = obstacles(scene, (bodies, states, alone), units, ambient.matching);
    let mut medium = scene.of_ambient(ambient, dimension, None);
    (medium.output.units, medium.output.target_density) = (Some(name.to_owned()), true);
    let (file, mut report) = pipeline::place_around(&medium, formats, control, &obstacles).map_err(of_medium)?;
    let mut body = Body::new(TITLE.to_owned(), file, Middle::OfMass)?;
    if ambient.matching == MatchName::Mass {
        // To the bit as those of the bodies: within half a particle in all.
        body.set_particle_mass(obstacles.particle_mass);
    }
    let corner = corner(scene, frame, dimension);
    let state = State { position: sph::array(|k| body.center[k] + corner[k]), ..State::default() };
    let mut figures = BodyFigures::new(&mut report);
    // By itself it has holes; these are found over all gas.
    (figures.misplaced, figures.warnings) = (None, Vec::new());
    Ok(Some(Medium { body, state, figures }))
}

/// Refuses a medium of numbers whose units nobody knows.
///
/// # Errors
/// What to state.
pub(super) fn refuse_plain(scene: &Scene, has_units: bool) -> Result<()> {
    match has_units && scene.units.is_none() {
        true => {
            let problem = "is read in the scene's `units`, and there are none, beside bodies that have some; state them, as in `units: solar`";
            Err(Error::scene("ambient", problem))
        }
        false => Ok(()),
    }
}

/// Refuses a medium whose particles have a mass of their own where the format holds one for all.
///
/// # Errors
/// What to state.
pub(super) fn refuse_masses(scene: &Scene, format: Option<&FormatSpec>) -> Result<()> {
    let has_its_own = scene.ambient.as_ref().is_some_and(|a| a.matching == MatchName::Spacing);
    match has_its_own && format.is_some_and(|f| f.capabilities.equal_masses) {
        true => {
            let problem = "is spacing, by which the medium's particles have a mass of their own, and the format holds one for all; take mass";
            Err(Error::scene("ambient.match", problem))
        }
        false => Ok(()),
    }
}

/// An error of the medium as a scene by itself, with the key that it has in the scene of all.
pub(super) fn of_medium(error: Error) -> Error {
    match error {
        Error::Scene { key, problem } if key == "input.expression" => Error::scene("ambient.density", problem),
        Error::Scene { key, problem } if key.starts_with("fields") => Error::scene(format!("ambient.{key}"), problem),
        other => other,
    }
}

/// The lower corner of the medium's own box: that of all, but for axes with vacuum beyond, along which it is as long as the longest.
fn corner(scene: &Scene, frame: &Frame, d: usize) -> [f64; 3] {
    let boundary = |k: usize| scene.domain.boundary.get(k).or(scene.domain.boundary.first());
    let is_open = |k: usize| boundary(k).is_none_or(|b| *b == BoundaryName::Open);
    let longest = frame.edges[..d].iter().copied().fold(0.0, f64::max);
    sph::array(|k| match k < d && is_open(k) {
        true => frame.lo[k] - 0.5 * (longest - frame.edges[k]),
        false => frame.lo[k],
    })
}

/// What there is to note of a medium about bodies on an orbit, which is that of the bodies alone.
pub(super) fn within_orbit(medium: &Medium, bodies: &[Body], states: &[State]) -> String {
    let from_center = |x: &[f64; 3]| x.iter().map(|c| c * c).sum::<f64>().sqrt();
    let reach = states.iter().map(|s| from_center(&s.position)).fold(0.0, f64::max);
    let places = medium.body.gas_spacings(&medium.state, names::TARGET_DENSITY);
    let within = places.iter().zip(medium.body.masses()).filter(|((x, _), _)| from_center(x) < reach);
    let share = within.map(|(_, m)| m).sum::<f64>() / bodies.iter().map(|b| b.mass).sum::<f64>();
    format!(
        "the orbit is computed for the bodies alone: the medium within its radius has {share:.1e} of their mass, and \
         its drag and gravity are neglected"
    )
}

fn obstacles(
    scene: &Scene,
    (bodies, states, alone): (&[Body], &[State], &[(usize, Scene)]),
    units: UnitSystem,
    matching: MatchName,
) -> Obstacles {
    let gas: Vec<usize> = (0..bodies.len()).filter(|&i| bodies[i].is_gas()).collect();
    let particles = gas.iter().flat_map(|&i| bodies[i].gas_spacings(&states[i], names::TARGET_DENSITY)).collect();
    let sums = gas.iter().map(|&i| bodies[i].first()).fold((0.0, 0.0), |s, (n, m)| (s.0 + n as f64, s.1 + m));
    let of_gas = alone.iter().filter(|(i, _)| bodies[*i].is_gas());
    let body = |(i, own): &(usize, Scene)| {
        let degrees = match scene.bodies[*i].orientation.as_slice() {
            [angle] => [0.0, 0.0, *angle],
            [x, y, z] => [*x, *y, *z],
            _ => [0.0; 3],
        };
        let unit = |k: usize| sph::array(|c| f64::from(u8::from(c == k)));
        Obstacle {
            title: bodies[*i].title.clone(),
            count: bodies[*i].first().0,
            scene: own.clone(),
            center: bodies[*i].center,
            position: states[*i].position,
            turn: sph::array(|k| rotated(&degrees, &unit(k))),
        }
    };
    let (mean, first) = (sums.1 / sums.0, gas.first().and_then(|&i| bodies[i].masses().next()));
    // Where all have one, it is that to the bit.
    let particle_mass = first.filter(|m| (m / mean - 1.0).abs() < 1e-12).unwrap_or(mean);
    Obstacles { particles, bodies: of_gas.map(body).collect(), particle_mass, matching, units }
}

/// The error of the density of a medium.
#[derive(Default)]
pub(super) struct Shown {
    pub mean: f64,
    pub mean_square: f64,
    /// The particles that it is of: where no kernel reaches into a body, if there are any such.
    apart: usize,
    all: usize,
}

impl Shown {
    /// That none of its particles shows its density, if so.
    pub fn doubt(&self) -> Option<String> {
        (self.apart == 0 && self.all > 0).then(|| {
            format!(
                "the kernels of all {} particles of the medium reach into a body, by which their densities are {:.0} % off on average: so few do not show a \
                 medium; use ambient.match: spacing, or more particles",
                self.all,
                100.0 * self.mean
            )
        })
    }
}

/// Sums densities and support radii over all gas of a `file` together. Returns the error of the density over the last body, which is the medium.
///
/// # Errors
/// A box that is none.
pub(super) fn sum_together(scene: &Scene, file: &mut ParticleFile) -> Result<Shown> {
    let found = match file.header.dimension {
        1 => summed::<1>(scene, file),
        2 => summed::<2>(scene, file),
        _ => summed::<3>(scene, file),
    };
    if !scene.output.target_density {
        file.species.iter_mut().for_each(|s| s.table.columns.retain(|c| c.name != names::TARGET_DENSITY));
    }
    found
}

fn summed<const D: usize>(scene: &Scene, file: &mut ParticleFile) -> Result<Shown> {
    let header = &file.header;
    let Some(table) = file.species.iter_mut().find(|s| s.part_type == 0).map(|s| &mut s.table) else {
        return Ok(Shown::default());
    };
    let numbers = |table: &ParticleTable, name: &str| table.column(name).map_or(Vec::new(), |c| c.values.to_f64());
    let (x, masses, guess) =
        (numbers(table, names::COORDINATES), numbers(table, names::MASSES), numbers(table, names::SUPPORT_RADIUS));
    // In units of the box and of all mass: sums are in single precision.
    let size = header.box_size[..D].iter().copied().fold(0.0, f64::max);
    let total: f64 = masses.iter().sum();
    let corner = header.box_corner.unwrap_or_default();
    let lo: [f64; D] = sph::array(|k| corner[k] / size);
    let hi = sph::array(|k| (corner[k] + header.box_size[k]) / size);
    let walls = scene.walls_of_medium(D);
    let axes = std::array::from_fn(|k| match (header.periodic[k], walls[k]) {
        (true, _) => Axis::Periodic,
        (false, true) => Axis::REFLECTING,
        (false, false) => Axis::OPEN,
    });
    let domain = Domain::new(lo, hi, axes, Region::Box)?;
    let positions: Positions<D> = std::array::from_fn(|k| x.iter().skip(k).step_by(D).map(|v| v / size).collect());
    let shares: Vec<f64> = masses.iter().map(|m| m / total).collect();
    let guess: Vec<f64> = guess.iter().map(|h| h / size).collect();
    let measured = Measured::new(scene.kernel(), &domain, &positions, &shares, &guess, scene.kernel_neighbors(D));
    let unit = total / size.powi(D as i32);
    let density: Vec<f64> = measured.sums.iter().map(|s| s.weighted * unit).collect();
    let wanted = numbers(table, names::TARGET_DENSITY);
    let bodies = numbers(table, super::assembly::BODY_ID);
    let last = bodies.iter().copied().fold(0.0, f64::max);
    let place = |i: usize| at(&positions, i);
    let others: Vec<[f64; D]> = (0..density.len()).filter(|&i| bodies.get(i) != Some(&last)).map(place).collect();
    let (nothing, free) = (|_: &[f64; D]| 0.0, |_: &[f64; D], _: usize| false);
    let beside = FreeSpace::new((&others, vec![None; others.len()]), &domain, &nothing, &free)?;
    // Where kernels reach into a body, sums are of both.
    let is_apart = |i: usize| beside.distance(&place(i)) > measured.support[i];
    let of_medium = |i: &usize| bodies.get(*i) == Some(&last) && wanted.get(*i).is_some_and(|w| *w > 0.0);
    let all: Vec<usize> = (0..density.len()).filter(of_medium).collect();
    let apart: Vec<usize> = all.iter().copied().filter(|&i| is_apart(i)).collect();
    let seen = if apart.is_empty() { &all } else { &apart };
    let mean = |of: &dyn Fn(f64) -> f64| {
        seen.iter().map(|&i| of((density[i] / wanted[i] - 1.0).abs())).sum::<f64>() / seen.len().max(1) as f64
    };
    let found = Shown { mean: mean(&|e| e), mean_square: mean(&|e| e * e), apart: apart.len(), all: all.len() };
    for column in &mut table.columns {
        match column.name.as_str() {
            names::DENSITY => column.values = Values::F64(density.clone()),
            names::SUPPORT_RADIUS => {
                column.values = Values::F64(measured.support.iter().map(|h| h * size).collect());
            }
            _ => {}
        }
    }
    Ok(found)
}
