//! Time integration of the particles that are followed, see [`super::certificate`].
//!
//! The equations are those of [`super::balance`]: density-entropy SPH with grad-h terms, each particle keeping its A_i or its
//! material's adiabat, and what the particles attract each other with. They are integrated by kick, drift, kick with one time step for all and without
//! viscosity, so that total energy is conserved for equal masses, and what moves is not damped. Of the gravity of a round body, the part that
//! follows from the mass enclosed about the center is taken at every step. What is left, and all of what is not round, comes from the tree, and is held
//! for a few steps, turning with the whole, where it changes little: in a round body, and in one, or two, at rest in a rotating frame. Point
//! masses attract and are attracted; those without a velocity stay where they are.

use super::orbiting::{Part, balanced};
use super::outside::{Field, reflected};
use super::states::{Law, States};
use super::structure::Structure;
use crate::metrics::Measured;
use crate::target::{MaterialState, Materials, Positions, at};
use nalgebra::{Matrix3, Rotation3, Vector3};
use sph::domain::{Axis, Domain};
use sph::geometry::distance;
use sph::gravity::{OPENING_ANGLE, Pull, gravity, softening_radius, strength};
use sph::kernel::KernelName;
use sph::neighbors::Tree;
use sph::point_mass::PointMass;
use sph::{parallel, reduce};

/// Time step over the time in which sound crosses a support radius; about a fifth of a smoothing length.
const COURANT: f64 = 0.11;
/// Largest time step in units of the time.
const LARGEST_STEP: f64 = 0.02;
/// Mean of the tree's part over that of the enclosed mass, below which a body is round.
const ROUND: f64 = 0.1;
/// Steps for which the tree's part of gravity is held, at most.
const HELD: usize = 10;
/// Change of that part while it is held, over all gravity on average, above which it is held for fewer steps.
const LITTLE: f64 = 1e-3;
/// Angular momentum over M R v, v^2 = 2 K/M, from which on particles rotate.
const ROTATES: f64 = 1e-2;

/// Particles at the start, in units in which the constant of gravity is 1.
#[derive(Debug, Clone)]
pub struct Followed<'a, const D: usize> {
    /// Space: periodic, or so large that nothing leaves it soon.
    pub domain: Domain<D>,
    pub positions: Positions<D>,
    pub velocities: Vec<[f64; D]>,
    pub masses: Vec<f64>,
    pub internal_energy: Vec<f64>,
    /// About their support radii.
    pub support: Vec<f64>,
    pub gamma: f64,
    /// Materials, and which each particle is of, in place of an ideal gas.
    pub materials: Option<(&'a Materials, &'a [usize])>,
    /// The center of what its own gravity holds; `None` where there is no gravity.
    pub center: Option<[f64; D]>,
    /// What acts from outside.
    pub field: Option<Field<'a, D>>,
    pub points: Vec<Point<D>>,
    /// Which body each particle is of, from 0 on, where there are several; empty for one.
    pub bodies: Vec<usize>,
    /// Time in which motion falls to 1/e, in units of [`super::State::time`]; only the rotation of the whole stays. `None` for free
    /// motion.
    pub damping: Option<f64>,
}

/// A point mass beside the particles.
#[derive(Debug, Clone, Copy)]
pub struct Point<const D: usize> {
    pub mass: PointMass<D>,
    /// `None` for one that stays where it is.
    pub velocity: Option<[f64; D]>,
}

fn cross(a: &[f64; 3], b: &[f64; 3]) -> [f64; 3] {
    sph::array(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
}

/// Particles at the end, in the units of [`Followed`].
#[derive(Debug, Clone)]
pub struct End<const D: usize> {
    pub positions: Positions<D>,
    pub velocities: Vec<[f64; D]>,
    pub internal_energy: Vec<f64>,
    /// As the code sums it, at the support radii.
    pub density: Vec<f64>,
    pub support: Vec<f64>,
    pub points: Vec<Point<D>>,
}

/// The particles under way, in their order.
pub(super) struct Body<'a, const D: usize> {
    kernel: KernelName,
    kernel_neighbors: f64,
    domain: Domain<D>,
    positions: Positions<D>,
    velocities: Vec<[f64; D]>,
    masses: Vec<f64>,
    law: Law<'a>,
    states: States,
    center: Option<[f64; D]>,
    field: Option<Field<'a, D>>,
    /// What the field has done so far.
    work: f64,
    points: Vec<Point<D>>,
    bodies: Vec<usize>,
    /// Whether it was not round about the center as it began, so that what is in the middle is that of each body.
    is_by_body: bool,
    pub radius: f64,
    pub total_mass: f64,
    /// Dynamical time, or that in which sound crosses.
    pub unit_time: f64,
    pub time: f64,
    /// Unit vector along the angular momentum, if the particles rotate.
    axis: Option<[f64; 3]>,
    first_density: Vec<f64>,
    measured: Measured<D>,
    accelerations: Vec<[f64; D]>,
    point_accelerations: Vec<[f64; D]>,
    /// Whether it is round, so that the gravity of the enclosed mass is most of it.
    is_round: bool,
    /// What the tree adds to that, or all of it, for how many steps that is held, and the steps since.
    beyond: Vec<[f64; D]>,
    hold_for: usize,
    held: Option<usize>,
    damping: Option<f64>,
}

/// Sums over the particles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Totals {
    pub kinetic: f64,
    /// Of the motion that is no rotation.
    pub disordered: f64,
    pub internal: f64,
    /// Integral of the pressure over the volume.
    pub pressure: f64,
    pub potential: f64,
    /// Sum of m x g over what point masses attract, less their potential: 0 but for the softening.
    pub softened: f64,
    pub density_change: f64,
    pub central_density: f64,
    pub half_mass_radius: f64,
    pub angular_momentum: [f64; 3],
}

impl<'a, const D: usize> Body<'a, D> {
    pub fn new((kernel, kernel_neighbors): (KernelName, f64), start: Followed<'a, D>) -> Self {
        let Followed {
            domain,
            positions,
            velocities,
            masses,
            internal_energy,
            support,
            gamma,
            materials,
            center,
            field,
            points,
            bodies,
            damping,
        } = start;
        let n = masses.len();
        let measured = Measured::new(kernel, &domain, &positions, &masses, &support, kernel_neighbors);
        let density = |i: usize| measured.sums[i].weighted;
        let states = match materials {
            None => {
                States::Gas(parallel::map(n, |i| internal_energy[i] * (gamma - 1.0) * density(i).powf(1.0 - gamma)))
            }
            Some((_, kinds)) => {
                let state =
                    |i: usize| MaterialState { kind: kinds[i], density: density(i), energy: internal_energy[i] };
                States::of_materials(&parallel::map(n, state))
            }
        };
        let law = Law { gamma, materials: materials.map(|(m, _)| m) };
        let total_mass = masses.iter().sum::<f64>();
        let middle = center.unwrap_or_else(|| sph::array(|k| 0.5 * (domain.lo[k] + domain.hi[k])));
        let radius = reduce::max(n, |i| distance(&at(&positions, i), &middle));
        let attracting = total_mass + points.iter().map(|p| p.mass.mass).sum::<f64>();
        let unit_time = if center.is_some() {
            (radius.powi(D as i32) / (strength(D) * attracting)).sqrt()
        } else {
            let sound = reduce::sum(n, |i| masses[i] * law.sound_speed(&states, i, density(i)));
            // Of the domain, but for empty space about the gas.
            let is_endless = domain.axes.contains(&Axis::Periodic);
            let extent = if is_endless { domain.size() } else { domain.size().min(2.0 * radius) };
            extent * total_mass / sound
        };
        let first_density = parallel::map(n, density);
        let mut body = Self {
            kernel,
            kernel_neighbors,
            domain,
            positions,
            velocities,
            masses,
            law,
            states,
            center,
            field,
            work: 0.0,
            points,
            bodies,
            is_by_body: false,
            radius,
            total_mass,
            unit_time,
            time: 0.0,
            axis: None,
            first_density,
            measured,
            accelerations: Vec::new(),
            point_accelerations: Vec::new(),
            beyond: vec![[0.0; D]; n],
            is_round: true,
            hold_for: 1,
            held: None,
            damping: damping.map(|time| time * unit_time),
        };
        body.axis = body.rotation();
        body.accelerate();
        body.is_by_body = !body.is_round;
        body
    }

    pub fn has_gravity(&self) -> bool {
        self.center.is_some()
    }

    pub fn is_damped(&self) -> bool {
        self.damping.is_some()
    }

    fn density(&self, i: usize) -> f64 {
        self.measured.sums[i].weighted
    }

    /// Densities at the present places.
    fn sum(&mut self) {
        self.measured = Measured::new(
            self.kernel,
            &self.domain,
            &self.positions,
            &self.masses,
            &self.measured.support,
            self.kernel_neighbors,
        );
    }

    fn accelerate(&mut self) {
        let strength = parallel::map(self.masses.len(), |i| {
            let s = &self.measured.sums[i];
            let grad_h = 1.0 + s.slope / (D as f64 * s.number_density);
            self.law.pressure(&self.states, i, s.weighted) / (s.weighted.powi(2) * grad_h)
        });
        let force = self.measured.pressure_force(self.kernel, &self.domain, &self.masses, &strength);
        let Some(center) = self.center else {
            self.accelerations = force;
            if let Some(field) = &self.field {
                let positions = &self.positions;
                parallel::update(&mut self.accelerations, |i, a| {
                    let g = field.acceleration(&at(positions, i));
                    (0..D).for_each(|k| a[k] += g[k]);
                });
            }
            return;
        };
        let is_held = self.held.filter(|held| *held < self.hold_for);
        let enclosed = if self.is_round || is_held.is_none() { self.enclosed_gravity(&center) } else { Vec::new() };
        match is_held {
            Some(held) => self.held = Some(held + 1),
            None => self.hold(&enclosed),
        }
        let beyond = &self.beyond;
        let enclosed = |i: usize| if self.is_round { enclosed[i] } else { [0.0; D] };
        self.accelerations = parallel::map(force.len(), |i| {
            let point = self.pull_of_points(&at(&self.positions, i));
            let enclosed = enclosed(i);
            sph::array(|k| force[i][k] + enclosed[k] + beyond[i][k] + point.acceleration[k])
        });
        self.point_accelerations = (0..self.points.len()).map(|p| self.pull_on_point(p)).collect();
    }

    /// The attraction of all that is nearer to the center, and of half of each particle itself.
    fn enclosed_gravity(&self, center: &[f64; D]) -> Vec<[f64; D]> {
        let n = self.masses.len();
        let (mut enclosed, mut within) = (vec![0.0; n], 0.0);
        for (_, i) in self.outward(center) {
            enclosed[i] = within + 0.5 * self.masses[i];
            within += self.masses[i];
        }
        parallel::map(n, |i| {
            let x = at(&self.positions, i);
            let r = distance(&x, center);
            let pull = if r > 0.0 { strength(D) * enclosed[i] / r.powi(D as i32) } else { 0.0 };
            sph::array(|k| -pull * (x[k] - center[k]))
        })
    }

    /// Distances from a center, ascending, with the particles that have them.
    fn outward(&self, center: &[f64; D]) -> Vec<(f64, usize)> {
        let mut order = parallel::map(self.masses.len(), |i| (distance(&at(&self.positions, i), center), i));
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        order
    }

    /// What all point masses do to what is at `x`.
    fn pull_of_points(&self, x: &[f64; D]) -> Pull<D> {
        let mut sum = Pull { acceleration: [0.0; D], potential: 0.0 };
        for point in &self.points {
            let pull = point.mass.pull(x);
            sum.potential += pull.potential;
            (0..D).for_each(|k| sum.acceleration[k] += pull.acceleration[k]);
        }
        sum
    }

    /// What the particles and the other points do to a point mass.
    fn pull_on_point(&self, p: usize) -> [f64; D] {
        let point = &self.points[p].mass;
        if self.points[p].velocity.is_none() {
            return [0.0; D];
        }
        let pulls = parallel::map(self.masses.len(), |i| point.pull(&at(&self.positions, i)).acceleration);
        sph::array(|k| {
            let of_gas = -reduce::sum(pulls.len(), |i| self.masses[i] * pulls[i][k]) / point.mass;
            let others = self.points.iter().enumerate().filter(|(q, _)| *q != p);
            of_gas + others.map(|(_, q)| q.mass.pull(&point.center).acceleration[k]).sum::<f64>()
        })
    }

    /// What the particles attract each other with, in their order.
    fn pulls(&self) -> Vec<Pull<D>> {
        let softening = softening_radius::<D>(self.measured.sums.iter().map(|s| s.number_density));
        let tree = Tree::build(&self.positions);
        let found = gravity(&tree, &tree.to_tree_order(&self.masses), softening, OPENING_ANGLE);
        let mut pulls = vec![Pull { acceleration: [0.0; D], potential: 0.0 }; found.len()];
        for (pull, &i) in found.into_iter().zip(tree.order()) {
            pulls[i as usize] = pull;
        }
        pulls
    }

    fn hold(&mut self, enclosed: &[[f64; D]]) {
        let pulls = self.pulls();
        let length = |v: [f64; D]| v.iter().map(|v| v * v).sum::<f64>().sqrt();
        let left = |i: usize| -> [f64; D] { sph::array(|k| pulls[i].acceleration[k] - enclosed[i][k]) };
        let n = pulls.len();
        let is_round = reduce::sum(n, |i| length(left(i))) < ROUND * reduce::sum(n, |i| length(enclosed[i]));
        let new = parallel::map(n, |i| if is_round { left(i) } else { pulls[i].acceleration });
        let changed = |i: usize| length(sph::array(|k| new[i][k] - self.beyond[i][k]));
        let change = reduce::sum(n, changed) / reduce::sum(n, |i| length(pulls[i].acceleration));
        self.hold_for = match self.held {
            Some(_) if is_round == self.is_round && change <= LITTLE => (2 * self.hold_for).min(HELD),
            Some(_) => (self.hold_for / 2).max(1),
            None => 1,
        };
        (self.beyond, self.is_round, self.held) = (new, is_round, Some(1));
    }

    /// Turns what is held by what the whole turns in a step.
    fn turn(&mut self, step: f64) {
        if self.axis.is_none() {
            return;
        }
        let rotation = Rotation3::new(Vector3::from(self.spin()) * step);
        parallel::update(&mut self.beyond, |_, v| {
            let turned = rotation * Vector3::from_fn(|k, _| v.get(k).copied().unwrap_or(0.0));
            *v = sph::array(|k| turned[k]);
        });
    }

    /// One step, of `most` at most.
    pub fn advance(&mut self, most: f64) {
        let sound = |i: usize| self.law.sound_speed(&self.states, i, self.density(i));
        let speed = |i: usize| self.velocities[i].iter().map(|v| v * v).sum::<f64>().sqrt();
        let fastest = reduce::max(self.masses.len(), |i| (sound(i) + speed(i)) / self.measured.support[i]);
        let free = (COURANT / fastest).min(LARGEST_STEP * self.unit_time);
        let step = if free >= most { most } else { most / (most / free).ceil() };
        self.kick(0.5 * step);
        let (domain, velocities, positions) = (&self.domain, &self.velocities, &self.positions);
        let moved = parallel::map(self.masses.len(), |i| {
            let x = at(positions, i);
            let free = sph::array(|k| x[k] + step * velocities[i][k]);
            reflected(domain, &x, (&free, &velocities[i]))
        });
        self.work += self.work_along(&moved);
        for k in 0..D {
            parallel::update(&mut self.positions[k], |i, value| *value = moved[i].0[k]);
        }
        parallel::update(&mut self.velocities, |i, v| *v = moved[i].1);
        for point in &mut self.points {
            let velocity = point.velocity.unwrap_or([0.0; D]);
            (0..D).for_each(|k| point.mass.center[k] += step * velocity[k]);
        }
        self.turn(step);
        self.sum();
        self.accelerate();
        self.kick(0.5 * step);
        if let Some(time) = self.damping {
            self.damp((-step / time).exp());
        }
        self.time += step;
    }

    /// What the field does while particles move.
    fn work_along(&self, moved: &[([f64; D], [f64; D])]) -> f64 {
        let Some(field) = &self.field else { return 0.0 };
        reduce::sum(moved.len(), |i| {
            let from = at(&self.positions, i);
            let way = self.domain.displacement(&from, &moved[i].0);
            let middle = sph::array(|k| from[k] + 0.5 * way[k]);
            let g = field.acceleration(&self.domain.wrapped(&middle));
            self.masses[i] * (0..D).map(|k| g[k] * way[k]).sum::<f64>()
        })
    }

    /// Keeps a share of all motion but for the rotation of the whole.
    pub fn damp(&mut self, keep: f64) {
        let spin = self.spin();
        let center = self.center.unwrap_or([0.0; D]);
        let damped = |x: &[f64; D], v: &[f64; D]| -> [f64; D] {
            let x: [f64; 3] = sph::array(|k| if k < D { x[k] - center[k] } else { 0.0 });
            let around = cross(&spin, &x);
            sph::array(|k| around[k] + keep * (v[k] - around[k]))
        };
        let positions = &self.positions;
        parallel::update(&mut self.velocities, |i, v| *v = damped(&at(positions, i), v));
        for point in &mut self.points {
            point.velocity = point.velocity.map(|v| damped(&point.mass.center, &v));
        }
    }

    /// The angular velocity of a rigid rotation: with the angular momentum, or that of bodies which their pull on each other keeps at
    /// their distance; 0 where the particles did not rotate at the start.
    fn spin(&self) -> [f64; 3] {
        let Some(axis) = &self.axis else { return [0.0; 3] };
        let is_one = self.bodies.is_empty() && self.points.iter().all(|p| p.velocity.is_none());
        if let Some(spin) = (!is_one).then(|| balanced(axis, self.parts())).flatten() {
            return axis.map(|a| spin * a);
        }
        let product = |a: usize, b: usize| {
            let of = |x: &[f64; D]| {
                let x = self.about_center(x);
                let square: f64 = x.iter().map(|v| v * v).sum();
                if a == b { square - x[a] * x[b] } else { -x[a] * x[b] }
            };
            let moving = self.points.iter().filter(|p| p.velocity.is_some());
            let points: f64 = moving.map(|p| p.mass.mass * of(&p.mass.center)).sum();
            reduce::sum(self.masses.len(), |i| self.masses[i] * of(&at(&self.positions, i))) + points
        };
        let inertia = Matrix3::from_fn(product);
        let spin = inertia.try_inverse().map_or_else(Vector3::zeros, |i| i * Vector3::from(self.angular_momentum()));
        spin.into()
    }

    /// Particles, and points that move, each of which is a body, with the bodies that they are of.
    fn parts(&self) -> impl Iterator<Item = (usize, Part)> + '_ {
        let wide = |v: &[f64; D]| -> [f64; 3] { sph::array(|k| v.get(k).copied().unwrap_or(0.0)) };
        let count = self.bodies.iter().max().map_or(1, |last| last + 1);
        let gas = (0..self.masses.len()).map(move |i| {
            let body = self.bodies.get(i).copied().unwrap_or(0);
            (body, (self.masses[i], self.about_center(&at(&self.positions, i)), wide(&self.accelerations[i])))
        });
        let points = self.points.iter().zip(&self.point_accelerations).enumerate();
        let moving = points.filter(|(_, (point, _))| point.velocity.is_some());
        gas.chain(moving.map(move |(p, (point, acceleration))| {
            (count + p, (point.mass.mass, self.about_center(&point.mass.center), wide(acceleration)))
        }))
    }

    /// The particles as they are now.
    pub fn into_end(self) -> End<D> {
        let n = self.masses.len();
        End {
            internal_energy: parallel::map(n, |i| self.law.energy(&self.states, i, self.density(i))),
            density: parallel::map(n, |i| self.density(i)),
            support: self.measured.support,
            positions: self.positions,
            velocities: self.velocities,
            points: self.points,
        }
    }

    fn kick(&mut self, step: f64) {
        let accelerations = &self.accelerations;
        parallel::update(&mut self.velocities, |i, v| (0..D).for_each(|k| v[k] += step * accelerations[i][k]));
        for (point, acceleration) in self.points.iter_mut().zip(&self.point_accelerations) {
            if let Some(velocity) = &mut point.velocity {
                (0..D).for_each(|k| velocity[k] += step * acceleration[k]);
            }
        }
    }

    /// Place of a particle from the center, with zeros for the dimensions that there are not.
    fn about_center(&self, x: &[f64; D]) -> [f64; 3] {
        sph::array(|k| match x.get(k) {
            Some(x) => x - self.center.map_or(0.0, |c| c[k]),
            None => 0.0,
        })
    }

    fn angular_momentum(&self) -> [f64; 3] {
        let turn = |a: usize, b: usize| {
            let get = |v: &[f64; D], k: usize| v.get(k).copied().unwrap_or(0.0);
            let of = |x: &[f64; D], v: &[f64; D]| {
                let x = self.about_center(x);
                x[a] * get(v, b) - x[b] * get(v, a)
            };
            let points = self.points.iter().filter_map(|p| Some(p.mass.mass * of(&p.mass.center, &p.velocity?)));
            let gas = |i: usize| self.masses[i] * of(&at(&self.positions, i), &self.velocities[i]);
            reduce::sum(self.masses.len(), gas) + points.sum::<f64>()
        };
        [turn(1, 2), turn(2, 0), turn(0, 1)]
    }

    fn kinetic(&self) -> f64 {
        let gas = |i: usize| 0.5 * self.masses[i] * self.velocities[i].iter().map(|v| v * v).sum::<f64>();
        let points = self.points.iter().filter_map(|p| {
            let velocity = p.velocity?;
            Some(0.5 * p.mass.mass * velocity.iter().map(|v| v * v).sum::<f64>())
        });
        reduce::sum(self.masses.len(), gas) + points.sum::<f64>()
    }

    /// The axis about which the particles rotate, if they do.
    fn rotation(&self) -> Option<[f64; 3]> {
        self.center?;
        let spin = self.angular_momentum();
        let length = spin.iter().map(|l| l * l).sum::<f64>().sqrt();
        let most = self.radius * (2.0 * self.kinetic() * self.total_mass).sqrt();
        (length > ROTATES * most).then(|| spin.map(|l| l / length))
    }

    /// Kinetic energy of the particles' motion along the axis of rotation and away from it; of all motion where there is none.
    fn disordered(&self) -> f64 {
        let Some(axis) = self.axis else { return self.kinetic() };
        reduce::sum(self.masses.len(), |i| {
            let around = cross(&axis, &self.about_center(&at(&self.positions, i)));
            let length = around.iter().map(|a| a * a).sum::<f64>().sqrt();
            let v = &self.velocities[i];
            let along: f64 = if length > 0.0 { (0..D).map(|k| v[k] * around[k]).sum::<f64>() / length } else { 0.0 };
            0.5 * self.masses[i] * (v.iter().map(|v| v * v).sum::<f64>() - along * along).max(0.0)
        })
    }

    /// Energy of the particles and the points in their gravity.
    fn potential(&self, pulls: &[Pull<D>]) -> f64 {
        let pairs =
            self.points.iter().enumerate().flat_map(|(p, a)| {
                self.points[..p].iter().map(|b| b.mass.mass * a.mass.pull(&b.mass.center).potential)
            });
        let gas = |i: usize| {
            let of_points = self.pull_of_points(&at(&self.positions, i)).potential;
            self.masses[i] * (0.5 * pulls[i].potential + of_points)
        };
        reduce::sum(pulls.len(), gas) + pairs.sum::<f64>()
    }

    pub fn totals(&self) -> Totals {
        let n = self.masses.len();
        let potential = if self.has_gravity() { self.potential(&self.pulls()) } else { -self.work };
        let density = |i: usize| self.density(i);
        let structure = Structure { positions: &self.positions, masses: &self.masses, density: &density };
        let (central_density, half_mass_radius) = match self.center {
            Some(_) if self.is_by_body => structure.of_bodies(&self.bodies),
            center => structure.about(&center.unwrap_or_else(|| self.domain.center())),
        };
        let change = |i: usize| (self.density(i) / self.first_density[i] - 1.0).powi(2);
        Totals {
            kinetic: self.kinetic(),
            disordered: self.disordered(),
            internal: reduce::sum(n, |i| self.masses[i] * self.law.energy(&self.states, i, self.density(i))),
            pressure: reduce::sum(n, |i| {
                self.masses[i] / self.density(i) * self.law.pressure(&self.states, i, self.density(i))
            }),
            potential,
            softened: reduce::sum(n, |i| self.masses[i] * self.softened(&at(&self.positions, i))),
            density_change: (reduce::sum(n, change) / n as f64).sqrt(),
            central_density,
            half_mass_radius,
            angular_momentum: self.angular_momentum(),
        }
    }

    /// x g of all point masses at `x`, less their potential.
    fn softened(&self, x: &[f64; D]) -> f64 {
        let of = |point: &Point<D>| {
            let pull = point.mass.pull(x);
            let along: f64 = (0..D).map(|k| (x[k] - point.mass.center[k]) * pull.acceleration[k]).sum();
            along - pull.potential
        };
        self.points.iter().map(of).sum()
    }
}
