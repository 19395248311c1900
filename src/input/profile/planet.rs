//! Planets of layers, by integrating hydrostatic equilibrium from the surface inward:
//!
//! dm/dr = 4 pi r^2 rho, dP/dr = -G m rho/r^2, and in adiabatic layers du/dP = P/(rho^2 c^2), rho being that of P and of the
//! layer's energy or temperature. The one of mass, radius and boundaries that is not stated is that with which all of the mass is
//! used up just at the center, found by bisection: what is left there grows with the mass, and falls with the radius and with
//! the boundary of a denser layer. Steps of Runge-Kutta 4 end at the boundaries.

use super::spheres::key;
use super::table::Table;
use crate::eos::{EosError, EquationOfState, Material, Warmth};
use crate::error::{Error, Result};
use crate::ode;
use crate::scene::ThermalState;
use std::f64::consts::PI;

/// Steps over the radius.
const STEPS: usize = 1000;
const BISECTIONS: usize = 100;
/// Masses and radii are looked for within this factor of those of incompressible layers.
const REACH: f64 = 1e3;
/// A pressure of so many G M^2/R^4 is that of a mass that is left at the center.
const MOST_PRESSURE: f64 = 1e5;
/// What may be left at the center of the mass, in units of it: the ball within the innermost steps.
const LARGEST_LEFT: f64 = 1e-6;
/// Share of the density at which a material is at home, below which it is a vapor.
const VAPOR: f64 = 0.5;
/// Secant steps to the mass at which a layer ends.
const REFINEMENTS: usize = 8;

/// Where a layer ends, seen from the inside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Boundary {
    Radius(f64),
    /// Mass within.
    Mass(f64),
    /// The same over that of the planet.
    Fraction(f64),
    /// Where the rest wants it.
    Unknown,
}

#[derive(Debug, Clone)]
pub(super) struct Layer {
    pub material: Material,
    pub state: ThermalState,
    /// Its outer one; that of the outermost is the surface.
    pub end: Boundary,
}

/// All in cgs.
#[derive(Debug, Clone)]
pub(super) struct Planet {
    pub layers: Vec<Layer>,
    pub mass: Option<f64>,
    pub radius: Option<f64>,
    pub surface_pressure: f64,
    pub surface_temperature: f64,
    pub gravity: f64,
}

/// What is tried.
#[derive(Debug, Clone, Copy)]
struct Trial {
    mass: f64,
    radius: f64,
    /// Radius of the boundary that is not stated.
    boundary: f64,
}

/// Mass within, pressure and energy at a radius.
#[derive(Debug, Clone, Copy)]
struct State {
    r: f64,
    m: f64,
    pressure: f64,
    energy: f64,
    density: f64,
}

fn refuse(problem: impl Into<String>) -> Error {
    Error::scene("input.profile.planet", problem)
}

fn of_layer(index: usize, error: &EosError) -> Error {
    Error::scene(key("planet", &format!("layers[{index}]")), error.to_string())
}

impl Planet {
    /// Its table.
    ///
    /// # Errors
    /// Numbers that make no planet.
    pub fn table(&self) -> Result<Table> {
        self.check()?;
        let outer = self.layers.len() - 1;
        let surface = self.top(outer, self.surface_pressure, self.surface_temperature);
        let (_, density, _) = surface.map_err(|e| match self.surface_pressure {
            0.0 => {
                let problem = format!("is 0, as it is by default, but {e}; state the pressure at the outer radius");
                Error::scene(key("planet", "surface_pressure"), problem)
            }
            _ => of_layer(outer, &e),
        })?;
        let trial = match (self.mass, self.radius) {
            (Some(mass), Some(radius)) => self.with_boundary(mass, radius)?,
            (Some(mass), None) => {
                let usual = (0.75 * mass / (PI * density)).cbrt();
                let of = |radius: f64| Trial { mass, radius, boundary: 0.0 };
                let found = self.solve(&|x| self.left(&of(usual * x)), [1.0 / REACH, REACH], false);
                of(usual * found.ok_or_else(|| refuse("has no radius with these layers"))?)
            }
            (None, Some(radius)) => {
                let usual = 4.0 / 3.0 * PI * density * radius.powi(3);
                let of = |mass: f64| Trial { mass, radius, boundary: 0.0 };
                let found = self.solve(&|x| self.left(&of(usual * x)), [1.0 / REACH, REACH], true);
                of(usual * found.ok_or_else(|| refuse("has no mass with these layers"))?)
            }
            (None, None) => return Err(refuse("has neither a mass nor a radius; state one")),
        };
        let table = self.rows(&trial)?;
        match table.misses(trial.mass) {
            None => Ok(table),
            Some(times) => Err(refuse(format!(
                "has a layer whose density changes too much within a thousandth of the radius, as that of a vapor does: between its rows lies {times:.3} \
                 times the mass; state a lower surface_temperature, or a surface_pressure that keeps the material dense{}",
                table.notes.iter().map(|note| format!(" ({note})")).collect::<String>()
            ))),
        }
    }

    /// What is a vapor at the top of its layer.
    fn vapors(&self, states: &[(usize, State, f64)]) -> Vec<String> {
        let top = |layer: usize| states.iter().find(|s| s.0 == layer);
        let note = |layer: usize| {
            let equation = &self.layers[layer].material.equation;
            let (_, state, temperature) = top(layer)?;
            let is_solid = matches!(equation, EquationOfState::Tillotson(_) | EquationOfState::Table(_));
            (is_solid && state.density < VAPOR * equation.usual_density()).then(|| {
                format!(
                    "layers[{layer}] is a vapor at its top: {} has {:.3e} g/cm^3 at {temperature:.4} K and {:.3e} dyn/cm^2, where it is at home with {:.3e}",
                    equation.name(),
                    state.density,
                    state.pressure,
                    equation.usual_density()
                )
            })
        };
        (0..self.layers.len()).filter_map(note).collect()
    }

    /// Exactly one thing has to be open, and boundaries lie one within the other.
    fn check(&self) -> Result<()> {
        let inner = &self.layers[..self.layers.len().saturating_sub(1)];
        if self.layers.is_empty() {
            return Err(refuse("has no layers"));
        }
        let open = inner.iter().filter(|l| l.end == Boundary::Unknown).count();
        let unknown = open + usize::from(self.mass.is_none()) + usize::from(self.radius.is_none());
        if unknown != 1 {
            let problem = format!(
                "leaves {unknown} of its mass, its radius and the {} between its layers open, expected 1, which follows from the others: state \
                 {}",
                if inner.len() == 1 { "boundary" } else { "boundaries" },
                if unknown > 1 { "more, as by layers[0].mass_fraction" } else { "one less" }
            );
            return Err(refuse(problem));
        }
        for pair in inner.windows(2).enumerate() {
            let (i, [a, b]) = pair else { continue };
            let ordered = match (a.end, b.end) {
                (Boundary::Radius(a), Boundary::Radius(b)) | (Boundary::Mass(a), Boundary::Mass(b)) => a < b,
                (Boundary::Fraction(a), Boundary::Fraction(b)) => a < b,
                _ => true,
            };
            if !ordered {
                let problem = "ends within the layer before it; list layers from the inside outward";
                return Err(Error::scene(key("planet", &format!("layers[{}]", i + 1)), problem));
            }
        }
        for (i, layer) in inner.iter().enumerate() {
            let problem = match (layer.end, self.radius, self.mass) {
                (Boundary::Radius(r), Some(radius), _) if r >= radius => "reaches beyond the planet's radius",
                (Boundary::Mass(m), _, Some(mass)) if m >= mass => "has all of the planet's mass, or more, within it",
                (Boundary::Fraction(f), ..) if f >= 1.0 => "has all of the planet's mass, or more, within it",
                _ => continue,
            };
            return Err(Error::scene(key("planet", &format!("layers[{i}]")), problem));
        }
        Ok(())
    }

    /// The radius of the boundary that is not stated.
    fn with_boundary(&self, mass: f64, radius: f64) -> Result<Trial> {
        let of = |x: f64| Trial { mass, radius, boundary: x * radius };
        let left = |x: f64| self.left(&of(x));
        let [none, all] = [left(0.0), left(1.0 - 1e-9)];
        if !(none * all < 0.0) {
            let free = |boundary: f64| {
                let ends = |r: f64| self.left(&Trial { mass, radius: radius * r, boundary: boundary * radius * r });
                self.solve(&ends, [1.0 / REACH, REACH], false).map_or(f64::NAN, |x| x * radius)
            };
            let (a, b) = (free(0.0), free(1.0 - 1e-9));
            let problem = format!(
                "has a radius of {radius:.5e} cm that its mass of {mass:.5e} g does not have with these layers: expected {:.5e} to {:.5e} cm",
                a.min(b),
                a.max(b)
            );
            return Err(Error::scene(key("planet", "radius"), problem));
        }
        let found = self.solve(&left, [1e-6, 1.0 - 1e-9], all > 0.0);
        found.map(of).ok_or_else(|| refuse("has no boundary between its layers"))
    }

    /// Where a function changes its sign, rising or falling; `None` where it does not.
    fn solve(&self, left: &dyn Fn(f64) -> f64, [low, high]: [f64; 2], rises: bool) -> Option<f64> {
        let (mut a, mut b) = (low.ln(), high.ln());
        let is_beyond = |x: f64| (left(x.exp()) > 0.0) == rises;
        if is_beyond(a) || !is_beyond(b) {
            return None;
        }
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (a + b);
            if !(b - a > 2.0 * f64::EPSILON) {
                break;
            }
            if is_beyond(middle) { b = middle } else { a = middle }
        }
        Some((0.5 * (a + b)).exp())
    }

    /// What is left of the mass at the center, in units of it; as if less than nothing where it is used up before.
    fn left(&self, trial: &Trial) -> f64 {
        self.integrate(trial, &mut |_, _, _| {}).map_or(1.0, |left| left)
    }

    /// Energy, density and what keeps the warmth at the top of a layer.
    fn top(&self, index: usize, pressure: f64, temperature: f64) -> std::result::Result<(f64, f64, Warmth), EosError> {
        let Layer { material, state, .. } = &self.layers[index];
        let equation = &material.equation;
        let density = equation.density(pressure, Warmth::Temperature(temperature))?;
        let energy = equation.energy_at(density, temperature);
        let warmth = match *state {
            ThermalState::Adiabatic => Warmth::Energy(energy),
            ThermalState::Isothermal => Warmth::Temperature(temperature),
            ThermalState::Power(exponent) => Warmth::Power { temperature, density, exponent },
        };
        Ok((energy, density, warmth))
    }

    /// One step inward; `None` where the material has no such state.
    fn step(&self, index: usize, warmth: Warmth, from: State, h: f64) -> Option<State> {
        let equation = &self.layers[index].material.equation;
        let is_adiabatic = matches!(warmth, Warmth::Energy(_)) && !equation.is_barotropic();
        let warmth_of = |energy: f64| if is_adiabatic { Warmth::Energy(energy) } else { warmth };
        let slopes = |r: f64, [m, pressure, energy]: [f64; 3]| -> Option<[f64; 3]> {
            let density = equation.density_near(pressure, warmth_of(energy), from.density).ok()?;
            let weight = -self.gravity * m * density / (r * r);
            // Material that has parted takes up no work.
            let c = if is_adiabatic { equation.sound_speed(density, energy) } else { 0.0 };
            let heat = if c > 0.0 { pressure / (density * density * c * c) * weight } else { 0.0 };
            Some([4.0 * PI * r * r * density, weight, heat])
        };
        let State { r, m, pressure, energy, .. } = from;
        let [m, pressure, energy] = ode::try_step(r, [m, pressure, energy], h, slopes)?;
        let density = equation.density_near(pressure, warmth_of(energy), from.density).ok()?;
        let energy = if is_adiabatic { energy } else { equation.energy_with(density, warmth) };
        Some(State { r: r + h, m, pressure, energy, density })
    }

    /// From the surface to the center: shows `keep` each state with its layer and temperature, and returns what is left of the
    /// mass, as [`Self::left`].
    fn integrate(&self, trial: &Trial, keep: &mut dyn FnMut(usize, &State, f64)) -> std::result::Result<f64, EosError> {
        let Trial { mass, radius, boundary } = *trial;
        let weight = self.gravity * mass * mass / radius.powi(4);
        let most = MOST_PRESSURE * (weight + self.surface_pressure);
        let mut index = self.layers.len() - 1;
        let (energy, density, mut warmth) = self.top(index, self.surface_pressure, self.surface_temperature)?;
        let mut now = State { r: radius, m: mass, pressure: self.surface_pressure, energy, density };
        let temperature = |index: usize, s: &State| {
            self.layers[index].material.equation.temperature(s.density, s.energy).unwrap_or(self.surface_temperature)
        };
        keep(index, &now, self.surface_temperature);
        let width = radius / STEPS as f64;
        let mut node = STEPS;
        loop {
            // Where the layer below begins: a radius, or a mass within.
            let (edge, edge_mass) = match index.checked_sub(1).map(|below| self.layers[below].end) {
                None => (0.0, 0.0),
                Some(Boundary::Radius(r)) => (r, 0.0),
                Some(Boundary::Unknown) => (boundary, 0.0),
                Some(Boundary::Mass(m)) => (0.0, m),
                Some(Boundary::Fraction(f)) => (0.0, f * mass),
            };
            while node > 1 && (node - 1) as f64 * width >= now.r * (1.0 - 1e-12) {
                node -= 1;
            }
            let next = (node.max(2) - 1) as f64 * width;
            let to = next.max(edge);
            if now.r > to
                && let Some(mut found) = self.step(index, warmth, now, to - now.r)
            {
                let mut ends = edge > next;
                if edge_mass > 0.0 && found.m <= edge_mass {
                    let mut h = to - now.r;
                    for _ in 0..REFINEMENTS {
                        h *= (now.m - edge_mass) / (now.m - found.m);
                        match self.step(index, warmth, now, h) {
                            Some(nearer) => found = nearer,
                            None => break,
                        }
                    }
                    ends = true;
                }
                now = found;
                keep(index, &now, temperature(index, &now));
                if !(now.m > 0.0) {
                    return Ok(-(now.r / radius).powi(3));
                }
                if now.pressure > most {
                    return Ok(now.m / mass);
                }
                if !ends {
                    continue;
                }
            } else if now.r > to {
                // No such state: the mass is used up within the step, or does not fit and has more than any pressure.
                let used = 4.0 * PI * now.r * now.r * now.density * (now.r - to);
                return Ok(if used > now.m { -(now.r / radius).powi(3) } else { now.m / mass });
            } else if edge <= 0.0 || index == 0 {
                break;
            }
            if index == 0 {
                break;
            }
            let hot = temperature(index, &now);
            index -= 1;
            let (energy, density, kept) = self.top(index, now.pressure, hot)?;
            warmth = kept;
            now = State { energy, density, ..now };
            keep(index, &now, hot);
        }
        let ball = 4.0 / 3.0 * PI * now.density * now.r.powi(3);
        Ok((now.m - ball) / mass)
    }

    /// What about its surface may be why no radius holds its mass, with the remedy.
    fn why_none(&self) -> String {
        let outer = self.layers.len() - 1;
        let equation = &self.layers[outer].material.equation;
        let Ok((_, density, _)) = self.top(outer, self.surface_pressure, self.surface_temperature) else {
            return String::new();
        };
        let at_surface = format!(
            "; at its surface {} has {density:.3e} g/cm^3 at {} K and {:.3e} dyn/cm^2, where it is at home with {:.3e}",
            equation.name(),
            self.surface_temperature,
            self.surface_pressure,
            equation.usual_density()
        );
        let remedy = match self.surface_pressure {
            0.0 => "state a surface_pressure, such as 1 bar, which keeps it dense",
            _ => "state another surface_pressure or a lower surface_temperature",
        };
        format!("{at_surface}: {remedy}")
    }

    fn rows(&self, trial: &Trial) -> Result<Table> {
        let mut states: Vec<(usize, State, f64)> = Vec::new();
        let left = self
            .integrate(trial, &mut |index, state, t| states.push((index, *state, t)))
            .map_err(|e| refuse(e.to_string()))?;
        if !(left.abs() < LARGEST_LEFT) {
            return Err(refuse(format!(
                "has no equilibrium: with these materials no radius holds its mass{}",
                self.why_none()
            )));
        }
        let Some(&(inmost, last, temperature)) = states.last() else { return Err(refuse("has no radius")) };
        let is_empty = |i: &usize| {
            let mut radii = states.iter().filter(|s| s.0 == *i).map(|s| s.1.r);
            let first = radii.next();
            radii.next_back().or(first) == first
        };
        if let Some(missing) = (0..self.layers.len()).find(is_empty) {
            let problem = "has no room: the layers about it fill the planet";
            return Err(Error::scene(key("planet", &format!("layers[{missing}]")), problem));
        }
        // The center, from the innermost ball of one density.
        let weight = 2.0 / 3.0 * PI * self.gravity * (last.density * last.r).powi(2);
        let pressure = last.pressure + weight;
        let equation = &self.layers[inmost].material.equation;
        let warmth = match self.layers[inmost].state {
            ThermalState::Adiabatic => Warmth::Energy(
                last.energy
                    + last.pressure / last.density.powi(2) * {
                        let near = equation.density_near(pressure, Warmth::Energy(last.energy), last.density);
                        near.unwrap_or(last.density) - last.density
                    },
            ),
            ThermalState::Isothermal => Warmth::Temperature(temperature),
            ThermalState::Power(exponent) => Warmth::Power { temperature, density: last.density, exponent },
        };
        let density = equation.density_near(pressure, warmth, last.density).map_err(|e| of_layer(inmost, &e))?;
        let center = State { r: 0.0, m: 0.0, pressure, energy: equation.energy_with(density, warmth), density };
        let at_center = equation.temperature(density, center.energy).unwrap_or(temperature);
        states.push((inmost, center, at_center));
        let notes = self.vapors(&states);
        states.reverse();
        let column = |value: &dyn Fn(&(usize, State, f64)) -> f64| states.iter().map(value).collect::<Vec<f64>>();
        let ids: Option<Vec<f64>> = states.iter().map(|s| self.layers[s.0].material.id.map(f64::from)).collect();
        let has_temperature = !self.layers.iter().all(|l| l.material.equation.is_barotropic());
        Ok(Table {
            radii: column(&|s| s.1.r),
            density: column(&|s| s.1.density),
            pressure: Some(column(&|s| s.1.pressure)),
            internal_energy: Some(column(&|s| s.1.energy)),
            temperature: has_temperature.then(|| column(&|s| s.2)),
            material: ids,
            notes,
        })
    }
}
