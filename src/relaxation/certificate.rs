//! A body followed forward in time, as a simulation code would: does it stay still?
//!
//! The equations are those of [`super::balance`]: density-entropy SPH with grad-h terms, each particle keeping its A_i or its
//! material's adiabat, and what the particles attract each other with. They are integrated by kick, drift, kick with one time step for all and without
//! viscosity, so that total energy is conserved, and what moves is not damped. Of gravity, the part that follows from the
//! enclosed mass and of a point mass in the center is taken at every step; what is left, which changes little, from the tree every few steps.

use super::arrangement::{Arrangement, SORT_INTERVAL};
use super::control::{Control, Event};
use super::report::StageName;
use super::states::{Law, States};
use crate::target::{MaterialState, Materials, Positions, Target, at};
use serde::Serialize;
use sph::domain::{Domain, Wall};
use sph::geometry::distance;
use sph::gravity::{OPENING_ANGLE, Pull, gravity, softening_radius, strength};
use sph::kernel::KernelName;
use sph::point_mass::PointMass;
use sph::sums::DensitySums;
use sph::{parallel, reduce};

pub const NAME: StageName = StageName { name: "certificate", title: "certificate" };

/// Time step over the time in which sound crosses a support radius; about a fifth of a smoothing length.
const COURANT: f64 = 0.11;
/// Largest time step in dynamical times.
const LARGEST_STEP: f64 = 0.02;
/// Steps at most: a giant with its core takes more, and is followed as far as they go.
const MOST_STEPS: usize = 5000;
/// Rows of the table per dynamical time.
const ROWS: f64 = 10.0;
/// Steps for which the tree's part of gravity is held.
const HELD: usize = 10;
/// Radius of space in the body's own.
const SPACE: f64 = 8.0;
/// Share of the mass whose mean density counts as central.
const CENTRAL: f64 = 0.02;
/// Share of the time after which the mean is taken: what starts has time to move.
const BEGUN: f64 = 1.0 / 3.0;
/// Kinetic over potential energy of a body that is quiet, and of one that settles.
const QUIET: f64 = 1e-5;
const SETTLES: f64 = 1e-3;

/// The body at one time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct State {
    /// In dynamical times sqrt(R^3/(G M)).
    pub time: f64,
    /// Kinetic energy over |W|.
    pub kinetic: f64,
    /// (2 K + d int P dV)/|W| - 1 in three dimensions; 0 in equilibrium.
    pub virial: f64,
    /// Mean density of the innermost 2 %, and radius of half the mass, over those at the start.
    pub central_density: f64,
    pub half_mass_radius: f64,
    /// Change of the total energy over |W|.
    pub energy: f64,
    /// Change of the angular momentum over M R v, v^2 = |W|/M.
    pub angular_momentum: f64,
}

/// What became of the body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Certificate {
    pub states: Vec<State>,
    pub steps: usize,
    pub seconds: f64,
    /// Mean of the kinetic energy over |W| after a third of the time.
    pub kinetic: f64,
    /// Largest changes of central density and half-mass radius.
    pub central_density_drift: f64,
    pub half_mass_radius_drift: f64,
    /// Whether it was followed to its end.
    pub is_whole: bool,
}

impl Certificate {
    fn new(states: Vec<State>, steps: usize, seconds: f64, is_whole: bool) -> Self {
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
            is_whole,
        }
    }

    /// In one word.
    pub fn verdict(&self) -> &'static str {
        match self.kinetic {
            k if k < QUIET => "quiet",
            k if k < SETTLES => "settles",
            _ => "moves",
        }
    }
}

/// The equation of state of a body, and its center.
#[derive(Debug, Clone, Copy)]
pub struct Matter<'a, const D: usize> {
    pub gamma: f64,
    /// Materials, and which each particle is of, in place of an ideal gas.
    pub materials: Option<(&'a Materials, &'a [usize])>,
    pub center: [f64; D],
    /// A point mass that stays in the center.
    pub point: Option<PointMass<D>>,
}

/// Follows particles of equal mass with these specific internal energies (in units of G M/R^(d-2)) for `duration` dynamical
/// times, or until `control` ends it.
pub fn certify<const D: usize>(
    (kernel, kernel_neighbors): (KernelName, f64),
    target: Target<'_, D>,
    (positions, internal_energy): (&Positions<D>, &[f64]),
    matter: &Matter<'_, D>,
    duration: f64,
    control: &Control<'_>,
) -> Certificate {
    let start = std::time::Instant::now();
    let mut body = Body::new((kernel, kernel_neighbors), target, positions, internal_energy, matter);
    let mut states: Vec<State> = Vec::new();
    let rows = (duration * ROWS).ceil().max(1.0) as usize;
    let first = body.totals();
    let mut steps = 0;
    let mut is_whole = true;
    states.push(first.against(&first, &body));
    'rows: for row in 1..=rows {
        let end = duration * row as f64 / rows as f64 * body.dynamical_time;
        while body.time < end {
            if control.stop_reason().is_some() || steps == MOST_STEPS {
                is_whole = false;
                break 'rows;
            }
            body.advance(end - body.time);
            steps += 1;
        }
        let now = body.totals();
        states.push(now.against(&first, &body));
        control.tell(Event::Iteration { stage: NAME, iteration: row, last: rows, epsilon: states[row].kinetic });
    }
    Certificate::new(states, steps, start.elapsed().as_secs_f64(), is_whole)
}

/// The particles under way.
struct Body<'a, const D: usize> {
    arrangement: Arrangement<'a, D, f32>,
    mass: f64,
    law: Law<'a>,
    center: [f64; D],
    point: Option<PointMass<D>>,
    radius: f64,
    dynamical_time: f64,
    time: f64,
    velocities: Vec<[f64; D]>,
    states: States,
    support: Vec<f64>,
    sums: Vec<DensitySums<D>>,
    accelerations: Vec<[f64; D]>,
    /// What the tree adds to the gravity of the enclosed mass, and the steps since.
    beyond: Vec<[f64; D]>,
    held: usize,
}

/// Sums over the body.
#[derive(Debug, Clone, Copy)]
struct Totals {
    kinetic: f64,
    internal: f64,
    /// Integral of the pressure over the volume.
    pressure: f64,
    potential: f64,
    /// Sum of m x g over what the point mass in the center attracts, less its potential: 0 but for the softening.
    softened: f64,
    central_density: f64,
    half_mass_radius: f64,
    angular_momentum: [f64; 3],
}

impl Totals {
    fn against<const D: usize>(&self, first: &Self, body: &Body<'_, D>) -> State {
        let unit = self.potential.abs();
        let energy = |t: &Self| t.kinetic + t.internal + t.potential;
        let turned: f64 = (0..3).map(|k| (self.angular_momentum[k] - first.angular_momentum[k]).powi(2)).sum();
        let total = body.mass * body.velocities.len() as f64;
        State {
            time: body.time / body.dynamical_time,
            kinetic: self.kinetic / unit,
            virial: (2.0 * self.kinetic + D as f64 * self.pressure + self.softened) / unit - 1.0,
            central_density: self.central_density / first.central_density,
            half_mass_radius: self.half_mass_radius / first.half_mass_radius,
            energy: (energy(self) - energy(first)) / unit,
            angular_momentum: turned.sqrt() / (body.radius * (unit * total).sqrt()),
        }
    }
}

impl<'a, const D: usize> Body<'a, D> {
    fn new(
        (kernel, kernel_neighbors): (KernelName, f64),
        target: Target<'a, D>,
        positions: &Positions<D>,
        internal_energy: &[f64],
        matter: &Matter<'a, D>,
    ) -> Self {
        let Matter { gamma, materials, center, point } = *matter;
        let n = internal_energy.len();
        let radius = reduce::max(n, |i| distance(&at(positions, i), &center));
        let space = Domain::ball(center, SPACE * radius, Wall::Open).unwrap_or_else(|_| target.domain.clone());
        let (mut arrangement, order) =
            Arrangement::<D, f32>::with_order(kernel, target, space, positions.clone(), kernel_neighbors);
        arrangement.leaves_target = true;
        let size = target.domain.size();
        let support = arrangement.target_supports().into_iter().map(|h| h.min(arrangement.ratio() * size)).collect();
        let mass = target.mass / n as f64;
        let mut body = Self {
            arrangement,
            mass,
            law: Law { gamma, materials: materials.map(|(m, _)| m) },
            center,
            point,
            radius,
            dynamical_time: (radius.powi(D as i32) / (strength(D) * (target.mass + point.map_or(0.0, |p| p.mass))))
                .sqrt(),
            time: 0.0,
            velocities: vec![[0.0; D]; n],
            states: States::Gas(Vec::new()),
            support,
            sums: Vec::new(),
            accelerations: Vec::new(),
            beyond: vec![[0.0; D]; n],
            held: HELD,
        };
        body.sum();
        let energy = parallel::reordered(internal_energy, &order);
        let density = parallel::map(n, |i| mass * body.sums[i].number_density);
        body.states = match materials {
            None => States::Gas(parallel::map(n, |i| energy[i] * (gamma - 1.0) * density[i].powf(1.0 - gamma))),
            Some((_, kinds)) => {
                let state =
                    |i: usize| MaterialState { kind: kinds[order[i] as usize], density: density[i], energy: energy[i] };
                States::of_materials(&parallel::map(n, state))
            }
        };
        body.accelerate();
        body
    }

    /// Densities at the present places.
    fn sum(&mut self) {
        let solved = self.arrangement.solve(&self.support);
        self.support = parallel::map(solved.len(), |i| solved[i].support);
        self.sums = parallel::map(solved.len(), |i| solved[i].sums);
    }

    fn accelerate(&mut self) {
        let mass = self.mass;
        let strength = parallel::map(self.sums.len(), |i| {
            let s = &self.sums[i];
            let grad_h = 1.0 + s.slope / (D as f64 * s.number_density);
            self.law.pressure(&self.states, i, mass * s.number_density) / (s.number_density.powi(2) * grad_h)
        });
        let force = self.arrangement.gradient(&self.support, &strength, &self.sums);
        let enclosed = self.enclosed_gravity();
        if self.held >= HELD {
            self.hold(&enclosed);
        }
        self.held += 1;
        let (beyond, enclosed) = (&self.beyond, &enclosed);
        self.accelerations = parallel::map(force.len(), |i| {
            let point = self.point_pull(i);
            std::array::from_fn(|k| -force[i][k] / mass + enclosed[i][k] + beyond[i][k] + point.acceleration[k])
        });
    }

    /// The attraction of all that is nearer to the center, and of half of each particle itself.
    fn enclosed_gravity(&self) -> Vec<[f64; D]> {
        let fraction = super::thermal::enclosed_fractions(&self.arrangement.positions, &self.center);
        let total = self.mass * fraction.len() as f64;
        parallel::map(fraction.len(), |i| {
            let x = at(&self.arrangement.positions, i);
            let r = distance(&x, &self.center);
            let pull = if r > 0.0 { strength(D) * total * fraction[i] / r.powi(D as i32) } else { 0.0 };
            std::array::from_fn(|k| -pull * (x[k] - self.center[k]))
        })
    }

    /// What the point mass in the center does to a particle.
    fn point_pull(&self, i: usize) -> Pull<D> {
        let none = Pull { acceleration: [0.0; D], potential: 0.0 };
        self.point.map_or(none, |point| point.pull(&at(&self.arrangement.positions, i)))
    }

    fn pulls(&self) -> Vec<Pull<D>> {
        let softening = softening_radius::<D>(self.sums.iter().map(|s| s.number_density));
        gravity(self.arrangement.tree(), &vec![self.mass; self.sums.len()], softening, OPENING_ANGLE)
    }

    fn hold(&mut self, enclosed: &[[f64; D]]) {
        let pulls = self.pulls();
        self.beyond =
            parallel::map(pulls.len(), |i| std::array::from_fn(|k| pulls[i].acceleration[k] - enclosed[i][k]));
        self.held = 0;
    }

    /// One step, of `most` at most.
    fn advance(&mut self, most: f64) {
        let sound = |i: usize| self.law.sound_speed(&self.states, i, self.mass * self.sums[i].number_density);
        let speed = |i: usize| self.velocities[i].iter().map(|v| v * v).sum::<f64>().sqrt();
        let fastest = reduce::max(self.sums.len(), |i| (sound(i) + speed(i)) / self.support[i]);
        let free = (COURANT / fastest).min(LARGEST_STEP * self.dynamical_time);
        let step = if free >= most { most } else { most / (most / free).ceil() };
        self.kick(0.5 * step);
        let moved = parallel::map(self.velocities.len(), |i| {
            let x = at(&self.arrangement.positions, i);
            std::array::from_fn::<f64, D, _>(|k| x[k] + step * self.velocities[i][k])
        });
        self.arrangement.place(|i| moved[i]);
        if self.arrangement.is_stale(SORT_INTERVAL) {
            self.sort();
        }
        self.sum();
        self.accelerate();
        self.kick(0.5 * step);
        self.time += step;
    }

    fn kick(&mut self, step: f64) {
        let accelerations = &self.accelerations;
        parallel::update(&mut self.velocities, |i, v| (0..D).for_each(|k| v[k] += step * accelerations[i][k]));
    }

    fn sort(&mut self) {
        let order = self.arrangement.sort();
        for rows in [&mut self.velocities, &mut self.beyond] {
            *rows = parallel::reordered(rows, &order);
        }
        self.support = parallel::reordered(&self.support, &order);
        self.states.reorder(&order);
    }

    fn totals(&mut self) -> Totals {
        let pulls = self.pulls();
        let (n, mass) = (pulls.len(), self.mass);
        let density = |i: usize| mass * self.sums[i].number_density;
        let place = |i: usize| at(&self.arrangement.positions, i);
        let mut order: Vec<(f64, usize)> = (0..n).map(|i| (distance(&place(i), &self.center), i)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let central = ((CENTRAL * n as f64) as usize).clamp(1, n);
        let turn = |a: usize, b: usize| {
            let get = |v: [f64; D], k: usize| v.get(k).copied().unwrap_or(0.0);
            reduce::sum(n, |i| {
                let (x, v) = (place(i), self.velocities[i]);
                mass * (get(x, a) * get(v, b) - get(x, b) * get(v, a))
            })
        };
        Totals {
            kinetic: reduce::sum(n, |i| 0.5 * mass * self.velocities[i].iter().map(|v| v * v).sum::<f64>()),
            internal: reduce::sum(n, |i| mass * self.law.energy(&self.states, i, density(i))),
            pressure: reduce::sum(n, |i| mass / density(i) * self.law.pressure(&self.states, i, density(i))),
            potential: reduce::sum(n, |i| mass * (0.5 * pulls[i].potential + self.point_pull(i).potential)),
            softened: reduce::sum(n, |i| {
                let (x, point) = (place(i), self.point_pull(i));
                let along: f64 = (0..D).map(|k| (x[k] - self.center[k]) * point.acceleration[k]).sum();
                mass * (along - point.potential)
            }),
            central_density: order[..central].iter().map(|&(_, i)| density(i)).sum::<f64>() / central as f64,
            half_mass_radius: order[n / 2].0,
            angular_momentum: [turn(1, 2), turn(2, 0), turn(0, 1)],
        }
    }
}
