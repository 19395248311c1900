//! Totals of a set of particles per unit mass: velocity, spin, kinetic and thermal energy.
//!
//! The spin is the angular momentum about the center of mass, in its rest frame, so that it depends on neither origin nor frame. It
//! is defined about those axes across which nothing is periodic.

use crate::scene::Scene;
use nalgebra::{Matrix3, Vector3};
use sph_formats::common::particle_names as names;
use sph_formats::{RawField, UnitSystem};

/// Particles that may move; components beyond the dimension are 0.
pub(crate) struct MassPoints<'a> {
    /// Interleaved, `dimension` for each particle, as velocities are.
    pub positions: &'a [f64],
    pub masses: &'a [f64],
    pub dimension: usize,
    pub periodic: [bool; 3],
}

/// Sums over particles, per unit of mass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Motion {
    pub center: Vector3<f64>,
    pub velocity: Vector3<f64>,
    pub spin: Vector3<f64>,
    /// Of the spin about each axis.
    pub is_defined: [bool; 3],
    /// With that of the center of mass.
    pub kinetic: f64,
    pub inertia: Matrix3<f64>,
}

impl MassPoints<'_> {
    /// Place of particle `i`, and its velocity among `velocities`.
    pub fn at(&self, velocities: &[f64], i: usize) -> (Vector3<f64>, Vector3<f64>) {
        let d = self.dimension;
        let vector = |of: &[f64]| Vector3::from_fn(|k, _| if k < d { of[i * d + k] } else { 0.0 });
        (vector(self.positions), vector(velocities))
    }

    /// The sums, in the particles' order.
    pub fn sums(&self, velocities: &[f64]) -> Motion {
        let total: f64 = self.masses.iter().sum();
        let mean = |of: &dyn Fn(usize) -> Vector3<f64>| {
            let sum: Vector3<f64> = (0..self.masses.len()).map(|i| of(i) * self.masses[i]).sum();
            sum / total
        };
        let center = mean(&|i| self.at(velocities, i).0);
        let velocity = mean(&|i| self.at(velocities, i).1);
        let mut spin = mean(&|i| {
            let (x, v) = self.at(velocities, i);
            (x - center).cross(&(v - velocity))
        });
        let is_defined = self.is_spin_defined();
        (0..3).filter(|&k| !is_defined[k]).for_each(|k| spin[k] = 0.0);
        let (mut kinetic, mut inertia) = (0.0, Matrix3::zeros());
        for (i, m) in self.masses.iter().enumerate() {
            let (x, v) = self.at(velocities, i);
            let x = x - center;
            kinetic += 0.5 * m / total * v.norm_squared();
            inertia += (Matrix3::from_diagonal_element(x.norm_squared()) - x * x.transpose()) * (m / total);
        }
        Motion { center, velocity, spin, is_defined, kinetic, inertia }
    }

    fn is_spin_defined(&self) -> [bool; 3] {
        let is_open = |k: usize| k < self.dimension && !self.periodic[k];
        sph::array(|k| is_open((k + 1) % 3) && is_open((k + 2) % 3))
    }
}

/// What the particles of a snapshot have together, in cgs but for the spin, whose lengths are the input's.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Totals {
    /// Of those that have velocities.
    pub motion: Option<Motion>,
    /// Internal energy per unit of mass, of those that have one.
    pub thermal: Option<f64>,
    /// Whether these are pure numbers, which stay what they are.
    pub are_pure: bool,
}

impl Totals {
    /// Of particles at `points`, with the velocities and internal energies of `field`, where these have units or `are_pure` numbers.
    pub fn new(
        (field, are_pure): (&RawField, bool),
        points: &[[f64; 3]],
        masses: &[f64],
        dimension: usize,
        periodic: [bool; 3],
    ) -> Self {
        let has_unit = |name: &&str| field.variable(name).is_some_and(|v| v.unit.is_some());
        let are_pure = are_pure && ![names::VELOCITIES, names::INTERNAL_ENERGY].iter().any(has_unit);
        let column = |name: &str, components: usize| {
            let variable =
                field.variable(name).filter(|v| v.components == components || v.components == 3 && components > 1)?;
            let unit = match &variable.unit {
                Some(unit) => unit.to_cgs,
                None if are_pure => 1.0,
                None => return None,
            };
            let stride = variable.components;
            let at = |i: usize| (0..components).map(move |c| variable.values.get(i * stride + c) * unit);
            Some((0..masses.len()).flat_map(at).collect::<Vec<f64>>())
        };
        let positions: Vec<f64> = points.iter().flat_map(|p| p[..dimension].iter().copied()).collect();
        let points_of_mass = MassPoints { positions: &positions, masses, dimension, periodic };
        let motion = column(names::VELOCITIES, dimension).map(|velocities| points_of_mass.sums(&velocities));
        let thermal = column(names::INTERNAL_ENERGY, 1)
            .map(|u| u.iter().zip(masses).map(|(u, m)| u * m).sum::<f64>() / masses.iter().sum::<f64>());
        let is_finite = |m: &Motion| m.kinetic.is_finite() && m.spin.iter().all(|s| s.is_finite());
        Self { motion: motion.filter(is_finite), thermal: thermal.filter(|u| u.is_finite()), are_pure }
    }

    /// Less what the scene states in place of the snapshot's.
    pub fn less_stated(self, scene: &Scene) -> Self {
        let stated = |is: &dyn Fn(&str) -> bool| scene.fields.stated().any(|(name, _)| is(name));
        let moves = scene.turbulence.is_some() || stated(&|name| name == "velocity" || name.starts_with("v_"));
        let heats = scene.states_heat();
        Self { motion: self.motion.filter(|_| !moves), thermal: self.thermal.filter(|_| !heats), ..self }
    }

    /// The same with velocities and energies in `units`.
    pub fn in_units(self, units: &UnitSystem) -> Self {
        if self.are_pure {
            return self;
        }
        let velocity = 1.0 / units.to_cgs(sph_formats::UnitDimension::VELOCITY);
        let energy = 1.0 / units.to_cgs(sph_formats::UnitDimension::SPECIFIC_ENERGY);
        let motion = |m: Motion| Motion {
            velocity: m.velocity * velocity,
            spin: m.spin * velocity,
            kinetic: m.kinetic * velocity * velocity,
            ..m
        };
        Self { motion: self.motion.map(motion), thermal: self.thermal.map(|u| u * energy), ..self }
    }
}
