//! A scene's input as relaxation uses it: in units of its own size and mass, with the thin atmosphere removed.

use crate::error::{Error, Result};
use crate::field::{CarriedInfo, MassEstimate, ScalarField, Source, in_units_of, mass_and_pieces, probes, total_mass};
use crate::input::atmosphere::{self, Cut};
use crate::input::attractors;
use crate::input::core::{self, Core};
use crate::input::disc;
use crate::input::factor;
use crate::input::fields;
use crate::input::ingest::{self, Ingested, RawInput};
use crate::input::particles::OfSnapshot;
use crate::input::refinement::{Refinement, Sampled};
use crate::input::roles::Assignment;
use crate::input::stated_units;
use crate::input::units::RunUnits;
use crate::input::weight::Beside;
use crate::scene::{Atmosphere, CoreGas, Scene};
use crate::target::{Resolution, Target};
use sph::domain::{Domain, Region};
use sph::point_mass::PointMass;
use sph_formats::FormatSpec;

/// Quadrature of the total mass aims at this relative error.
const MASS_TOLERANCE: f64 = 1e-10;

/// Where matter is looked for beneath a round surface, in its radii.
const BENEATH: f64 = 0.999;

/// The source in units of its own size and mass.
pub(crate) struct Prepared<const D: usize> {
    pub source: Source<D>,
    resolution: Option<Box<dyn ScalarField<D>>>,
    /// The sphere of another resolution that the scene has, in internal units.
    pub refinement: Option<Refinement<D>>,
    resolution_integral: f64,
    /// See [`Target::largest_spacing`].
    largest_spacing: f64,
    /// Number of particles that it is prepared for.
    count: usize,
    /// Input units of length and mass per internal one.
    pub length: f64,
    pub mass: MassEstimate,
    /// Shares of the mass that pieces of the density have, by their numbers, where these are known.
    pieces: Option<Vec<(u64, f64)>>,
    pub notes: Vec<String>,
    /// What is probably not meant.
    pub doubts: Vec<String>,
    /// What was cut of an atmosphere.
    pub cut: Option<Cut>,
    /// Mass of all of the input, in its units, where the scene's domain is another.
    pub input_mass: Option<f64>,
    /// What the variables of the input are taken for.
    pub variables: Vec<Assignment>,
    /// A point mass in the center, in the input's units.
    pub core: Option<Core<D>>,
    /// Bodies about the same center that are not among the particles, in internal units; none before they are attached.
    pub beside: Beside,
    /// Where the input is particles.
    pub of_snapshot: Option<OfSnapshot>,
}

impl<const D: usize> Prepared<D> {
    /// Radius of a ball that the matter fills, with what was cut of its atmosphere.
    pub fn surface(&self) -> Option<f64> {
        match self.source.domain.region {
            Region::Ball { radius, .. } if self.source.radial.is_some() || self.is_filled() => {
                Some(radius / self.cut.map_or(1.0, |cut| cut.radius))
            }
            _ => None,
        }
    }

    /// Whether there is matter all along the surface of a round domain, by looks at it.
    fn is_filled(&self) -> bool {
        let domain = &self.source.domain;
        let Some(round) = domain.region.round() else { return false };
        let onto = |x: [f64; D]| {
            Some(round.distance(&x)).filter(|r| *r > 0.0).map(|r| round.scaled(&x, BENEATH * round.radius / r))
        };
        probes(domain).into_iter().filter_map(onto).all(|x| self.source.density.value(&x) > 0.0)
    }

    /// [`Prepared::new`] of the scene's input, read now.
    ///
    /// # Errors
    /// What the reader says, and as for [`Prepared::new`].
    pub fn read(scene: &Scene, formats: &[FormatSpec], count: usize) -> Result<Self> {
        let raw = ingest::read(scene, formats)?;
        let units = RunUnits::new(scene, stated_units::units(scene, &raw)?.input)?;
        Self::new(scene, formats, (raw, &units), count)
    }

    /// Source, atmosphere cut for `count` particles, mass, and the change to internal units. `units` are
    /// those of the scene and of the input.
    ///
    /// # Errors
    /// A field that is no density, or one without a positive finite mass.
    pub fn new(
        scene: &Scene,
        formats: &[FormatSpec],
        (raw, units): (RawInput, &RunUnits),
        count: usize,
    ) -> Result<Self> {
        let sampled = Sampled::<D>::of(scene, &raw);
        let ingested = match raw {
            RawInput::Disc(numbers) => disc::source::<D>(scene, formats, (&numbers, units))?,
            RawInput::Hydrostatic(numbers) => {
                let mut field = attractors::hydrostatic(scene, formats, (&numbers, units))?;
                let notes = std::mem::take(&mut field.notes);
                let mut ingested = ingest::source::<D>(scene, formats, RawInput::File(Box::new(field)), units)?;
                // Those of what was read are said by who read it.
                ingested.source.notes.extend(notes);
                ingested
            }
            raw => ingest::source::<D>(scene, formats, raw, units)?,
        };
        let Ingested { source, variables, input_mass, of_snapshot } = ingested;
        let (source, doubts) = fields::attach((scene, formats), source, &units.to_input())?;
        let source = factor::apply(scene, source, &units.to_input())?;
        let (mut source, core) = core::attach(scene, source, units)?;
        // What the point takes is no gas.
        let replaced = core.filter(|_| scene.input.core.as_ref().is_some_and(|c| c.gas != CoreGas::Keep));
        // What a factor makes of the whole is not known.
        let input_mass = input_mass.filter(|_| scene.input.factor.is_none());
        let input_mass = input_mass.map(|m| m - replaced.map_or(0.0, |c| c.point.mass));
        let keep = scene.input.atmosphere == Atmosphere::Keep || scene.has_own_resolution();
        let atmosphere = atmosphere::cut(&mut source, count, keep);
        let largest_spacing = atmosphere.as_ref().map_or(f64::INFINITY, |a| a.largest_spacing);
        let cut = atmosphere.as_ref().and_then(|a| a.cut);
        let mut notes = Vec::from_iter(atmosphere.and_then(|a| a.note));
        let (mass, pieces) = match source.mass {
            Some(mass) => (mass, None),
            None => mass_and_pieces(source.density.as_ref(), &source.domain, MASS_TOLERANCE)?,
        };
        let pieces = pieces.map(|all| all.iter().map(|p| (p.0, p.1.value / mass.value)).collect());
        if !(mass.value > 0.0) && input_mass.is_some() {
            return Err(Error::scene(
                "domain",
                "holds none of the input's mass: check its place and its units (plain numbers are in the scene's `units`)",
            ));
        }
        let length = source.domain.size();
        let density = density_factor::<D>(mass.value, length)?;
        let resolution = ingest::resolution(scene, formats, &source.domain, &units.to_input())?;
        let mut resolution = resolution.map(|field| in_units_of(length, field));
        let time = sampled.as_ref().map_or(0.0, |s| s.time);
        let of_scene = |r| Refinement::new(r, &source.domain, &units.to_input(), time);
        let refinement = scene.refine.as_ref().map(of_scene).transpose()?;
        let sampled = sampled.zip(refinement.as_ref()).filter(|_| resolution.is_none());
        let mean_factor = sampled.map(|(sampled, refinement)| sampled.mean_factor(refinement));
        let mut source = source.scaled(1.0 / length, density);
        let refinement = refinement.map(|r| r.scaled(1.0 / length));
        if let Some(refinement) = &refinement {
            let (shared, finer) = refinement.apply(source, resolution);
            (source, resolution) = (shared, Some(finer));
        }
        let resolution_integral = match (&resolution, mean_factor) {
            (None, _) => 1.0,
            (Some(_), Some(mean)) => mean,
            (Some(field), None) => {
                total_mass(field.as_ref(), &source.domain, MASS_TOLERANCE).map_err(of_resolution)?.value
            }
        };
        if !(resolution_integral > 0.0 && resolution_integral.is_finite()) {
            return Err(Error::field("resolution", "its number density has no positive integral over the domain"));
        }
        let largest_spacing = (largest_spacing / length).min(spacing_of_one(&source.domain));
        notes.extend(source.notes.iter().cloned());
        Ok(Self {
            source,
            resolution,
            refinement,
            resolution_integral,
            largest_spacing,
            count,
            length,
            mass,
            pieces,
            notes,
            doubts,
            cut,
            input_mass,
            variables,
            core,
            beside: Beside::default(),
            of_snapshot: of_snapshot.map(|s| OfSnapshot { totals: s.totals.less_stated(scene), ..s }),
        })
    }

    /// The point mass in the center, in internal units.
    pub fn point_mass(&self) -> Option<PointMass<D>> {
        self.core.map(|core| core.scaled(self.length, self.mass.value))
    }

    /// What a carried field is called in the input.
    pub fn name_of<'a>(&'a self, carried: &'a CarriedInfo) -> &'a str {
        let own = self.variables.iter().find(|v| v.column == carried.name);
        own.map_or(carried.name.as_str(), |v| v.variable.as_str())
    }

    /// What placement aims at.
    pub fn target(&self) -> Target<'_, D> {
        Target {
            domain: &self.source.domain,
            density: self.source.density.as_ref(),
            resolution: match &self.resolution {
                None => Resolution::EqualMass,
                Some(field) => Resolution::NumberDensity(field.as_ref()),
            },
            count: self.count,
            mass: 1.0,
            resolution_integral: self.resolution_integral,
            largest_spacing: self.largest_spacing,
            pieces: self.pieces.as_deref(),
            part: None,
        }
    }
}

/// The spacing of a single particle in the box about a domain. A larger one means nothing, and in a thin box its support would
/// reach through all the images of the box.
fn spacing_of_one<const D: usize>(domain: &Domain<D>) -> f64 {
    domain.extent().iter().product::<f64>().powf(1.0 / D as f64).min(domain.size())
}

/// What is said of the integral of a number density.
fn of_resolution(error: Error) -> Error {
    match error {
        Error::Field { problem, .. } => {
            Error::field("resolution", problem.replace("the mass", "the integral of its number density"))
        }
        other => other,
    }
}

/// Internal units of density per input unit.
fn density_factor<const D: usize>(mass: f64, length: f64) -> Result<f64> {
    if !(mass > 0.0 && mass.is_finite()) {
        return Err(Error::field(
            "density",
            format!("its integral over the domain is {mass}, expected a positive mass"),
        ));
    }
    let density = length.powi(D as i32) / mass;
    if !(density.is_finite() && density > 0.0) {
        return Err(Error::field(
            "density",
            format!("mass {mass:e} in a domain of size {length:e} is beyond f64; choose larger or smaller units"),
        ));
    }
    Ok(density)
}
