//! The plan in order: input -> source -> target -> seed -> relaxation -> carried fields -> measures -> file.
//! The only place where the run-time dimension and kernel become types, and where formats meet placement.

use crate::error::{Error, Result};
use crate::input::hydrostatics::Hydrostatics;
use crate::input::ingest::{self, InputUnits, RawInput};
use crate::input::internal_units::Prepared;
use crate::metrics::{DensityError, Outcome, Thermodynamics};
use crate::output::columns::{self, EnergySource};
use crate::relaxation::{Control, StopReason};
use crate::run::plan::Plan;
use crate::run::report::{MassReport, Report, Timing};
use crate::run::stages::{self, Relaxed};
use crate::scene::{CheckpointInput, DEFAULT_PARTICLES, Scene};
use crate::target::{Positions, Target};
use rayon::prelude::*;
use sph::domain::{Axis, Domain};
use sph::reduce;
use sph_formats::common::particle_names as names;
use sph_formats::{
    Column, FormatSpec, ParticleFile, ParticleTable, RunHeader, Species, UnitDimension, UnitSystem, Values,
    WriteOptions, registry,
};
use std::path::Path;
use std::time::Instant;

/// Runs a scene from input to output file.
///
/// # Errors
/// Any of [`Error`]; nothing is left half-written.
pub fn run(scene: &Scene, formats: &[FormatSpec], control: &Control<'_>) -> Result<Report> {
    scene.validate()?;
    let output = scene.output.file.as_deref().ok_or_else(|| Error::scene("output.file", "is missing (--out FILE)"))?;
    let format = registry::detect_output(formats, output, scene.output.format.as_deref())?;
    registry::writer(format, output)?;
    refuse_overwriting_inputs(scene, output)?;
    sph_formats::output::probe(output)?;
    let start = Instant::now();
    let raw = ingest::read(scene, formats)?;
    let mut notes = Vec::new();
    let units = ingest::units(scene, &raw, &mut notes)?;
    if let Some(field) = raw.field() {
        notes.extend(field.notes.iter().cloned());
    }
    let dimension = ingest::dimension(scene, &raw)?;
    refuse_what_the_format_cannot_hold(scene, format, dimension)?;
    let timing = vec![Timing { step: "read", seconds: start.elapsed().as_secs_f64(), epsilon: None }];
    let run = Run { scene, formats, format, output, control, units, start, timing, notes };
    match dimension {
        1 => run.in_dimension::<1>(raw),
        2 => run.in_dimension::<2>(raw),
        _ => run.in_dimension::<3>(raw),
    }
}

/// Renaming the output, or a checkpoint, onto an input would destroy it, so that the run could not be repeated.
fn refuse_overwriting_inputs(scene: &Scene, output: &Path) -> Result<()> {
    let checkpoint = scene.checkpoint.file.as_deref();
    if checkpoint == Some(output) {
        return Err(Error::scene("checkpoint.file", "is the output file as well; name another"));
    }
    for (key, written) in [("output.file", Some(output)), ("checkpoint.file", checkpoint)] {
        let Some(written) = written.and_then(|w| w.canonicalize().ok()) else { continue };
        let inputs = [&scene.input.file, scene.resolution.as_ref().map_or(&None, |r| &r.file)];
        for input in inputs.into_iter().flatten() {
            if input.canonicalize().is_ok_and(|i| i == written) {
                let problem = format!("is the input file '{}', which it would replace; name another", input.display());
                return Err(Error::scene(key, problem));
            }
        }
    }
    Ok(())
}

/// Before the long work: what the writer would refuse at its end.
fn refuse_what_the_format_cannot_hold(scene: &Scene, format: &FormatSpec, dimension: usize) -> Result<()> {
    let can = format.capabilities;
    if !can.dimensions.contains(&dimension) {
        let known = can.dimensions.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
        let problem = format!("'{}' holds particles in {known} dimensions, but these are in {dimension}", format.name);
        return Err(Error::scene("output.format", problem));
    }
    if can.equal_masses && (scene.has_own_resolution() || scene.trim_masses.is_some()) {
        let problem = format!(
            "'{}' holds one mass for all particles of a type; leave out resolution and trim_masses, or choose another",
            format.name
        );
        return Err(Error::scene("output.format", problem));
    }
    Ok(())
}

/// A run under way.
struct Run<'a> {
    scene: &'a Scene,
    formats: &'a [FormatSpec],
    format: &'a FormatSpec,
    output: &'a Path,
    control: &'a Control<'a>,
    units: Option<InputUnits>,
    start: Instant,
    timing: Vec<Timing>,
    notes: Vec<String>,
}

impl Run<'_> {
    fn lap(&mut self, step: &'static str, since: Instant, epsilon: Option<f64>) {
        self.timing.push(Timing { step, seconds: since.elapsed().as_secs_f64(), epsilon });
    }

    fn in_dimension<const D: usize>(mut self, raw: RawInput) -> Result<Report> {
        let lap = Instant::now();
        let count = self.scene.particles.unwrap_or(DEFAULT_PARTICLES);
        let scaled = Prepared::<D>::new(self.scene, self.formats, raw, count)?;
        self.notes.extend(scaled.notes.iter().cloned());
        self.lap("interpolate", lap, None);
        let target = scaled.target();
        let plan = Plan::new(self.scene, &target, scaled.source.radial.is_some());
        self.place(&target, &scaled, plan)
    }

    fn place<const D: usize>(mut self, target: &Target<'_, D>, scaled: &Prepared<D>, mut plan: Plan) -> Result<Report> {
        let kernel = self.scene.kernel;
        let neighbors = self.scene.kernel_neighbors(D);
        let thermodynamics = Hydrostatics::new(self.scene, scaled, self.units)?;
        let mut relaxed = stages::place(self.scene, &mut plan, target, neighbors, self.control)?;
        let balanced = match &thermodynamics {
            Some(h) if plan.balance > 0 => {
                self.notes.push(format!("balanced {}", h.describe()));
                Some(stages::balance((self.scene, &plan), target, h, neighbors, &mut relaxed, self.control)?)
            }
            _ => None,
        };
        let masses = stages::masses(self.scene, &mut plan, target, &mut relaxed, neighbors, self.control)?;
        let Relaxed { positions, stages, timing, notes, stop } = relaxed;
        self.timing.extend(timing);
        self.notes.extend(notes);
        let lap = Instant::now();
        let Outcome {
            masses,
            support,
            density,
            target_density: wanted,
            density_error,
            noise,
            neighbors: neighbor_figures,
            balance,
        } = {
            let thermodynamics = thermodynamics
                .as_ref()
                .map(|h| Thermodynamics { equilibrium: h, internal_energy: balanced.as_deref() });
            Outcome::new(kernel, target, &positions, masses, neighbors, thermodynamics.as_ref())
        };
        let balanced = balanced.zip(thermodynamics.as_ref()).map(|(u, h)| (u, h.specific_energy));
        if !density_error.all.epsilon.is_finite() {
            return Err(Error::Numeric {
                stage: "measure",
                problem: format!(
                    "the summed density of {} particles is beyond f64 where the target is steepest; bound the density there, as by 1/max(r, 1e-6) for 1/r",
                    target.count
                ),
            });
        }
        self.lap("measure", lap, Some(density_error.all_refitted.epsilon));
        let verdict = self.verdict(stop, &density_error);
        let lap = Instant::now();
        let out = self.output_units(scaled.mass.value, D)?;
        let factors = Factors::new::<D>(self.units, scaled, &out);
        let mass = self.mass_report(&masses, scaled, &factors, &out, D);
        let raw_columns = RawColumns { positions: &positions, masses, support, density, wanted, balanced };
        let file =
            self.particle_file(scaled, raw_columns, &factors, out, (kernel.title(), neighbors, verdict), &mut plan)?;
        let options = WriteOptions {
            compression: self.scene.output.compression,
            double_precision: self.scene.output.double_precision,
        };
        sph_formats::write(self.formats, self.output, Some(self.format.name), &file, options)?;
        self.lap("write", lap, None);
        self.remove_checkpoint(stop);
        Ok(Report {
            input: self.scene.input_name(),
            output: self.output.display().to_string(),
            format: self.format.name,
            dimension: D,
            particles: target.count,
            seed: self.scene.seed,
            kernel: kernel.title(),
            mass,
            stop: verdict,
            density_error,
            noise,
            balance,
            neighbors: neighbor_figures,
            stages,
            timing: self.timing,
            seconds: self.start.elapsed().as_secs_f64(),
            plan,
            notes: self.notes,
        })
    }

    /// Whether a tolerance is met is for the error to say that the report states, not for what stages watch.
    fn verdict(&self, stop: StopReason, measured: &DensityError) -> StopReason {
        let Some(tolerance) = self.scene.tolerance.filter(|_| stop != StopReason::Interrupted) else { return stop };
        match (measured.stated().epsilon <= tolerance, stop) {
            (true, _) => StopReason::ToleranceReached,
            (false, StopReason::ToleranceReached) => StopReason::ToleranceMissed,
            (false, _) => stop,
        }
    }

    /// Removes the checkpoint of a run that has come to its end.
    fn remove_checkpoint(&mut self, stop: StopReason) {
        let Some(file) = self.scene.checkpoint.file.as_deref().filter(|f| f.is_file()) else { return };
        if matches!(stop, StopReason::Interrupted | StopReason::TimeLimit) {
            return;
        }
        if let Err(e) = std::fs::remove_file(file) {
            self.notes
                .push(format!("the checkpoint '{}' is of no more use but cannot be removed: {e}", file.display()));
        }
    }

    /// The unit system of the output: the scene's, or the one that suits a body of this mass.
    fn output_units(&mut self, mass: f64, d: usize) -> Result<UnitSystem> {
        if let Some(name) = &self.scene.output.units {
            return UnitSystem::by_name(name).ok_or_else(|| {
                Error::scene(
                    "output.units",
                    format!("is '{name}', expected cgs, si, solar, planetary, galactic or code"),
                )
            });
        }
        let Some(units) = self.units else { return Ok(UnitSystem::CODE) };
        if d < 3 {
            return Ok(UnitSystem::cgs());
        }
        let grams = mass * units.density * units.length.powi(3);
        let (name, system) = match grams {
            g if !(1e22..1e50).contains(&g) => ("cgs", UnitSystem::cgs()),
            g if g < 1e30 => ("planetary", UnitSystem::planetary()),
            g if g < 1e38 => ("solar", UnitSystem::solar()),
            _ => ("galactic", UnitSystem::galactic()),
        };
        self.notes
            .push(format!("output in {name} units, which suit a mass of {grams:.3e} g (output.units chooses others)"));
        Ok(system)
    }

    fn mass_report<const D: usize>(
        &self,
        masses: &[f64],
        scaled: &Prepared<D>,
        factors: &Factors,
        out: &UnitSystem,
        d: usize,
    ) -> MassReport {
        let total = scaled.mass.value * factors.input_mass;
        let summed = reduce::sum(masses.len(), |i| masses[i] * factors.mass);
        let fold = |f: fn(f64, f64) -> f64, start: f64| masses.iter().fold(start, |m, &v| f(m, v)) * factors.mass;
        MassReport {
            total,
            quadrature_error: scaled.mass.error / scaled.mass.value,
            smallest: fold(f64::min, f64::INFINITY),
            largest: fold(f64::max, 0.0),
            defect: (summed - total) / total,
            total_cgs: (self.units.is_some() && d == 3).then_some(total * out.mass),
        }
    }

    fn particle_file<const D: usize>(
        &mut self,
        scaled: &Prepared<D>,
        raw: RawColumns<'_, D>,
        factors: &Factors,
        units: UnitSystem,
        (kernel, kernel_neighbors, stop): (&str, f64, StopReason),
        plan: &mut Plan,
    ) -> Result<ParticleFile> {
        let domain = &scaled.source.domain;
        let n = raw.masses.len();
        let frame = Frame::new(domain, self.scene.output.box_factor);
        if frame.isolated {
            self.notes.push(format!(
                "the body is moved to the middle of a box of edge {:.6e} (output.box_factor {})",
                frame.box_size[0] * factors.length,
                self.scene.output.box_factor
            ));
        }
        let mut carried: Vec<Column> =
            scaled.source.carried.iter().map(|f| columns::column(f.as_ref(), raw.positions, &units)).collect();
        let physical: Positions<D> =
            std::array::from_fn(|k| raw.positions[k].par_iter().map(|x| x * factors.length).collect());
        let moved = columns::velocities(
            &mut carried,
            &physical,
            &domain.scaled(factors.length),
            radial_in(scaled, factors.length).as_ref(),
            &self.scene.motion,
        )?;
        if !self.scene.material.is_empty() {
            let radial = radial_in(scaled, factors.length);
            let middle = radial.map_or_else(|| domain.scaled(factors.length).center(), |r| r.center);
            carried.retain(|c| c.name != names::MATERIAL_IDS);
            carried.push(columns::materials(&physical, &middle, &self.scene.material));
        }
        drop(physical);
        let target_density: Vec<f64> = raw.wanted.iter().map(|r| r * factors.density).collect();
        let requires_energy = self.format.capabilities.requires.contains(&names::INTERNAL_ENERGY);
        let energy_unit = if self.units.is_some() { 1.0 / units.to_cgs(UnitDimension::SPECIFIC_ENERGY) } else { 1.0 };
        let balanced =
            raw.balanced.map(|(u, unit)| u.into_par_iter().map(|u| u * unit * energy_unit).collect::<Vec<f64>>());
        let thermal = &self.scene.thermal;
        match columns::internal_energy(&mut carried, &target_density, thermal, balanced, requires_energy)? {
            EnergySource::Placeholder => self.notes.push(
                "nothing thermal came in, but the format needs InternalEnergy: it is set to 1 everywhere; set thermal.internal_energy".into(),
            ),
            EnergySource::NotWritten => plan.drop("InternalEnergy", "nothing thermal came in"),
            EnergySource::Pressure => self.notes.push(format!(
                "InternalEnergy is P/((gamma - 1) rho) from the carried pressure, gamma = {}", self.scene.thermal.gamma
            )),
            EnergySource::Carried | EnergySource::Given | EnergySource::Balanced => {}
        }
        drop(target_density);
        if moved.is_none() {
            plan.drop("velocities", "nothing moves");
        }
        let column = |name: &str, components: usize, values: Values, dimension: UnitDimension| Column {
            name: name.into(),
            components,
            values,
            dimension,
        };
        let scaled_values = |v: Vec<f64>, factor: f64| Values::F64(v.into_par_iter().map(|x| x * factor).collect());
        let mass_dimension = UnitDimension::new(D as i8 - 3, 1, 0, 0);
        let mut columns = vec![
            column(
                names::COORDINATES,
                D,
                Values::F64(frame.coordinates(raw.positions, factors.length)),
                UnitDimension::LENGTH,
            ),
            column(names::MASSES, 1, scaled_values(raw.masses, factors.mass), mass_dimension),
            column(names::SUPPORT_RADIUS, 1, scaled_values(raw.support, factors.length), UnitDimension::LENGTH),
            column(names::DENSITY, 1, scaled_values(raw.density, factors.density), UnitDimension::mass_density(3)),
            column(names::PARTICLE_IDS, 1, Values::I64((1..=n as i64).collect()), UnitDimension::NONE),
        ];
        if let Some(v) = moved {
            columns.push(column(names::VELOCITIES, D, Values::F64(v), UnitDimension::VELOCITY));
        }
        carried.retain(|c| !columns.iter().any(|own| own.name == c.name));
        columns.extend(carried);
        let header = RunHeader {
            dimension: D,
            box_size: frame.box_size.map(|b| b * factors.length),
            periodic: std::array::from_fn(|k| k < D && domain.axes[k] == Axis::Periodic),
            units,
            time: 0.0,
            kernel: kernel.into(),
            kernel_neighbors,
            provenance: self.provenance(stop),
        };
        Ok(ParticleFile { header, species: vec![Species { part_type: 0, table: ParticleTable { count: n, columns } }] })
    }

    fn provenance(&self, stop: StopReason) -> Vec<(String, String)> {
        // The recipe must not depend on where the output goes.
        let mut recipe = self.scene.clone();
        recipe.output.file = None;
        recipe.checkpoint = CheckpointInput::default();
        vec![
            ("Version".into(), format!("sph-prep {}", env!("CARGO_PKG_VERSION"))),
            ("Seed".into(), self.scene.seed.to_string()),
            ("StopReason".into(), format!("{stop:?}")),
            ("Scene".into(), recipe.to_yaml()),
        ]
    }
}

/// Columns in internal units.
struct RawColumns<'a, const D: usize> {
    positions: &'a Positions<D>,
    masses: Vec<f64>,
    support: Vec<f64>,
    density: Vec<f64>,
    wanted: Vec<f64>,
    /// Internal energies, and the unit of them in cgs (or in the input's numbers).
    balanced: Option<(Vec<f64>, f64)>,
}

/// Output units per internal unit.
struct Factors {
    length: f64,
    mass: f64,
    density: f64,
    /// Output units of mass per input unit.
    input_mass: f64,
}

impl Factors {
    fn new<const D: usize>(units: Option<InputUnits>, scaled: &Prepared<D>, out: &UnitSystem) -> Self {
        let (length, density) = units
            .map_or((1.0, 1.0), |u| (u.length / out.length, u.density / out.to_cgs(UnitDimension::mass_density(3))));
        let input_mass = density * length.powi(D as i32);
        let mass = scaled.mass.value * input_mass;
        let size = scaled.length * length;
        Self { length: size, mass, density: mass / size.powi(D as i32), input_mass }
    }
}

fn radial_in<const D: usize>(scaled: &Prepared<D>, factor: f64) -> Option<crate::field::RadialSource<D>> {
    let mut radial = scaled.source.radial.clone()?;
    radial.center = radial.center.map(|v| v * factor);
    Some(radial)
}

/// Where the domain lies in the box of the output, in internal units.
struct Frame<const D: usize> {
    /// Added to coordinates.
    shift: [f64; D],
    box_size: [f64; 3],
    periodic: [bool; D],
    isolated: bool,
}

impl<const D: usize> Frame<D> {
    /// Axes with vacuum beyond get `box_factor` times the body's extent, the same on all of them; others keep
    /// theirs, with the corner at the origin.
    fn new(domain: &Domain<D>, box_factor: f64) -> Self {
        let open: [bool; D] = std::array::from_fn(|k| !domain.has_faces(k) || domain.axes[k] == Axis::OPEN);
        let edge = box_factor * domain.size();
        let mut frame = Self {
            shift: [0.0; D],
            box_size: [0.0; 3],
            periodic: domain.axes.map(|a| a == Axis::Periodic),
            isolated: open.contains(&true),
        };
        for k in 0..D {
            let extent = domain.hi[k] - domain.lo[k];
            frame.box_size[k] = if open[k] { edge } else { extent };
            frame.shift[k] = 0.5 * (frame.box_size[k] - extent) - domain.lo[k];
        }
        frame
    }

    /// Interleaved coordinates in `[0, box)`, times `factor`.
    fn coordinates(&self, positions: &Positions<D>, factor: f64) -> Vec<f64> {
        let mut out = vec![0.0; D * positions[0].len()];
        out.par_chunks_mut(D).enumerate().for_each(|(i, out)| {
            for k in 0..D {
                let edge = self.box_size[k] * factor;
                let x = (positions[k][i] + self.shift[k]) * factor;
                out[k] = if x < edge {
                    x.max(0.0)
                } else if self.periodic[k] {
                    0.0
                } else {
                    edge.next_down()
                };
            }
        });
        out
    }
}
