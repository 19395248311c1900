//! Fields of a scene that are variables of files of their own.

use super::variables::{Base, Term};
use crate::error::{Error, Result};
use crate::field::{CarriedField, CarriedInfo, FieldOptions, Period, Source, from_particles, from_raw, probes};
use crate::input::interpolation::interpolation;
use crate::input::particles::Snapshot;
use crate::input::roles::{apply, assign};
use crate::input::stated_units::units_in_field;
use crate::scene::{FieldFile, FieldValue, Scene, VariableNames};
use sph::domain::{Axis, Domain};
use sph_formats::common::particle_names as names;
use sph_formats::{
    FieldRequest, FileContent, FormatSpec, Geometry, Location, RawField, Unit, UnitDimension, UnitSystem, Values,
    Variable, did_you_mean,
};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A density for the interpolant, which has none of its own here: no file has a variable of this name.
const ONES: &str = "\0";

/// The key that the interpolants' notes and errors name.
const INTERPOLATION: &str = "input.interpolation";

/// Part by which the periods of one box differ.
const SAME: f64 = 1e-6;

/// The share of the places with matter that may lie beyond a file with a note alone.
const FEW: f64 = 0.01;

/// Where the fields of a scene are evaluated.
pub(super) struct Frame<'a, const D: usize> {
    pub domain: &'a Domain<D>,
    pub base: &'a Base<D>,
    pub system: Option<UnitSystem>,
}

/// What a field has of its file.
pub(super) struct OfFile<const D: usize> {
    pub terms: Vec<Term<D>>,
    unit: Option<Unit>,
}

impl<const D: usize> OfFile<D> {
    /// That of its unit, where it has one.
    pub fn dimension(&self) -> UnitDimension {
        self.unit.as_ref().map_or(UnitDimension::NONE, |unit| unit.dimension)
    }

    /// Whether its unit, if it has one, is of `expected`; else what is wrong.
    pub fn check(&self, expected: UnitDimension) -> std::result::Result<(), String> {
        match &self.unit {
            Some(unit) if unit.dimension != expected => {
                Err(format!("is in {}, a unit of another quantity", unit.symbol))
            }
            _ => Ok(()),
        }
    }
}

/// All of the scene's, by the names of the fields.
///
/// # Errors
/// A file that cannot be read, has no such variable, missing values, or nothing where the matter is.
pub(super) fn all<const D: usize>(
    (scene, formats): (&Scene, &[FormatSpec]),
    frame: &Frame<D>,
    said: &mut Said,
) -> Result<BTreeMap<String, OfFile<D>>> {
    let mut found = BTreeMap::new();
    for (name, value) in scene.fields.stated() {
        if let FieldValue::File(input) = value {
            found.insert(name.to_owned(), Reader { name, input, frame, said }.read(formats)?);
        }
    }
    Ok(found)
}

/// What there is to say of the scene's fields.
#[derive(Default)]
pub(crate) struct Said {
    pub notes: Vec<String>,
    pub doubts: Vec<String>,
}

/// One field and its file.
struct Reader<'a, const D: usize> {
    name: &'a str,
    input: &'a FieldFile,
    frame: &'a Frame<'a, D>,
    said: &'a mut Said,
}

impl<const D: usize> Reader<'_, D> {
    fn wrong(&self, problem: impl std::fmt::Display) -> Error {
        Error::scene(format!("fields.{}", self.name), format!("'{}' {problem}", self.input.file.display()))
    }

    fn read(mut self, formats: &[FormatSpec]) -> Result<OfFile<D>> {
        let (mut raw, particles) = self.content(formats)?;
        let chosen = self.choose(&mut raw)?;
        let wanted: Vec<String> = chosen.iter().map(|v| v.name.clone()).collect();
        let unit = self.unit(&chosen)?;
        let factor = self.factor(unit.as_ref());
        let length = units_in_field(&raw).0.filter(|unit| unit.dimension == UnitDimension::LENGTH);
        let is_radial = matches!(raw.geometry, Geometry::Radial { .. });
        let mapping = Mapping {
            // From the input's numbers to the scene's, and on to the file's.
            scale: self.frame.base.length / self.factor(length.as_ref()),
            center: if is_radial { self.frame.base.center } else { [0.0; D] },
        };
        let source = self.source(raw, chosen, (particles, mapping.scale))?;
        self.cover(&source.domain, &mapping)?;
        let own = format!("fields.{}.interpolation", self.name);
        let unused = source.notes.iter().filter(|note| note.starts_with(INTERPOLATION));
        self.said.notes.extend(unused.map(|note| note.replacen(INTERPOLATION, &own, 1)));
        let mut fields = BTreeMap::new();
        for field in source.carried {
            let info = CarriedInfo { unit: None, ..field.info().clone() };
            let moved: Arc<dyn CarriedField<D>> = Arc::new(Moved { info, field, mapping, factor });
            fields.insert(moved.info().name.clone(), moved);
        }
        let mut terms = Vec::new();
        for name in &wanted {
            let Some(field) = fields.get(name) else {
                let why = source.notes.iter().find(|note| note.contains(&format!("'{name}'")));
                return Err(self.wrong(
                    why.map_or(format!("has nothing usable in '{name}'"), |why| format!("cannot be used: {why}")),
                ));
            };
            terms.extend((0..field.info().components).map(|k| Term::File(Arc::clone(field), k)));
        }
        Ok(OfFile { terms, unit })
    }

    /// What the file holds, and the domain of its particles, if it holds these.
    fn content(&self, formats: &[FormatSpec]) -> Result<(RawField, Option<Domain<D>>)> {
        let path = &self.input.file;
        match sph_formats::read(formats, path, self.input.format.as_deref(), &FieldRequest::default())? {
            FileContent::Field(field) => Ok((field, None)),
            FileContent::Particles(particles) => {
                let snapshot = Snapshot::new(path, &particles, None)?;
                let domain = (particles.header.dimension == D).then(|| snapshot.domain()).transpose()?;
                Ok((snapshot.field, domain))
            }
        }
    }

    /// The domain of a file's particles: periodic only where the scene's is as long, so that what is beyond is told.
    fn alike(&self, mut domain: Domain<D>, scale: f64) -> Domain<D> {
        let own = self.frame.domain;
        for k in 0..D {
            let lengths = [domain.hi[k] - domain.lo[k], (own.hi[k] - own.lo[k]) * scale];
            if own.axes[k] != Axis::Periodic || (lengths[0] / lengths[1] - 1.0).abs() > SAME {
                domain.axes[k] = Axis::OPEN;
            }
        }
        domain
    }

    /// Takes the variables that the scene names out of the file, else what the field's name means, else the only one.
    fn choose(&self, raw: &mut RawField) -> Result<Vec<Variable>> {
        let asked = match &self.input.variable {
            Some(VariableNames::One(name)) => vec![name.clone()],
            Some(VariableNames::Each(names)) if !names.is_empty() => names.clone(),
            Some(VariableNames::Each(_)) => {
                return Err(Error::scene(format!("fields.{}.variable", self.name), "names none"));
            }
            None => {
                raw.density = None;
                let assignments = assign(raw, D, &BTreeMap::new())?;
                apply(raw, &assignments, D)?;
                let is_it = |v: &&Variable| standard(&v.name) == standard(self.name);
                let found = raw.variables.iter().find(is_it).or(match raw.variables.as_slice() {
                    [only] => Some(only),
                    _ => None,
                });
                let Some(found) = found else {
                    let problem = format!(
                        "does not tell which variable is '{}'; name it by `variable`: {}",
                        self.name,
                        known(raw)
                    );
                    return Err(self.wrong(problem));
                };
                vec![found.name.clone()]
            }
        };
        let find = |name: &String| raw.variables.iter().find(|v| v.name == *name).cloned();
        let lost = |name: &String| {
            let hint = did_you_mean(name, raw.variables.iter().map(|v| v.name.as_str()));
            self.wrong(format!("has no variable '{name}'{hint}; it has {}", known(raw)))
        };
        let chosen = asked.iter().map(|name| find(name).ok_or_else(|| lost(name))).collect::<Result<Vec<_>>>()?;
        if let [_, _, ..] = chosen.as_slice()
            && let Some(vector) = chosen.iter().find(|v| v.components != 1)
        {
            return Err(self.wrong(format!("has {} components in '{}', one of a list", vector.components, vector.name)));
        }
        raw.variables.clear();
        Ok(chosen)
    }

    /// What the numbers are in, as far as it is known: of one unit for all components.
    fn unit(&self, chosen: &[Variable]) -> Result<Option<Unit>> {
        let Some(name) = &self.input.unit else {
            let factor = |v: &Variable| v.unit.as_ref().map(|u| (u.to_cgs, u.dimension));
            return match chosen.iter().find(|v| factor(v) != factor(&chosen[0])) {
                Some(other) => Err(self.wrong(format!(
                    "has other units in '{}' than in '{}'; name one by `unit`",
                    other.name, chosen[0].name
                ))),
                None => Ok(chosen[0].unit.clone()),
            };
        };
        match Unit::parse(name) {
            Some(_) if self.frame.system.is_none() => {
                let problem =
                    format!("is '{name}', but the scene has no units to convert it to; state them, as in `units: cgs`");
                Err(Error::scene(format!("fields.{}.unit", self.name), problem))
            }
            Some(unit) => Ok(Some(unit)),
            None => Err(Error::scene(
                format!("fields.{}.unit", self.name),
                format!("is '{name}', which is not a known unit"),
            )),
        }
    }

    /// From numbers of a unit to the scene's.
    fn factor(&mut self, unit: Option<&Unit>) -> f64 {
        let Some(unit) = unit.filter(|u| u.dimension != UnitDimension::NONE) else { return 1.0 };
        let Some(system) = &self.frame.system else {
            let note = format!(
                "'{}' has numbers in {}, which are used without conversion, since the scene has no units",
                self.input.file.display(),
                unit.symbol
            );
            self.said.notes.push(note);
            return 1.0;
        };
        unit.to_cgs / system.to_cgs(unit.dimension)
    }

    /// The interpolant of the chosen variables.
    fn source(
        &self,
        mut raw: RawField,
        mut chosen: Vec<Variable>,
        (particles, scale): (Option<Domain<D>>, f64),
    ) -> Result<Source<D>> {
        let domain = self.frame.domain;
        let mut seen = Vec::new();
        chosen.retain(|v| {
            !seen.contains(&v.name) && {
                seen.push(v.name.clone());
                true
            }
        });
        let location = chosen[0].location;
        raw.variables = vec![ones(&raw.geometry, location)];
        raw.variables.append(&mut chosen);
        let is_box = matches!(domain.region, sph::domain::Region::Box);
        let options = FieldOptions {
            density_name: Some(ONES.into()),
            periodic: domain.axes.map(|axis| (axis == Axis::Periodic).then_some(Period::Auto)),
            stated_box: is_box.then(|| [domain.lo, domain.hi].map(|corner| corner.map(|x| x * scale))),
            has_mass: false,
            interpolation: self.input.interpolation.map(interpolation),
            ..FieldOptions::default()
        };
        let source = match particles.map(|domain| self.alike(domain, scale)) {
            Some(domain) => from_particles(raw, (&domain, None), &options).map(|found| found.0),
            None => from_raw(raw, &options),
        };
        source.map_err(|error| match error {
            Error::Field { name, problem } if name == ONES => Error::scene(format!("fields.{}", self.name), problem),
            Error::Scene { key, problem } if key == INTERPOLATION => {
                Error::scene(format!("fields.{}.interpolation", self.name), problem)
            }
            other => other,
        })
    }

    /// Whether there is something where the matter is. Where it ends, its value there counts beyond, and that is said.
    fn cover(&mut self, domain: &Domain<D>, mapping: &Mapping<D>) -> Result<()> {
        let density = &self.frame.base.density;
        let places: Vec<[f64; D]> = probes(self.frame.domain).into_iter().filter(|x| density.value(x) > 0.0).collect();
        let beyond = places.iter().filter(|x| !domain.contains(&domain.wrapped(&mapping.apply(x)))).count();
        let (lo, hi) = (domain.lo, domain.hi);
        if beyond > 0 && beyond == places.len() {
            return Err(self.wrong(format!(
                "extends from {lo:?} to {hi:?} in its own units, where there is no matter: check its coordinates and \
                 their unit"
            )));
        }
        if beyond > 0 {
            let share = beyond as f64 / places.len() as f64;
            let list = if share > FEW { &mut self.said.doubts } else { &mut self.said.notes };
            list.push(format!(
                "fields.{}: '{}' extends from {lo:?} to {hi:?} in its own units: {:.2} % of the positions with matter \
                 are outside, and take the value at its edge",
                self.name,
                self.input.file.display(),
                100.0 * share
            ));
        }
        Ok(())
    }
}

fn known(raw: &RawField) -> String {
    let all: Vec<String> = raw.variables.iter().map(|v| format!("'{}'", v.name)).collect();
    if all.is_empty() { "none".into() } else { all.join(", ") }
}

fn standard(name: &str) -> &str {
    names::standard(name).unwrap_or(name)
}

fn ones(geometry: &Geometry, location: Location) -> Variable {
    let values = Values::F32(vec![1.0; geometry.count(location)]);
    Variable { name: ONES.into(), description: None, unit: None, location, components: 1, values }
}

/// From places of the input to those of the file.
#[derive(Clone, Copy)]
struct Mapping<const D: usize> {
    scale: f64,
    center: [f64; D],
}

impl<const D: usize> Mapping<D> {
    fn apply(&self, x: &[f64; D]) -> [f64; D] {
        sph::array(|k| self.scale * (x[k] - self.center[k]))
    }
}

/// A file's variable at the input's places, in the scene's units.
struct Moved<const D: usize> {
    info: CarriedInfo,
    field: Box<dyn CarriedField<D>>,
    mapping: Mapping<D>,
    factor: f64,
}

impl<const D: usize> CarriedField<D> for Moved<D> {
    fn info(&self) -> &CarriedInfo {
        &self.info
    }

    fn evaluate(&self, x: &[f64; D], out: &mut [f64]) {
        self.field.evaluate(&self.mapping.apply(x), out);
        out.iter_mut().for_each(|v| *v *= self.factor);
    }
}
