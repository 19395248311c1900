//! A medium around bodies: it is placed in the whole box, the shapes of the bodies are cut out of it, and the particles that remain near them are
//! relaxed against them.
//!
//! The shape of a body is where its own target has matter, moved and turned with it: what its domain has of vacuum is the medium's. What is left has
//! the mass of the medium outside of all shapes, by quadrature. Particles nearest to the bodies are left out until the number is right; the others within a few spacings of a
//! body move by WVT, with the particles of bodies at rest. Each neighbor counts by its volume there, so that a denser body
//! pushes as one of the same density does.

use super::plan::Plan;
use super::stages::{self, Placed, Setting};
use crate::error::{Error, Result};
use crate::field::{FreeSpace, ScalarField, Source, probes, total_mass};
use crate::input::ingest;
use crate::input::internal_units::Prepared;
use crate::input::stated_units;
use crate::input::units::RunUnits;
use crate::output::frame::{Factors, Frame};
use crate::output::others::Others;
use crate::relaxation::{WVT, family};
use crate::scene::{MatchName, Scene, in_body};
use crate::target::{Positions, Target, at};
use sph::domain::{Axis, Domain};
use sph_formats::{FormatSpec, UnitSystem};

/// Aim of the integrals over bodies.
const TOLERANCE: f64 = 1e-9;
/// Spacings of the medium from a body within which its particles move.
const REACH: f64 = 4.0;
const ITERATIONS: usize = 60;

/// Bodies where they begin, in the units of the output and the coordinates of the scene.
pub(super) struct Obstacles {
    /// Places of the particles of gas, and their spacings by the target.
    pub particles: Vec<([f64; 3], f64)>,
    pub bodies: Vec<Obstacle>,
    /// Mean mass of a particle of gas.
    pub particle_mass: f64,
    pub matching: MatchName,
    pub units: UnitSystem,
}

/// A body of gas.
pub(super) struct Obstacle {
    pub title: String,
    /// By itself.
    pub scene: Scene,
    pub count: usize,
    /// Center of mass in its box, as it is placed by itself.
    pub center: [f64; 3],
    pub position: [f64; 3],
    /// What its turn makes of the unit vectors.
    pub turn: [[f64; 3]; 3],
}

/// Where a body has matter, with its place among others.
struct Shape<const D: usize> {
    domain: Domain<D>,
    density: Box<dyn ScalarField<D>>,
    /// Whether part of the domain is vacuum.
    has_vacuum: bool,
    /// Units of the output per unit of the domain.
    length: f64,
    center: [f64; D],
    position: [f64; D],
    turn: [[f64; 3]; 3],
}

impl<const D: usize> Shape<D> {
    fn new(body: &Obstacle, units: &UnitSystem, formats: &[FormatSpec]) -> Result<Self> {
        let raw = ingest::read(&body.scene, formats)?;
        let own = RunUnits::new(&body.scene, stated_units::units(&body.scene, &raw)?.input)?;
        let prepared = Prepared::<D>::new(&body.scene, formats, (raw, &own), body.count)?;
        let length = Factors::new(own.input, &prepared, units).length;
        let domain = &prepared.source.domain;
        let frame = match Others::of(&prepared)? {
            Some(others) => Frame::new(&others.around(domain)?, body.scene.output.box_factor),
            None => Frame::new(domain, body.scene.output.box_factor),
        };
        // Particles that stay are where their snapshot has them, which is where the domain is.
        let corner = if body.scene.input.keeps_particles() { [0.0; D] } else { frame.lower_corner() };
        let center = sph::array(|k| body.center[k] + corner[k] * length);
        let position = sph::array(|k| body.position[k]);
        // Beside others a body does not go on beyond its box.
        let Source { mut domain, density, .. } = prepared.source;
        domain.axes = domain.axes.map(|axis| if axis == Axis::Periodic { Axis::OPEN } else { axis });
        let has_vacuum = probes(&domain).iter().any(|x| domain.contains(x) && !(density.value(x) > 0.0));
        Ok(Self { domain, density, has_vacuum, length, center, position, turn: body.turn })
    }

    /// Whether the body has matter at a place in its domain.
    fn has_matter(&self, y: &[f64; D]) -> bool {
        !self.has_vacuum || self.density.value(y) > 0.0
    }

    /// Whether it has at a place in its coordinates.
    fn contains(&self, y: &[f64; D]) -> bool {
        self.domain.contains(y) && self.has_matter(y)
    }

    /// Whether its matter ends within `reach` of a place in it.
    fn is_edge_within(&self, y: &[f64; D], reach: f64) -> bool {
        let beside = |k: usize, step: f64| -> [f64; D] { sph::array(|c| if c == k { y[c] + step } else { y[c] }) };
        self.domain.is_edge_within(y, reach)
            || self.has_vacuum && (0..D).any(|k| [reach, -reach].iter().any(|s| !self.contains(&beside(k, *s))))
    }

    /// In its domain, what is `offset` from its center of mass, in the output's units.
    fn own(&self, offset: &[f64; D]) -> [f64; D] {
        let along = |k: usize| (0..D).map(|c| self.turn[k][c] * offset[c]).sum::<f64>();
        sph::array(|k| (along(k) + self.center[k]) / self.length)
    }

    /// Of a place in its domain, in the output's units and the scene's coordinates.
    fn outside(&self, y: &[f64; D]) -> [f64; D] {
        let from = |k: usize| y[k] * self.length - self.center[k];
        sph::array(|c| (0..D).map(|k| self.turn[k][c] * from(k)).sum::<f64>() + self.position[c])
    }
}

/// A field of the medium as a body sees it.
struct Seen<'a, const D: usize> {
    field: &'a dyn ScalarField<D>,
    shape: &'a Shape<D>,
    domain: &'a Domain<D>,
    scale: f64,
}

impl<const D: usize> ScalarField<D> for Seen<'_, D> {
    fn value(&self, y: &[f64; D]) -> f64 {
        if !self.shape.has_matter(y) {
            return 0.0;
        }
        let x = self.shape.outside(y).map(|x| x / self.scale);
        self.field.value(&self.domain.wrapped(&x))
    }

    /// 0 where the body has no matter.
    fn piece(&self, y: &[f64; D]) -> u64 {
        u64::from(self.shape.has_matter(y))
    }

    fn is_piecewise(&self) -> bool {
        self.shape.has_vacuum
    }
}

/// The medium, and what is cut out of it, in the medium's internal units.
pub(super) struct Carving<'a, const D: usize> {
    shapes: Vec<Shape<D>>,
    points: Vec<[f64; D]>,
    densities: Vec<f64>,
    scale: f64,
    /// In all of the box.
    full: Target<'a, D>,
    /// Particles that are left.
    count: usize,
    /// Their share of the mass in the box.
    share: f64,
}

impl<'a, const D: usize> Carving<'a, D> {
    /// # Errors
    /// What reading bodies says, and a medium that has no place or too many particles.
    pub fn new(
        obstacles: &Obstacles,
        prepared: &'a Prepared<D>,
        units: &RunUnits,
        formats: &[FormatSpec],
    ) -> Result<Self> {
        let factors = Factors::new(units.input, prepared, &obstacles.units);
        let (target, scale) = (prepared.target(), factors.length);
        let shapes: Vec<Shape<D>> = obstacles
            .bodies
            .iter()
            .map(|b| Shape::new(b, &obstacles.units, formats).map_err(|e| in_body(&b.title, e)))
            .collect::<Result<_>>()?;
        let within = |field: &dyn ScalarField<D>| -> f64 {
            let of = |shape: &Shape<D>| {
                let seen = Seen { field, shape, domain: target.domain, scale };
                // Where the medium is nothing within a body, nothing is cut out.
                let mass = total_mass(&seen, &shape.domain, TOLERANCE).map_or(0.0, |m| m.value);
                mass * (shape.length / scale).powi(D as i32)
            };
            shapes.iter().map(of).sum()
        };
        let whole = match obstacles.matching {
            MatchName::Mass => factors.mass / obstacles.particle_mass,
            MatchName::Spacing => {
                let spacing = surface_spacing(obstacles, &shapes).ok_or_else(|| {
                    Error::scene("ambient.match", "is spacing, but no body has particles at its surface; take mass")
                })?;
                target.domain.volume() * (scale / spacing).powi(D as i32)
            }
        };
        let share = 1.0 - within(target.density);
        let number = whole * (1.0 - within(target.resolution_field()) / target.resolution_integral);
        if !(number.round() >= 1.0 && whole < f64::from(u32::MAX)) {
            let problem = format!(
                "gets {number:.3e} particles of the bodies' {}, expected 1 to {}; choose another density or box, or another number of particles for the bodies",
                if obstacles.matching == MatchName::Mass { "mass" } else { "spacing" },
                u32::MAX
            );
            return Err(Error::scene("ambient.density", problem));
        }
        let full = target.with_count((whole.round() as usize).max(1));
        let inside = |(x, _): &([f64; 3], f64)| target.domain.wrapped(&sph::array(|k| x[k] / scale));
        let density = |(_, spacing): &([f64; 3], f64)| (scale / spacing).powi(D as i32);
        Ok(Self {
            points: obstacles.particles.iter().map(inside).collect(),
            densities: obstacles.particles.iter().map(density).collect(),
            shapes,
            scale,
            full,
            count: number.round() as usize,
            share,
        })
    }

    /// Particles that fill the box.
    pub fn whole(&self) -> usize {
        self.full.count
    }

    /// What is left of the medium: its density is the same, and the particles are fewer.
    pub fn target(&self, target: Target<'a, D>) -> Target<'a, D> {
        let part = self.count as f64 / self.full.count as f64;
        Target { count: self.count, resolution_integral: target.resolution_integral * part, ..target }
    }

    fn is_within(&self, x: &[f64; D]) -> bool {
        let domain = self.full.domain;
        self.shapes.iter().any(|shape| {
            let from = domain.displacement(&shape.position.map(|p| p / self.scale), x);
            shape.contains(&shape.own(&from.map(|v| v * self.scale)))
        })
    }

    /// Places the medium in all of the box, cuts the bodies out of it, and relaxes what is near them.
    ///
    /// # Errors
    /// Those of placing, and bodies whose particles span no volume.
    pub fn place(&self, setting: &Setting<'_, D>, plan: &mut Plan) -> Result<Placed<D>> {
        let (scene, control, full) = (setting.scene, setting.control, &self.full);
        let mut placed = stages::place(&Setting::new(scene, *full, None, control), plan)?;
        let (base, taken) = (|x: &[f64; D]| full.number_density(x), |x: &[f64; D], _: usize| self.is_within(x));
        let held = self.densities.iter().map(|n| Some(*n)).collect();
        let free = FreeSpace::new((&self.points, held), full.domain, &base, &taken)?;
        let total = self.points.len() + self.count;
        let among = Target {
            largest_spacing: full.largest_spacing,
            ..Target::of_equal_masses(full.domain, &free, total, total as f64)
        };
        let mut all = self.points.clone();
        let left = self.left(&placed.particles.positions, &free, &among, scene.kernel_neighbors(D));
        if left.len() != self.count {
            let problem = format!(
                "gets {} particles, too few for one to be beside the bodies; choose another density or box, or more particles for the bodies",
                self.count
            );
            return Err(Error::scene("ambient.density", problem));
        }
        all.extend(left);
        let moves = |x: &[f64; D]| free.distance(x) < REACH * full.spacing(full.number_density(x));
        let held: Vec<bool> = (0..total).map(|i| i < self.points.len() || !moves(&all[i])).collect();
        let positions: Positions<D> = std::array::from_fn(|k| all.iter().map(|x| x[k]).collect());
        let mut near = plan.clone();
        (near.stages, near.wvt_iterations) = (vec![WVT], scene.wvt.iterations.unwrap_or(ITERATIONS));
        let settled = Setting::new(scene, among, None, control).settled(&near, positions, (&held, true))?;
        let own: Positions<D> = std::array::from_fn(|k| settled.particles.positions[k][self.points.len()..].to_vec());
        let closest = (0..self.count).map(|i| {
            let x = at(&own, i);
            let (nearest, distance) = free.nearest(&x);
            let finer = full.number_density(&x).max(self.densities[nearest]);
            distance * finer.powf(1.0 / D as f64)
        });
        placed.notes.push(format!(
            "the bodies replace {} of {} particles of the medium; across their surfaces the closest pair is {:.2} \
             spacings apart",
            full.count as i64 - self.count as i64,
            full.count,
            closest.fold(f64::INFINITY, f64::min)
        ));
        placed.particles.masses = Some(self.masses(&own));
        placed.particles.positions = own;
        placed.timing.extend(settled.timing.into_iter().filter(|t| t.step == WVT.name));
        Ok(placed)
    }

    /// Particles outside of all bodies, as many as are wanted: without those that are nearest to one, or with more in their place.
    fn left(
        &self,
        places: &Positions<D>,
        free: &FreeSpace<'_, D>,
        among: &Target<'_, D>,
        neighbors: f64,
    ) -> Vec<[f64; D]> {
        let all = (0..places[0].len()).map(|i| at(places, i)).filter(|x| !self.is_within(x));
        let mut outside: Vec<([f64; D], f64)> = all.map(|x| (x, free.distance(&x))).collect();
        outside.sort_by(|a, b| a.1.total_cmp(&b.1));
        let surplus = outside.len().saturating_sub(self.count);
        let rest = &outside[surplus..];
        let missing = self.count - rest.len();
        let family_of = |(i, (x, _)): (usize, &([f64; D], f64))| {
            let more = missing / rest.len() + usize::from(i < missing % rest.len());
            family(among, x, among.spacing(among.number_density(x)), neighbors, 1 + more)
        };
        rest.iter().enumerate().flat_map(family_of).collect()
    }

    /// Equal ones, or those of the resolution, that add up to the medium outside of the bodies.
    fn masses(&self, places: &Positions<D>) -> Vec<f64> {
        let weight = |i: usize| {
            let x = at(places, i);
            match self.full.has_equal_masses() {
                true => 1.0,
                false => self.full.density.value(&x) / self.full.number_density(&x),
            }
        };
        let weights: Vec<f64> = (0..self.count).map(weight).collect();
        let sum: f64 = weights.iter().sum();
        weights.into_iter().map(|w| w / sum * self.share).collect()
    }
}

/// Median spacing of the particles that are within one of a surface.
fn surface_spacing<const D: usize>(obstacles: &Obstacles, shapes: &[Shape<D>]) -> Option<f64> {
    let is_near = |(x, spacing): &&([f64; 3], f64)| {
        shapes.iter().any(|shape| {
            let y = shape.own(&sph::array(|k| x[k] - shape.position[k]));
            shape.contains(&y) && shape.is_edge_within(&y, spacing / shape.length)
        })
    };
    let mut near: Vec<f64> = obstacles.particles.iter().filter(is_near).map(|p| p.1).collect();
    let middle = near.len() / 2;
    (!near.is_empty()).then(|| *near.select_nth_unstable_by(middle, f64::total_cmp).1)
}
