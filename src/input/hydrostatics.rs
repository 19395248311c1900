//! The pressure of the target and the gravity that it balances, in internal units (lengths in the domain's size,
//! total mass 1, constant of gravity 1).
//!
//! In d dimensions the unit of pressure is G M^2 / L^(2(d-1)) and that of specific energy G M / L^(d-2), where
//! in 2-D and 1-D masses are per length and per area (cylinders and sheets).

use crate::error::{Error, Result};
use crate::field::{CarriedField, RadialSource, ScalarField, probes};
use crate::input::body_materials::BodyMaterials;
use crate::input::constants::gravity_in_cgs;
use crate::input::internal_units::Prepared;
use crate::input::units::{InputUnits, RunUnits};
use crate::input::weight::{AtRest, Beside, attraction};
use crate::scene::{BalanceInput, GravityName, Scene};
use crate::target::{Equilibrium, MaterialState, Materials, Positions, at};
use sph::domain::{Domain, Region};
use sph::geometry::distance;
use sph::parallel;
use sph::point_mass::PointMass;
use sph_formats::common::particle_names as names;
use sph_formats::{Unit, UnitDimension};

/// A carried energy may be this far from that of an ideal gas at the pressure that holds the body.
const LARGEST_CONTRADICTION: f64 = 0.2;
/// Places outwards, at even steps of the mass, where the state of a body is looked at.
const SAMPLES: i32 = 40;

/// Change of a pressure over a domain's width, of itself, from which on a force has to hold it.
const EVEN: f64 = 1e-4;
/// Step of the differences that tell, in domain's widths.
const FIELD_STEP: f64 = 1e-4;

/// How far from the center and the surface, in radii, their pressures are taken, and what that of the surface may be of the central one.
const NEAR_SURFACE: f64 = 1e-3;
const LITTLE_PRESSURE: f64 = 1e-2;

/// Entropy may fall outwards by this much: tables and their interpolation are no better.
const LARGEST_FALL: f64 = 0.03;

/// Pressure and gravity as functions of position.
pub struct Hydrostatics<'a, const D: usize> {
    pressure: Pressure<'a, D>,
    gravity: Gravity<'a, D>,
    /// A point mass in the center, beside the gas.
    core: Option<PointMass<D>>,
    /// Bodies about the same center that are not among the particles.
    beside: &'a Beside,
    density: &'a dyn ScalarField<D>,
    domain: &'a Domain<D>,
    gamma: f64,
    /// Over the pressure above.
    materials: Option<BodyMaterials<'a, D>>,
    /// Input units (cgs where units are known) of specific energy per internal one.
    pub specific_energy: f64,
}

enum Pressure<'a, const D: usize> {
    /// A carried pressure times a factor.
    Carried(&'a dyn CarriedField<D>, f64),
    /// (gamma - 1) rho u with a carried specific internal energy times a factor.
    Energy(&'a dyn CarriedField<D>, f64),
    /// K rho^gamma.
    Power { constant: f64, gamma: f64 },
    /// That of a self-gravitating body at rest.
    AtRest(AtRest<D>),
}

/// Why a body is not balanced unless that is asked for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Doubt {
    Unasked(String),
    /// What is carried is not what holds it.
    Contradicted(String),
}

enum Gravity<'a, const D: usize> {
    None,
    /// G times the enclosed mass of a radial profile.
    Enclosed(&'a RadialSource<D>),
    /// An external field that holds the pressure: grad P / rho.
    Holding,
}

impl<'a, const D: usize> Hydrostatics<'a, D> {
    /// What the scene says of pressure and gravity. `None` where no balance is asked for and the input does not
    /// tell both: it is then only a figure of the report that is missing. Beside it, why a body should not be balanced
    /// unless that is asked for, or, as an error, why it cannot be.
    ///
    /// # Errors
    /// A balance is asked for that the input does not determine, or an energy is carried that is none of an ideal gas.
    pub(crate) fn new(
        scene: &Scene,
        prepared: &'a Prepared<D>,
        units: &RunUnits,
    ) -> Result<(Option<Self>, Option<Doubt>)> {
        if scene.balance.is_on() {
            let known = Self::known(scene, prepared, units)?.ok_or_else(no_pressure)?;
            return match known.contradiction(scene, prepared, units.input)? {
                Some(why) => Err(Error::scene("balance", why)),
                None => Ok((Some(known), None)),
            };
        }
        // A model in pure numbers has G = 1, or what `balance.constant` says.
        let attracts = units.input.is_some() || scene.own_gravity().is_some();
        if !attracts || prepared.source.radial.is_none() {
            return Ok((None, None));
        }
        if D < 3 {
            let asks =
                "codes have gravity between matter in three dimensions only: `balance: true` balances it all the same";
            return Ok((None, Some(Doubt::Unasked(asks.to_owned()))));
        }
        let checked = Self::known(scene, prepared, units).and_then(|known| match known {
            Some(known) => Ok((known.contradiction(scene, prepared, units.input)?, Some(known))),
            None => Ok((None, None)),
        });
        Ok(match checked {
            Ok((None, known)) => {
                let asks =
                    "other bodies attract it as well (gravity_of): `balance: true` balances it in the gravity of all";
                (known, (!prepared.beside.is_empty()).then(|| Doubt::Unasked(asks.to_owned())))
            }
            Ok((why, _)) => (None, why.map(Doubt::Contradicted)),
            Err(error) => (None, Some(Doubt::Unasked(error.to_string()))),
        })
    }

    /// Whether a force that is not the particles' own holds the pressure.
    pub fn is_in_field(&self) -> bool {
        matches!(self.gravity, Gravity::Holding)
    }

    /// Whether no force has to hold the pressure: it is the same everywhere.
    fn is_even(&self) -> bool {
        let width = self.domain.size();
        probes(self.domain).iter().all(|x| {
            let pull = self.gravity(x, FIELD_STEP * width).iter().map(|g| g * g).sum::<f64>().sqrt();
            pull * self.density.value(x) * width <= EVEN * self.pressure(x)
        })
    }

    /// How far the entropy P/rho^gamma of a body that its own gravity holds falls outwards, as a fraction of its largest value
    /// farther in, where that is much: such a body overturns.
    fn entropy_falls(&self) -> Option<f64> {
        let Gravity::Enclosed(radial) = &self.gravity else { return None };
        self.own_center().filter(|_| self.materials.is_none())?;
        let (mut most, mut fall) = (0.0_f64, 0.0_f64);
        for (_, x) in through(radial) {
            let entropy = self.pressure(&x) / self.density.value(&x).powf(self.gamma);
            most = most.max(entropy);
            fall = fall.max(1.0 - entropy / most);
        }
        (fall > LARGEST_FALL).then_some(fall)
    }

    /// What a carried internal energy says against the pressure that is balanced: the balance would replace it.
    fn contradiction(
        &self,
        scene: &Scene,
        prepared: &Prepared<D>,
        units: Option<InputUnits>,
    ) -> Result<Option<String>> {
        if let Some(materials) = &self.materials {
            return Ok(self.contradiction_of(materials, prepared));
        }
        let options = scene.balance.on().cloned().unwrap_or_default();
        let (Some(energy), None) = (carried(prepared, names::INTERNAL_ENERGY), &options.equation_of_state) else {
            return Ok(None);
        };
        let Some(radial) = prepared.source.radial.as_ref().filter(|_| self.own_center().is_some()) else {
            return Ok(None);
        };
        let scale = Scale::new::<D>(prepared, units, scene, &options);
        let unit = to_cgs(prepared, energy, UnitDimension::SPECIFIC_ENERGY, units.is_some())? / scale.specific_energy;
        let by_energy = Pressure::Energy(energy, unit);
        let body = AtRest::new(radial, self.core, self.beside);
        let mut ratios: Vec<f64> = through(radial)
            .map(|(r, x)| {
                let holding = match &self.pressure {
                    Pressure::Energy(..) => body.pressure(r),
                    _ => self.pressure(&x),
                };
                self.pressure_by(&by_energy, &x) / holding
            })
            .collect();
        ratios.sort_unstable_by(f64::total_cmp);
        let median = ratios[ratios.len() / 2];
        if (median - 1.0).abs() <= LARGEST_CONTRADICTION {
            return Ok(None);
        }
        let gamma = self.gamma;
        Ok(Some(format!(
            "the carried '{}' is {median:.3} times (in the median over the mass) what an ideal gas of thermal.gamma = {gamma:.4} has at the pressure that holds the body, \
             and would be replaced: set thermal.gamma, leave it out with input.carry, or name the pressure with balance.equation_of_state",
            prepared.name_of(energy.info())
        )))
    }

    /// The same for materials: their pressure by density and energy against the weight that it has to hold.
    fn contradiction_of(&self, materials: &BodyMaterials<'a, D>, prepared: &Prepared<D>) -> Option<String> {
        let radial = prepared.source.radial.as_ref().filter(|_| self.own_center().is_some())?;
        let body = AtRest::new(radial, prepared.point_mass(), &prepared.beside);
        let mut ratios: Vec<f64> = through(radial).map(|(r, x)| materials.pressure(&x) / body.pressure(r)).collect();
        ratios.sort_unstable_by(f64::total_cmp);
        let median = ratios[ratios.len() / 2];
        ((median - 1.0).abs() > LARGEST_CONTRADICTION).then(|| {
            format!(
                "the carried density and '{}' give a pressure {median:.3} times (in the median over the mass) that which holds the body, by the equation of state of {}: check the energy and the materials, or leave the energy out with input.carry",
                names::INTERNAL_ENERGY,
                materials.materials.names()
            )
        })
    }

    fn known(scene: &Scene, prepared: &'a Prepared<D>, units: &RunUnits) -> Result<Option<Self>> {
        let options = scene.balance.on().cloned().unwrap_or_default();
        let scale = Scale::new::<D>(prepared, units.input, scene, &options);
        let gravity = gravity(&options, prepared, scene)?;
        let Some(pressure) = pressure(scene, &options, prepared, &scale, &gravity, units)? else {
            return Ok(None);
        };
        let samples: Vec<[f64; D]> =
            prepared.source.radial.as_ref().map_or_else(Vec::new, |radial| through(radial).map(|(_, x)| x).collect());
        let scales = (units.input.is_some(), [scale.density, scale.specific_energy]);
        let materials = match options.equation_of_state {
            None if !samples.is_empty() => BodyMaterials::new(scene, prepared, scales, &samples)?,
            _ => None,
        };
        let mut known = Self {
            pressure,
            materials,
            gravity,
            core: prepared.point_mass(),
            beside: &prepared.beside,
            density: prepared.source.density.as_ref(),
            domain: &prepared.source.domain,
            gamma: scene.thermal.gamma,
            specific_energy: scale.specific_energy,
        };
        if known.is_in_field() && known.is_even() {
            known.gravity = Gravity::None;
        }
        Ok(Some(known))
    }

    /// Internal energies that the target says for particles at these places, in internal units.
    pub fn energies(&self, positions: &Positions<D>) -> Vec<f64> {
        parallel::map(positions[0].len(), |i| {
            let x = at(positions, i);
            let own = || self.pressure(&x) / ((self.gamma - 1.0) * self.density.value(&x).max(f64::MIN_POSITIVE));
            self.material(&x).map_or_else(own, |state| state.energy)
        })
    }

    fn pressure_by(&self, pressure: &Pressure<'_, D>, x: &[f64; D]) -> f64 {
        let scalar = |field: &dyn CarriedField<D>| {
            let mut out = [0.0];
            field.evaluate(x, &mut out);
            out[0]
        };
        match pressure {
            Pressure::Carried(field, factor) => factor * scalar(*field),
            Pressure::Energy(field, factor) => (self.gamma - 1.0) * self.density.value(x) * factor * scalar(*field),
            Pressure::Power { constant, gamma } => constant * self.density.value(x).powf(*gamma),
            Pressure::AtRest(body) => match &self.gravity {
                Gravity::Enclosed(radial) => body.pressure(distance(x, &radial.center)),
                _ => 0.0,
            },
        }
    }

    /// What there is to say of a body that is balanced.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = vec![format!("balanced {}", self.describe())];
        notes.extend(self.entropy_falls().map(|fall| {
            format!(
                "entropy falls outwards by {:.0} %: with thermal.gamma = {:.3} the body is convectively unstable and overturns, in the code too",
                100.0 * fall,
                self.gamma
            )
        }));
        notes.extend(self.surface_pressure().map(|share| {
            format!(
                "the pressure at the surface is {:.0} % of the central one: beyond it the code has vacuum, into which the body expands unless a medium about it \
                 (`ambient`) has this pressure",
                100.0 * share
            )
        }));
        notes
    }

    /// The pressure at the surface of a body that its own gravity holds, over that in the center, where it is much.
    fn surface_pressure(&self) -> Option<f64> {
        let Gravity::Enclosed(radial) = &self.gravity else { return None };
        self.own_center()?;
        let at = |share: f64| self.pressure(&radial.at(share * radial.profile.outer_radius()));
        let share = at(1.0 - NEAR_SURFACE) / at(NEAR_SURFACE);
        (share > LITTLE_PRESSURE).then_some(share)
    }

    /// Where the pressure comes from and what it holds, for the report.
    fn describe(&self) -> String {
        let by_materials = self.materials.as_ref().map(|m| format!("the pressure of {}", m.materials.names()));
        let pressure = match &self.pressure {
            _ if by_materials.is_some() => by_materials.as_deref().unwrap_or_default(),
            Pressure::Carried(..) => "the carried pressure",
            Pressure::Energy(..) => "the carried internal energy",
            Pressure::Power { .. } => "the equation of state",
            Pressure::AtRest(_) => "the pressure of the body at rest, integrated from its surface",
        };
        let gravity = match &self.gravity {
            Gravity::None => "no gravity",
            Gravity::Enclosed(_) if !self.beside.is_empty() => "its own gravity and that of gravity_of",
            Gravity::Enclosed(_) if self.core.is_some() => "its own gravity and that of the point mass in its center",
            Gravity::Enclosed(_) => "its own gravity",
            Gravity::Holding => "an external field that holds it",
        };
        format!("{pressure} against {gravity}")
    }
}

impl<const D: usize> Equilibrium<D> for Hydrostatics<'_, D> {
    fn pressure(&self, x: &[f64; D]) -> f64 {
        self.materials.as_ref().map_or_else(|| self.pressure_by(&self.pressure, x), |m| m.pressure(x))
    }

    fn gravity(&self, x: &[f64; D], step: f64) -> [f64; D] {
        match &self.gravity {
            Gravity::None => [0.0; D],
            Gravity::Enclosed(radial) => {
                let r = distance(x, &radial.center);
                if !(r > 0.0) {
                    return [0.0; D];
                }
                let strength = attraction(radial, (self.core.as_ref(), self.beside), r) / r;
                sph::array(|k| -strength * (x[k] - radial.center[k]))
            }
            Gravity::Holding => {
                let at = |k: usize, h: f64| {
                    let mut y = *x;
                    y[k] += h;
                    self.domain.wrap(&mut y);
                    (self.pressure(if self.domain.contains(&y) { &y } else { x }), self.domain.contains(&y))
                };
                let density = self.density.value(x);
                sph::array(|k| {
                    let ((low, below), (high, above)) = (at(k, -step), at(k, step));
                    let width = step * (f64::from(below) + f64::from(above));
                    if width > 0.0 && density > 0.0 { (high - low) / (width * density) } else { 0.0 }
                })
            }
        }
    }

    fn has_gravity(&self) -> bool {
        !matches!(self.gravity, Gravity::None)
    }

    fn own_center(&self) -> Option<[f64; D]> {
        let Gravity::Enclosed(radial) = &self.gravity else { return None };
        // Particles alone do not attract as others do beside them.
        if !self.beside.is_empty() {
            return None;
        }
        // What a hollow domain leaves out attracts too.
        let is_whole = match &self.domain.region {
            Region::Ball { center, inner_radius, .. } => {
                *inner_radius == 0.0 && distance(center, &radial.center) <= 1e-9 * self.domain.size()
            }
            _ => false,
        };
        is_whole.then_some(radial.center)
    }

    fn point_mass(&self) -> Option<PointMass<D>> {
        self.core.filter(|_| matches!(self.gravity, Gravity::Enclosed(_)))
    }

    fn gamma(&self) -> f64 {
        self.gamma
    }

    fn materials(&self) -> Option<&Materials> {
        self.materials.as_ref().map(|m| &m.materials)
    }

    fn material(&self, x: &[f64; D]) -> Option<MaterialState> {
        self.materials.as_ref().map(|m| m.state(x))
    }
}

/// Internal units in those of the input (cgs where these are known).
struct Scale {
    pressure: f64,
    specific_energy: f64,
    density: f64,
}

impl Scale {
    fn new<const D: usize>(
        prepared: &Prepared<D>,
        units: Option<InputUnits>,
        scene: &Scene,
        options: &BalanceInput,
    ) -> Self {
        let in_cgs = gravity_in_cgs(scene);
        let (length, density, constant) = units.map_or((1.0, 1.0, options.constant), |u| (u.length, u.density, in_cgs));
        let size = prepared.length * length;
        let mass = prepared.mass.value * density * length.powi(D as i32);
        let specific_energy = constant * mass / size.powi(D as i32 - 2);
        let density = mass / size.powi(D as i32);
        Self { pressure: specific_energy * density, specific_energy, density }
    }
}

fn gravity<'a, const D: usize>(
    options: &BalanceInput,
    prepared: &'a Prepared<D>,
    scene: &Scene,
) -> Result<Gravity<'a, D>> {
    let by_input = scene.input.is_without_own_gravity().then_some(GravityName::Field);
    match (options.gravity.or(by_input), &prepared.source.radial) {
        (None | Some(GravityName::Own), Some(radial)) => Ok(Gravity::Enclosed(radial)),
        (Some(GravityName::Own), None) => Err(Error::scene(
            "balance.gravity",
            "is own, which needs a radial profile; expected field (an external field that holds the pressure) or none",
        )),
        (None | Some(GravityName::Field), _) => Ok(Gravity::Holding),
        (Some(GravityName::None), _) => Ok(Gravity::None),
    }
}

fn no_pressure() -> Error {
    Error::scene(
        "balance",
        "needs a pressure: the input carries neither pressure nor internal energy and is no radial profile; \
         set balance.equation_of_state",
    )
}

fn pressure<'a, const D: usize>(
    scene: &Scene,
    options: &BalanceInput,
    prepared: &'a Prepared<D>,
    scale: &Scale,
    gravity: &Gravity<'_, D>,
    units: &RunUnits,
) -> Result<Option<Pressure<'a, D>>> {
    let units_known = units.input.is_some();
    if let Some(state) = &options.equation_of_state {
        if let Some((constant, gamma)) = state.power_law(&units.to_cgs())? {
            let constant = constant * scale.density.powf(gamma) / scale.pressure;
            return Ok(Some(Pressure::Power { constant, gamma }));
        }
        return match gravity {
            Gravity::Enclosed(radial) => {
                Ok(Some(Pressure::AtRest(AtRest::new(radial, prepared.point_mass(), &prepared.beside))))
            }
            _ => Err(Error::scene(
                "balance.equation_of_state",
                "is at-rest, which integrates the weight of a radial profile under its own gravity",
            )),
        };
    }
    if let Some(field) = carried(prepared, names::PRESSURE) {
        let unit = to_cgs(prepared, field, UnitDimension::PRESSURE, units_known)?;
        return Ok(Some(Pressure::Carried(field, unit / scale.pressure)));
    }
    if let Some(field) = carried(prepared, names::INTERNAL_ENERGY) {
        let unit = to_cgs(prepared, field, UnitDimension::SPECIFIC_ENERGY, units_known)?;
        return Ok(Some(Pressure::Energy(field, unit / scale.specific_energy)));
    }
    Ok(match gravity {
        Gravity::Enclosed(radial) if scene.balance.is_on() => {
            Some(Pressure::AtRest(AtRest::new(radial, prepared.point_mass(), &prepared.beside)))
        }
        _ => None,
    })
}

/// Radii and places outwards through a body, at even steps of its mass.
fn through<const D: usize>(radial: &RadialSource<D>) -> impl Iterator<Item = (f64, [f64; D])> + '_ {
    (1..SAMPLES).map(|i| {
        let r = radial.profile.radius_of_fraction(f64::from(i) / f64::from(SAMPLES));
        (r, radial.at(r))
    })
}

fn carried<'a, const D: usize>(prepared: &'a Prepared<D>, name: &str) -> Option<&'a dyn CarriedField<D>> {
    let fields = prepared.source.carried.iter().map(AsRef::as_ref);
    fields.into_iter().find(|f: &&dyn CarriedField<D>| f.info().components == 1 && f.info().name == name)
}

fn to_cgs<const D: usize>(
    prepared: &Prepared<D>,
    field: &dyn CarriedField<D>,
    dimension: UnitDimension,
    units_known: bool,
) -> Result<f64> {
    let (info, name) = (field.info(), prepared.name_of(field.info()));
    match &info.unit {
        Some(Unit { dimension: d, to_cgs, .. }) if *d == dimension && units_known => Ok(*to_cgs),
        _ if !units_known => Ok(1.0),
        Some(_) => Err(Error::field(name, "has a unit of another quantity, so that its force is unknown")),
        None => Err(Error::field(
            name,
            "has no unit while length and density have one; give it one, or leave it out with input.carry",
        )),
    }
}
