//! Evolves particles in time as a simulation code would, to find whether they stay at rest.
//!
//! A scene's body is followed as it was placed ([`certify`]), the particles of a file as they are there ([`follow`]); the
//! motion itself is in [`super::followed`].

use super::control::{Control, Event};
use super::followed::{Body, End, Followed, Point, Totals};
use super::outside::Field;
use super::report::{StageName, StopReason};
use crate::target::{Materials, Positions, Target, at};
use serde::Serialize;
use sph::domain::{Axis, Domain, Region, Wall};
use sph::geometry::distance;
use sph::kernel::KernelName;
use sph::point_mass::PointMass;
use sph::reduce;
use sph::sums::support_guess;

pub const NAME: StageName = StageName { name: "certificate", title: "certificate" };
pub const SETTLING: StageName = StageName { name: "settling", title: "settling" };

/// Steps of a body that is certified, at most: a giant with its core takes more, and is followed as far as they go.
const MOST_STEPS: usize = 5000;
/// Rows of the table per unit of time.
const ROWS: f64 = 10.0;
/// Radius of space in the body's own.
const SPACE: f64 = 8.0;
/// Share of the time after which the mean is taken: what starts has time to move.
const BEGUN: f64 = 1.0 / 3.0;
/// What starts at rest takes about so long until it moves; what was ended earlier tells nothing.
const KNOWN: f64 = 0.5;
/// Kinetic over potential energy of a body that is quiet, and of one that settles.
const QUIET: f64 = 1e-5;
const SETTLES: f64 = 1e-3;

/// The particles at one time. Energies are over |W|, without gravity over the internal energy at the start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct State {
    /// In dynamical times sqrt(R^3/(G M)); without gravity in those in which sound crosses the domain.
    pub time: f64,
    /// Kinetic energy, but for the rotation that the particles started with.
    pub kinetic: f64,
    /// (2 K + d int P dV)/|W| - 1 in three dimensions; 0 in equilibrium, and without gravity.
    pub virial: f64,
    /// Root mean square over the particles of the change of their densities since the start.
    pub density_change: f64,
    /// Mean density of the innermost 2 %, and radius of half the mass, over those at the start.
    pub central_density: f64,
    pub half_mass_radius: f64,
    /// Change of the total energy.
    pub energy: f64,
    /// Change of the angular momentum over M R v, v^2 = |W|/M.
    pub angular_momentum: f64,
}

/// What became of the particles, in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CertificateVerdict {
    /// They stay where they are.
    Quiet,
    Settles,
    Moves,
    /// They moved from the start on.
    Flows,
    /// They were hardly followed.
    Unknown,
}

impl CertificateVerdict {
    /// As reports write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quiet => "quiet",
            Self::Settles => "settles",
            Self::Moves => "moves",
            Self::Flows => "flows",
            Self::Unknown => "unknown",
        }
    }
}

/// What became of the particles.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Certificate {
    pub states: Vec<State>,
    pub steps: usize,
    pub seconds: f64,
    /// Whether its own gravity acts on it.
    pub has_gravity: bool,
    /// Mean of the kinetic energy after a third of the time.
    pub kinetic: f64,
    /// Largest changes of central density and half-mass radius.
    pub central_density_drift: f64,
    pub half_mass_radius_drift: f64,
    /// Whether it was followed to its end.
    pub is_whole: bool,
    /// What ended it from outside, if anything did: a deadline does so before the step that would pass it.
    #[serde(skip)]
    pub cut: Option<StopReason>,
}

impl Certificate {
    fn new(
        states: Vec<State>,
        steps: usize,
        seconds: f64,
        (has_gravity, is_whole): (bool, bool),
        cut: Option<StopReason>,
    ) -> Self {
        let end = states.last().map_or(0.0, |s| s.time);
        let late: Vec<f64> = states.iter().filter(|s| s.time >= BEGUN * end).map(|s| s.kinetic).collect();
        let drift = |f: fn(&State) -> f64| states.iter().map(|s| (f(s) - 1.0).abs()).fold(0.0, f64::max);
        Self {
            kinetic: late.iter().sum::<f64>() / late.len().max(1) as f64,
            central_density_drift: drift(|s| s.central_density),
            half_mass_radius_drift: drift(|s| s.half_mass_radius),
            states,
            steps,
            seconds,
            has_gravity,
            is_whole,
            cut,
        }
    }

    /// In one word.
    pub fn verdict(&self) -> CertificateVerdict {
        match self.kinetic {
            _ if !self.is_whole && self.end() < KNOWN => CertificateVerdict::Unknown,
            _ if self.states.first().is_some_and(|s| s.kinetic >= SETTLES) => CertificateVerdict::Flows,
            k if k < QUIET => CertificateVerdict::Quiet,
            k if k < SETTLES => CertificateVerdict::Settles,
            _ => CertificateVerdict::Moves,
        }
    }

    /// The time up to which they were followed.
    fn end(&self) -> f64 {
        self.states.last().map_or(0.0, |s| s.time)
    }

    /// What energies are compared with, and times.
    pub fn units(&self) -> [&'static str; 2] {
        if self.has_gravity { ["|W|", "dynamical times"] } else { ["the internal energy", "crossing times"] }
    }

    /// In two or three lines.
    pub fn summary(&self) -> Vec<String> {
        let end = self.end();
        let largest = |f: fn(&State) -> f64| self.states.iter().map(|s| f(s).abs()).fold(0.0, f64::max);
        let [unit, times] = self.units();
        let (verdict, kinetic, steps) = (self.verdict().name(), self.kinetic, self.steps);
        let energy = largest(|s| s.energy);
        let mut lines = vec![format!(
            "{verdict}: kinetic energy {kinetic:.1e} of {unit} on average up to {end:.1} {times} ({steps} steps)"
        )];
        lines.push(if self.has_gravity {
            format!(
                "central density changes by {:.2} %, half-mass radius by {:.2} %, energy by {energy:.0e} of {unit}",
                100.0 * self.central_density_drift,
                100.0 * self.half_mass_radius_drift
            )
        } else {
            let change = 100.0 * largest(|s| s.density_change);
            format!("densities change by {change:.2} % (root mean square), energy by {energy:.0e} of {unit}")
        });
        if !self.is_whole {
            lines.push("it stopped early: by the time limit, an interrupt, or the limit on the number of steps".into());
        }
        lines
    }
}

/// The equation of state of what is certified, and what holds it.
#[derive(Debug, Clone, Copy)]
pub struct Matter<'a, const D: usize> {
    pub gamma: f64,
    /// Materials, and which each particle is of, in place of an ideal gas.
    pub materials: Option<(&'a Materials, &'a [usize])>,
    pub held_by: HeldBy<'a, D>,
}

/// What holds the gas.
#[derive(Debug, Clone, Copy)]
pub enum HeldBy<'a, const D: usize> {
    /// Its own gravity, and that of a point mass that stays in the center.
    Own { center: [f64; D], point: Option<PointMass<D>> },
    /// A field, the walls of the target's domain, or both.
    Field(Field<'a, D>),
}

/// Follows the particles of a target with these velocities and specific internal energies (in units of G M/R^(d-2)) for `duration` dynamical
/// times, or until `control` ends it.
pub fn certify<const D: usize>(
    (kernel, kernel_neighbors): (KernelName, f64),
    target: Target<'_, D>,
    (positions, velocities, internal_energy): (&Positions<D>, Vec<[f64; D]>, Vec<f64>),
    matter: &Matter<'_, D>,
    duration: f64,
    control: &Control<'_>,
) -> Certificate {
    let Matter { gamma, materials, held_by } = *matter;
    let n = internal_energy.len();
    let (domain, center, point, field) = match held_by {
        HeldBy::Own { center, point } => {
            let radius = reduce::max(n, |i| distance(&at(positions, i), &center));
            (space(center, radius), Some(center), point, None)
        }
        HeldBy::Field(field) => (opened(target.domain), None, None, Some(field)),
    };
    let wanted = target.number_densities(positions);
    let largest = target.domain.size();
    let start = Followed {
        domain: domain.unwrap_or_else(|| target.domain.clone()),
        positions: positions.clone(),
        velocities,
        masses: target.masses(positions),
        internal_energy,
        support: support_guess::<D>(kernel_neighbors, n, |i| target.spacing(wanted[i]).min(largest)),
        gamma,
        materials,
        center,
        field,
        points: point.map(|mass| Point { mass, velocity: None }).into_iter().collect(),
        bodies: Vec::new(),
        damping: None,
    };
    drive(Body::new((kernel, kernel_neighbors), start), (duration, MOST_STEPS), control).0
}

/// Empty space about a body.
pub fn space<const D: usize>(center: [f64; D], radius: f64) -> Option<Domain<D>> {
    Domain::ball(center, SPACE * radius, Wall::Open).ok()
}

/// The same domain with empty space beyond what of it is open; `None` for walls that are neither flat nor a ball's.
pub fn opened<const D: usize>(domain: &Domain<D>) -> Option<Domain<D>> {
    match domain.region {
        Region::Ball { center, inner_radius: 0.0, radius, wall: Wall::Open } => space(center, radius),
        Region::Ball { inner_radius: 0.0, wall: Wall::Reflecting, .. } => Some(domain.clone()),
        Region::Box | Region::Hull(_, Wall::Open) => {
            let margin = |k: usize, side: usize| match domain.axes[k] {
                Axis::Walls { lo, hi } if [lo, hi][side] == Wall::Open => SPACE * domain.size(),
                _ => 0.0,
            };
            let lo = sph::array(|k| domain.lo[k] - margin(k, 0));
            let hi = sph::array(|k| domain.hi[k] + margin(k, 1));
            Domain::new(lo, hi, domain.axes, Region::Box).ok()
        }
        _ => None,
    }
}

/// Follows particles for `duration` dynamical times (crossing times of sound where there is no gravity), or until `control` ends
/// it.
pub fn follow<const D: usize>(
    sums: (KernelName, f64),
    start: Followed<'_, D>,
    duration: f64,
    control: &Control<'_>,
) -> Certificate {
    drive(Body::new(sums, start), (duration, usize::MAX), control).0
}

/// [`follow`] with the particles as they are in the end, at rest but for the rotation of the whole.
pub fn settle<const D: usize>(
    sums: (KernelName, f64),
    start: Followed<'_, D>,
    duration: f64,
    control: &Control<'_>,
) -> (Certificate, End<D>) {
    let (certificate, mut body) = drive(Body::new(sums, start), (duration, usize::MAX), control);
    body.damp(0.0);
    (certificate, body.into_end())
}

/// What is wrong with so few particles, if anything: where all are neighbors of all, no sum tells a density.
pub fn too_few(count: usize, kernel_neighbors: f64) -> Option<String> {
    let few = count as f64 <= kernel_neighbors;
    few.then(|| format!("follows more particles than each has neighbors: {count} of {kernel_neighbors:.0}"))
}

fn drive<'a, const D: usize>(
    mut body: Body<'a, D>,
    (duration, most_steps): (f64, usize),
    control: &Control<'_>,
) -> (Certificate, Body<'a, D>) {
    let begin = std::time::Instant::now();
    let mut states: Vec<State> = Vec::new();
    let rows = (duration * ROWS).ceil() as usize;
    let first = body.totals();
    let stage = if body.is_damped() { SETTLING } else { NAME };
    let mut steps = 0;
    let mut step = std::time::Duration::ZERO;
    let (mut is_whole, mut cut) = (true, None);
    states.push(first.against(&first, &body));
    'rows: for row in 1..=rows {
        let end = duration * row as f64 / rows as f64 * body.unit_time;
        while body.time < end {
            cut = control.stop_reason_within(step);
            if cut.is_some() || steps == most_steps {
                is_whole = false;
                break 'rows;
            }
            let now = std::time::Instant::now();
            body.advance(end - body.time);
            step = now.elapsed();
            steps += 1;
        }
        let now = body.totals();
        states.push(now.against(&first, &body));
        control.tell(Event::Iteration { stage, iteration: row, last: rows, epsilon: states[row].kinetic });
    }
    let seconds = begin.elapsed().as_secs_f64();
    (Certificate::new(states, steps, seconds, (body.has_gravity(), is_whole), cut), body)
}

impl Totals {
    fn against<const D: usize>(&self, first: &Self, body: &Body<'_, D>) -> State {
        let unit = if body.has_gravity() { self.potential.abs() } else { first.internal };
        let energy = |t: &Self| t.kinetic + t.internal + t.potential;
        let turned: f64 = (0..3).map(|k| (self.angular_momentum[k] - first.angular_momentum[k]).powi(2)).sum();
        let virial = (2.0 * self.kinetic + D as f64 * self.pressure + self.softened) / unit - 1.0;
        State {
            time: body.time / body.unit_time,
            kinetic: self.disordered / unit,
            virial: if body.has_gravity() { virial } else { 0.0 },
            density_change: self.density_change,
            central_density: self.central_density / first.central_density,
            half_mass_radius: self.half_mass_radius / first.half_mass_radius,
            energy: (energy(self) - energy(first)) / unit,
            angular_momentum: turned.sqrt() / (body.radius * (unit * body.total_mass).sqrt()),
        }
    }
}
