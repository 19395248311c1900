//! Fields that a scene defines by expressions or files: columns that particles carry in addition to those of the input, or in their place.
//!
//! Expressions know x, y, z, r (from the center), R, phi and theta (about the axis), the density `rho`, each other, the file's
//! scalars, constants and units. All numbers are in the scene's units, plain numbers where there are none. Magnetic fields are in units whose
//! magnetic pressure is B^2/2.
//!
//! | fields | meaning |
//! |---|---|
//! | `velocity`; `v_x` `v_y` `v_z`; `v_R` `v_r` `v_theta` `v_phi` | Cartesian; along the axes; about the axis. They add up |
//! | `pressure`, `temperature`, `internal_energy`, `entropy` | of an ideal gas: P = (gamma - 1) rho u = A rho^gamma, u = kB T / ((gamma - 1) mu mH) |
//! | `mean_molecular_weight` | mu, which a temperature needs |
//! | `magnetic_field`; `vector_potential` | B; or its curl, by central differences of sixth order, which commute: div B = 0 |
//! | `material` | whole numbers |
//! | `metallicity` | written as `Metallicity` |
//! | any other name | a column of that name |

mod of_file;
mod variables;

use crate::error::{Error, Result};
use crate::field::{CarriedField, CarriedInfo, ScalarField, SharedCarried, SharedDensity, Source, probes};
use crate::input::constants::{Constants, constant};
use crate::input::roles::field_key;
use crate::input::thermal;
use crate::input::turbulence::Turbulence;
use crate::input::way::{Way, across};
use crate::scene::{Conversion, FieldValue, Quantity, Scene, TurbulenceInput, beside_units};
use of_file::{Frame, OfFile, Said};
use sph::domain::Domain;
use sph_formats::common::particle_names as names;
use sph_formats::{FormatSpec, Unit, UnitDimension, UnitSystem};
use std::collections::BTreeMap;
use std::sync::Arc;
use variables::{Base, PLACES, Rule, Scalar, StatedField, Stirred, Term, Variables};

pub(super) const VECTOR_POTENTIAL: &str = "vector_potential";
/// Half of the width over which a vector potential is differenced has three of these steps, in units of the domain's size:
/// for waves of a fifth of the domain truncation and rounding both leave ten digits.
const CURL_STEP: f64 = 1e-3;
/// The key of an energy for all particles.
const GIVEN: &str = "thermal.internal_energy";

/// Adds the scene's fields to what `source` carries; `conversion` leads from the scene's numbers to those of the source; those of the same meaning are left out of the file's. Beside it, what is probably not meant.
///
/// # Errors
/// Expressions that cannot be read or have no finite value, files that cannot be read or are of another place, fields that depend on themselves,
/// thermal fields that contradict each other.
pub(crate) fn attach<const D: usize>(
    (scene, formats): (&Scene, &[FormatSpec]),
    source: Source<D>,
    conversion: &Conversion,
) -> Result<(Source<D>, Vec<String>)> {
    let has_thermal = || source.carried.iter().any(|field| thermal::name_of(&field.info().name).is_some());
    let is_given = scene.thermal.internal_energy.is_some() && has_thermal();
    if scene.fields.is_empty() && scene.turbulence.is_none() && !is_given {
        return Ok((source, Vec::new()));
    }
    if conversion.is_unsaid {
        refuse_plain(scene)?;
    }
    let center = source.center();
    let Source { density, carried, domain, mass, radial, mut notes } = source;
    let density: Arc<dyn ScalarField<D>> = Arc::from(density);
    let carried: Vec<Arc<dyn CarriedField<D>>> = carried.into_iter().map(Arc::from).collect();
    let system = conversion.from;
    let base = Base {
        density: Arc::clone(&density),
        center,
        axis: scene.fields.axis()?,
        step: CURL_STEP * domain.size(),
        length: 1.0 / conversion.factor(UnitDimension::LENGTH),
        density_unit: 1.0 / conversion.factor(UnitDimension::mass_density(3)),
    };
    let frame = Frame { domain: &domain, base: &base, system };
    let mut said = Said::default();
    let files = of_file::all((scene, formats), &frame, &mut said)?;
    notes.append(&mut said.notes);
    let maker = Maker::new((scene, system), base, (&carried, files))?;
    let made = maker.fields(scene, &domain)?;
    let stated: Vec<&str> = made.iter().map(|f| standard_name(&f.info.name)).collect();
    let mut kept: Vec<Box<dyn CarriedField<D>>> = Vec::new();
    for field in carried {
        let name = &field.info().name;
        if stated.contains(&standard_name(name)) {
            notes.push(format!("'{name}' is that of the scene's fields, not that of the file"));
        } else {
            kept.push(Box::new(SharedCarried(field)));
        }
    }
    maker.check(scene, &domain, &made)?;
    notes.extend(maker.notes);
    kept.extend(made.into_iter().map(|f| Box::new(f) as Box<dyn CarriedField<D>>));
    let source = Source { density: Box::new(SharedDensity(density)), carried: kept, domain, mass, radial, notes };
    Ok((source, said.doubts))
}

/// Refuses plain numbers of something that has a unit, where others have theirs and nobody says what plain ones are in. None of something is none
/// in any unit, and temperatures are in kelvin everywhere.
///
/// # Errors
/// The first.
fn refuse_plain(scene: &Scene) -> Result<()> {
    for (name, value) in scene.fields.stated() {
        let dimension = thermal::dimension_of(name).unwrap_or_else(|| dimension_of(name, value));
        if [UnitDimension::NONE, UnitDimension::TEMPERATURE].contains(&dimension) {
            continue;
        }
        if let Some(number) = value.texts().iter().filter_map(|text| text.trim().parse().ok()).find(|v| *v != 0.0) {
            return Err(beside_units(key_of(name), &Quantity::Plain(number)));
        }
    }
    Ok(())
}

struct Maker<const D: usize> {
    variables: Arc<Variables<D>>,
    /// Names by place.
    names: Vec<String>,
    constants: Constants,
    /// What is read from files, by the names of the fields.
    files: BTreeMap<String, OfFile<D>>,
    notes: Vec<String>,
}

/// The name of a column, where what it means has one.
fn standard_name(name: &str) -> &str {
    names::standard(name).unwrap_or(name)
}

/// Columns that placement itself makes.
const MADE: [&str; 9] = [
    names::COORDINATES,
    names::MASSES,
    names::SUPPORT_RADIUS,
    names::DENSITY,
    names::PARTICLE_IDS,
    names::SMOOTHING_LENGTH,
    names::TARGET_DENSITY,
    names::PARTICLE_TYPE,
    names::BODY_ID,
];

/// Whether a field is a scalar that others can refer to.
fn is_scalar(name: &str, components: usize) -> bool {
    components == 1 && Way::named(name).is_none() && name != VECTOR_POTENTIAL
}

fn key_of(name: &str) -> String {
    format!("fields.{name}")
}

impl<const D: usize> Maker<D> {
    fn new(
        (scene, system): (&Scene, Option<UnitSystem>),
        base: Base<D>,
        (carried, files): (&[Arc<dyn CarriedField<D>>], BTreeMap<String, OfFile<D>>),
    ) -> Result<Self> {
        let constants = Constants::new(scene, system);
        let mut names: Vec<String> = PLACES.map(str::to_owned).to_vec();
        let mut stated = Vec::new();
        if let Some((name, _)) = scene.fields.stated().find(|(name, _)| MADE.contains(&standard_name(name))) {
            return Err(Error::scene(key_of(name), "is what the placement itself makes; choose another name"));
        }
        let components = |name: &str, value: &FieldValue| match value {
            FieldValue::One(_) => 1,
            FieldValue::Each(_) => 0,
            FieldValue::File(_) => files.get(name).map_or(0, |f| f.terms.len()),
        };
        for (key, value) in scene.fields.stated().filter(|(name, value)| is_scalar(name, components(name, value))) {
            let name = thermal::name_of(key).unwrap_or(key);
            let other = scene
                .fields
                .stated()
                .map(|(other, _)| other)
                .find(|other| *other != key && thermal::name_of(other).is_some_and(|other| other == name));
            if let Some(other) = other {
                let problem = format!("and {} are two spellings of one field; leave one out", key_of(other));
                return Err(Error::scene(key_of(key), problem));
            }
            let is_taken = names.iter().any(|n| n == name)
                || ["x", "y", "z", "r", "pi", "tau", "e", "G"].contains(&name)
                || constant(name, Some(&UnitSystem::CODE), 1.0).is_some();
            if is_taken {
                return Err(Error::scene(
                    key_of(name),
                    "has the name of a coordinate, a constant, a unit or another field",
                ));
            }
            names.push(name.to_owned());
            stated.push((key, value));
        }
        let mut scalars: Vec<Scalar<D>> = PLACES.map(|_| Scalar::Place).into_iter().collect();
        let inputs: Vec<(String, Scalar<D>)> = carried.iter().filter_map(|f| of_input(f, system.as_ref())).collect();
        for (name, _) in &inputs {
            let is_new = !names.contains(name);
            names.push(if is_new { name.clone() } else { format!("{name} of the file") });
        }
        let all: Vec<&str> = names.iter().map(String::as_str).collect();
        for &(name, value) in &stated {
            scalars.push(match files.get(name).map(|f| f.terms.as_slice()) {
                Some([Term::File(field, _), ..]) => Scalar::File(Arc::clone(field), 1.0),
                _ => {
                    let text = constants.number(&key_of(name), &value.texts().concat(), dimension_of(name, value))?;
                    Scalar::Stated(constants.expression::<D>(&key_of(name), &text, &all)?)
                }
            });
        }
        let stated = stated.len();
        scalars.extend(inputs.into_iter().map(|(_, field)| field));
        let across = across(base.axis);
        let variables = Arc::new(Variables { base, across, scalars });
        let maker = Self { variables, names, constants, files, notes: Vec::new() };
        for place in PLACES.len()..PLACES.len() + stated {
            maker.order(place, &mut Vec::new(), &mut Vec::new())?;
        }
        Ok(maker)
    }

    /// Appends the scalars that the one at `place` needs, and itself, to `done`. `open` are those that need it.
    fn order(&self, place: usize, open: &mut Vec<usize>, done: &mut Vec<usize>) -> Result<()> {
        if done.contains(&place) || matches!(self.variables.scalars[place], Scalar::Place) {
            return Ok(());
        }
        if let Some(start) = open.iter().position(|p| *p == place) {
            let circle: Vec<&str> = open[start..].iter().chain([&place]).map(|p| self.names[*p].as_str()).collect();
            return Err(Error::scene(
                key_of(circle[0]),
                format!("depends on itself: {}; leave one of them out", circle.join(" -> ")),
            ));
        }
        open.push(place);
        if let Scalar::Stated(expression) = &self.variables.scalars[place] {
            for other in (0..self.names.len()).filter(|p| expression.has_other(*p)) {
                self.order(other, open, done)?;
            }
        }
        open.pop();
        done.push(place);
        Ok(())
    }

    /// The components of a field, which measure `dimension`.
    fn terms(&self, name: &str, value: &FieldValue, dimension: UnitDimension) -> Result<Vec<Term<D>>> {
        match self.files.get(name) {
            Some(file) => {
                file.check(dimension).map_err(|problem| Error::scene(key_of(name), problem))?;
                Ok(file.terms.clone())
            }
            None => value.texts().iter().map(|t| self.quantity(name, t, dimension)).collect(),
        }
    }

    /// An expression, or a number of `dimension` with its unit.
    fn quantity(&self, name: &str, text: &str, dimension: UnitDimension) -> Result<Term<D>> {
        self.term(name, &self.constants.number(&key_of(name), text, dimension)?)
    }

    fn term(&self, name: &str, text: &str) -> Result<Term<D>> {
        if self.constants.system.is_none() && text.starts_with(thermal::OF_TEMPERATURE) {
            let problem = "gives an energy by the constants kB and mH, which have units, but the scene's numbers have none; state them, as in `units: solar`, or give fields.internal_energy";
            return Err(Error::scene(key_of(thermal::TEMPERATURE), problem));
        }
        let all: Vec<&str> = self.names.iter().map(String::as_str).collect();
        let expression = self.constants.expression::<D>(&key_of(name), text, &all)?;
        let mut needs = Vec::new();
        for place in (0..self.names.len()).filter(|p| expression.has_other(*p)) {
            self.order(place, &mut Vec::new(), &mut needs)?;
        }
        Ok(Term::Expression(expression, needs))
    }

    fn field(&self, name: &str, dimension: UnitDimension, components: usize, rule: Rule<D>) -> StatedField<D> {
        let unit = |s: UnitSystem| Unit { symbol: s.symbol(dimension), to_cgs: s.to_cgs(dimension), dimension };
        let unit = self.constants.system.filter(|_| dimension != UnitDimension::NONE).map(unit);
        let info = CarriedInfo { name: standard_name(name).to_owned(), unit, components };
        StatedField { key: key_of(name), info, variables: Arc::clone(&self.variables), rule }
    }

    /// All fields that particles carry.
    fn fields(&self, scene: &Scene, domain: &Domain<D>) -> Result<Vec<StatedField<D>>> {
        let mut made = Vec::from_iter(self.velocity(scene, domain)?);
        made.extend(self.magnetic_field(scene)?);
        for (name, value) in scene.fields.stated() {
            let standard = standard_name(name);
            if Way::named(name).is_some() || standard == names::VELOCITIES || is_magnetic(name) {
                continue;
            }
            // An entropy of an ideal gas has a unit that no file can state; its energy is written in its place.
            if thermal::name_of(name) == Some(thermal::ENTROPY) {
                continue;
            }
            if let Some(key) =
                field_key(name).filter(|_| names::standard(name).is_none() && thermal::name_of(name).is_none())
            {
                let problem = format!("is another spelling of fields.{key}; write that, or choose another name");
                return Err(Error::scene(key_of(name), problem));
            }
            let of_file = self.files.get(name).map(OfFile::dimension);
            let dimension = thermal::dimension_of(name).or(of_file).unwrap_or_else(|| dimension_of(name, value));
            let terms = self.terms(name, value, dimension)?;
            let components = terms.len();
            if components == 0 || (components > 1 && thermal::name_of(name).is_some()) {
                return Err(Error::scene(key_of(name), format!("has {components} components, expected one")));
            }
            made.push(self.field(name, dimension, components, Rule::Each(terms)));
        }
        let known = self.thermal(scene);
        if let (Some(name), Some(_)) = (known.stated(), &scene.thermal.internal_energy) {
            let problem = "and thermal.internal_energy are both given; leave one out";
            return Err(Error::scene(key_of(name), problem));
        }
        if let Some(text) = thermal::derived_energy(&known, scene.thermal.gamma)? {
            let rule = Rule::Each(vec![self.term(thermal::INTERNAL_ENERGY, &text)?]);
            made.push(self.field(thermal::INTERNAL_ENERGY, UnitDimension::SPECIFIC_ENERGY, 1, rule));
        }
        Ok(made)
    }

    fn velocity(&self, scene: &Scene, domain: &Domain<D>) -> Result<Option<StatedField<D>>> {
        let mut parts = Vec::new();
        for (name, value) in scene.fields.stated() {
            let is_whole = standard_name(name) == names::VELOCITIES;
            let way = Way::named(name);
            if !is_whole && way.is_none() {
                continue;
            }
            let terms = self.terms(name, value, UnitDimension::VELOCITY)?;
            let expected = if is_whole { D } else { 1 };
            if terms.len() != expected {
                let problem = format!("has {} components, expected {expected}", terms.len());
                return Err(Error::scene(key_of(name), problem));
            }
            match way {
                Some(way) if D < way.dimensions() => {
                    return Err(Error::scene(key_of(name), format!("does not exist in {D} dimension(s)")));
                }
                Some(way) => parts.extend(terms.into_iter().map(|term| (way, term))),
                None => parts.extend(terms.into_iter().enumerate().map(|(axis, term)| (Way::Axis(axis), term))),
            }
        }
        let stirred = scene.turbulence.as_ref().map(|t| self.stirred(scene, t, domain)).transpose()?;
        if parts.is_empty() && stirred.is_none() {
            return Ok(None);
        }
        Ok(Some(self.field("velocity", UnitDimension::VELOCITY, D, Rule::Velocity(parts, stirred))))
    }

    fn stirred(&self, scene: &Scene, input: &TurbulenceInput, domain: &Domain<D>) -> Result<Stirred<D>> {
        let density = |x: &[f64; D]| self.variables.base.density.value(x);
        let turbulence = Turbulence::new(input, input.seed.unwrap_or(scene.seed), domain)?.at_rest_in(domain, &density);
        let speed = match (&input.rms_velocity, input.mach) {
            (Some(speed), _) => speed.value("turbulence.rms_velocity", UnitDimension::VELOCITY, &self.own())?,
            (None, mach) => mach.unwrap_or(0.0) * self.sound_speed(scene, domain)?,
        };
        Ok((turbulence, speed))
    }

    /// To the scene's numbers.
    fn own(&self) -> Conversion {
        Conversion::new(self.constants.system, self.constants.system.unwrap_or(UnitSystem::CODE))
    }

    /// The energy that the scene gives to all particles, in its numbers.
    fn given_energy(&self, scene: &Scene) -> Result<Option<f64>> {
        let value = |energy: &Quantity| energy.value(GIVEN, UnitDimension::SPECIFIC_ENERGY, &self.own());
        scene.thermal.internal_energy.as_ref().map(value).transpose()
    }

    /// Root mean square over the mass, by samples: c^2 = gamma (gamma - 1) u.
    fn sound_speed(&self, scene: &Scene, domain: &Domain<D>) -> Result<f64> {
        let gamma = scene.thermal.gamma;
        if let Some(energy) = self.given_energy(scene)? {
            return Ok((gamma * (gamma - 1.0) * energy).sqrt());
        }
        let Some((name, text)) = self.thermal(scene).energy(gamma) else {
            let problem = "needs a sound speed, but nothing thermal is given; set rms_velocity, or a thermal field";
            return Err(Error::scene("turbulence.mach", problem));
        };
        let term = self.term(name, &text)?;
        let (mut mass, mut sum) = (0.0, 0.0);
        for x in probes(domain) {
            let density = self.variables.base.density.value(&x);
            if density > 0.0 {
                mass += density;
                sum += density * self.variables.value(&x, &term);
            }
        }
        Ok((gamma * (gamma - 1.0) * sum / mass).sqrt())
    }

    /// Of three components, in 2-D and 1-D too: no symmetry of the flow keeps a field from pointing out of it.
    fn magnetic_field(&self, scene: &Scene) -> Result<Option<StatedField<D>>> {
        let mut found = scene.fields.stated().filter(|(name, _)| is_magnetic(name));
        let Some((name, value)) = found.next() else { return Ok(None) };
        if let Some((other, _)) = found.next() {
            return Err(Error::scene(key_of(name), format!("and {} are both given; leave one out", key_of(other))));
        }
        let dimension = match name {
            VECTOR_POTENTIAL => {
                UnitDimension { length: 1 + UnitDimension::MAGNETIC_FIELD.length, ..UnitDimension::MAGNETIC_FIELD }
            }
            _ => UnitDimension::MAGNETIC_FIELD,
        };
        let terms = self.terms(name, value, dimension)?;
        let rule = match (name, terms.len()) {
            (VECTOR_POTENTIAL, 3) => Rule::Curl(terms),
            (VECTOR_POTENTIAL, 1) if D == 2 => Rule::Curl(terms),
            (VECTOR_POTENTIAL, n) => {
                let expected = if D == 2 { "3, or 1 along z" } else { "3" };
                return Err(Error::scene(key_of(name), format!("has {n} components, expected {expected}")));
            }
            (_, 3) => Rule::Each(terms),
            (_, n) if n == D => Rule::Each(terms),
            (_, n) => return Err(Error::scene(key_of(name), format!("has {n} components, expected 3"))),
        };
        Ok(Some(self.field(names::MAGNETIC_FIELD, UnitDimension::MAGNETIC_FIELD, 3, rule)))
    }

    /// What is known of the thermal state: names of the scene's fields and of the file's.
    fn thermal(&self, scene: &Scene) -> thermal::Known {
        let is_stated =
            |wanted: &str| scene.fields.stated().any(|(name, _)| thermal::name_of(name).unwrap_or(name) == wanted);
        let is_known = |wanted: &str| self.names.iter().any(|n| n == wanted);
        thermal::Known::new(is_stated, is_known)
    }

    /// Tries all fields where there is matter.
    fn check(&self, scene: &Scene, domain: &Domain<D>, made: &[StatedField<D>]) -> Result<()> {
        let density = &self.variables.base.density;
        let places: Vec<[f64; D]> = probes(domain).into_iter().filter(|x| density.value(x) > 0.0).collect();
        for field in made {
            let mut out = vec![0.0; field.info.components];
            let name = field.info.name.as_str();
            for x in &places {
                field.evaluate(x, &mut out);
                let problem = match out.iter().find(|v| !v.is_finite()) {
                    // A pole right in the center is let pass, as for densities: no particle is there.
                    Some(_) if *x == self.variables.base.center => continue,
                    Some(v) => format!("is {v} at {x:?}, expected a finite number wherever there is matter"),
                    None if standard_name(name) == names::MATERIAL_IDS && out[0].fract() != 0.0 => {
                        format!("is {} at {x:?}, expected whole numbers", out[0])
                    }
                    None if thermal::name_of(name).is_some() && out[0] < 0.0 => {
                        format!("is {} at {x:?}, expected none below 0", out[0])
                    }
                    None => continue,
                };
                return Err(Error::scene(&field.key, problem));
            }
        }
        self.check_given(scene, &places)?;
        let energies = thermal::energies(&self.thermal(scene), scene.thermal.gamma);
        let Some(((first, text), others)) = energies.split_first() else { return Ok(()) };
        let own = self.term(first, text)?;
        for (other, text) in others {
            let term = self.term(other, text)?;
            for x in &places {
                let (a, b) = (self.variables.value(x, &own), self.variables.value(x, &term));
                thermal::compare((first, a), (other, b), scene.thermal.gamma)
                    .map_err(|problem| Error::scene(key_of(first), format!("{problem} at {x:?}")))?;
            }
        }
        Ok(())
    }

    /// Compares the energy that the scene gives to all particles with what the input carries.
    fn check_given(&self, scene: &Scene, places: &[[f64; D]]) -> Result<()> {
        let (Some(energy), gamma) = (self.given_energy(scene)?, scene.thermal.gamma) else { return Ok(()) };
        for (other, text) in self.thermal(scene).besides_energy(gamma) {
            let term = self.term(other, &text)?;
            for x in places {
                thermal::compare((GIVEN, energy), (other, self.variables.value(x, &term)), gamma)
                    .map_err(|problem| Error::scene(GIVEN, format!("{problem} at {x:?}")))?;
            }
        }
        Ok(())
    }
}

fn is_magnetic(name: &str) -> bool {
    name == VECTOR_POTENTIAL || names::standard(name) == Some(names::MAGNETIC_FIELD)
}

/// What a field is measured in: that of its meaning, else that of the units that its own numbers carry.
fn dimension_of(name: &str, value: &FieldValue) -> UnitDimension {
    let own = || value.texts().into_iter().find_map(|t| Quantity::Text(t).dimension());
    thermal::dimension_of(name).or_else(own).unwrap_or(UnitDimension::NONE)
}

/// A scalar of the input by the name that expressions use, in the scene's units.
fn of_input<const D: usize>(
    field: &Arc<dyn CarriedField<D>>,
    system: Option<&UnitSystem>,
) -> Option<(String, Scalar<D>)> {
    let info = field.info();
    if info.components != 1 {
        return None;
    }
    let factor = info.unit.as_ref().zip(system).map_or(1.0, |(u, s)| u.to_cgs / s.to_cgs(u.dimension));
    let name = thermal::name_of(&info.name).unwrap_or(&info.name).to_owned();
    Some((name, Scalar::File(Arc::clone(field), factor)))
}
