//! The liquid that the particles represent: its equation of state, and the lengths that the code requires.
//!
//! Pressure and density are tied by Tait's equation (Monaghan 1994, J. Comput. Phys. 110, 399),
//!
//! ```text
//! P = B ((rho/rho0)^gamma - 1),   B = c^2 rho0/gamma
//! ```
//!
//! with a speed of sound c of ten times the largest speed, with which densities change by a hundredth: that of the file, or twice sqrt(dP/rho0) of the
//! largest difference of pressures, with which water runs from a dam that breaks (Ritter 1892). In time linear in the number of particles.

use super::schema::{SUPPORT, WALLS};
use crate::model::{ADIABATIC_INDEX, ParticleFile, ParticleTable, Species};
use crate::particle_names as names;

/// Speed of sound over the largest speed.
const SOUND_OVER_SPEED: f64 = 10.0;
/// Largest speed over the root of the pressure over the density that drives it.
const FRONT: f64 = 2.0;
/// Tait's exponent of liquids, where the gas of the file has none of its own.
const TAIT: f64 = 7.0;
/// Differences of pressures below this part of the largest are rounding.
const UNEVEN: f64 = 1e-5;

/// Constants of a liquid, in the file's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Liquid {
    /// That without pressure.
    pub density: f64,
    pub gamma: f64,
    /// `None` where nothing moves and no pressure drives anything.
    pub sound_speed: Option<f64>,
    /// The least pressure, which is that of a free surface.
    pub least_pressure: f64,
    /// Of a lattice of such particles.
    pub spacing: f64,
    pub smoothing_length: f64,
    pub mass: f64,
    /// Of wall particles; that of the liquid where there are none.
    pub wall_mass: f64,
}

impl Liquid {
    /// The liquid of a file; `None` without gas, its masses, or a density of it.
    pub fn of(file: &ParticleFile) -> Option<Self> {
        let d = file.header.dimension;
        let of = |t: u8| file.species.iter().find(|s| s.part_type == t && s.table.count > 0);
        let gas = &of(0)?.table;
        let walls = of(WALLS).map(|s: &Species| &s.table);
        let mass = middle(gas, names::MASSES)?;
        // Sums miss what is not there beside a free surface; walls have the density that is meant.
        let density = walls.and_then(|w| middle(w, names::DENSITY)).or_else(|| middle(gas, names::DENSITY))?;
        let spacing = (mass / density).powf(1.0 / d as f64);
        let smoothing_length = middle(gas, names::SUPPORT_RADIUS).unwrap_or(SUPPORT * spacing) / SUPPORT;
        let pressures = gas.column(names::PRESSURE).map(|c| c.values.range());
        let (least, most) = pressures.map_or((0.0, 0.0), |(least, most, _)| (least, most));
        let driven = (most - least).max(0.0);
        let is_even = driven <= UNEVEN * most.abs().max(least.abs());
        let front = if is_even { 0.0 } else { FRONT * (driven / density).sqrt() };
        let speed = front.max(largest_speed(gas, d));
        let gamma = file.header.adiabatic_index();
        let liquid = Self {
            density,
            gamma: if gamma == ADIABATIC_INDEX { TAIT } else { gamma },
            sound_speed: (speed > 0.0).then_some(SOUND_OVER_SPEED * speed),
            least_pressure: least,
            spacing,
            smoothing_length,
            mass,
            wall_mass: walls.and_then(|w| middle(w, names::MASSES)).unwrap_or(mass),
        };
        [density, spacing, smoothing_length].iter().all(|v| v.is_finite() && *v > 0.0).then_some(liquid)
    }

    /// The largest speed, of which the one of sound is made.
    pub fn largest_speed(&self) -> Option<f64> {
        Some(self.sound_speed? / SOUND_OVER_SPEED)
    }

    /// B of Tait's equation; 0 where there is no speed of sound.
    pub fn stiffness(&self) -> f64 {
        self.sound_speed.map_or(0.0, |c| c * c * self.density / self.gamma)
    }

    /// The density at a pressure; that without pressure where the two are not tied.
    pub fn density_at(&self, pressure: f64) -> f64 {
        let stiffness = self.stiffness();
        let over = if stiffness > 0.0 { (pressure - self.least_pressure) / stiffness } else { 0.0 };
        self.density * (1.0 + over).powf(1.0 / self.gamma)
    }
}

/// The middle one of a column's finite values.
fn middle(table: &ParticleTable, name: &str) -> Option<f64> {
    let values = &table.column(name)?.values;
    let mut finite: Vec<f64> = (0..values.len()).map(|i| values.get(i)).filter(|v| v.is_finite()).collect();
    let at = finite.len() / 2;
    (!finite.is_empty()).then(|| *finite.select_nth_unstable_by(at, f64::total_cmp).1)
}

fn largest_speed(table: &ParticleTable, d: usize) -> f64 {
    let Some(column) = table.column(names::VELOCITIES) else { return 0.0 };
    let square = |i: usize| (0..d).map(|k| column.values.get(d * i + k).powi(2)).sum::<f64>();
    let squares = (0..table.count.min(column.values.len() / d.max(1))).map(square);
    squares.filter(|s| s.is_finite()).fold(0.0, f64::max).sqrt()
}
