//! The destination of a run's result: its format, the checks before the run starts, and the writing of the file.

use super::checkpoint::refuse_other_content;
use super::drawings::{self, Drawing};
use super::grading::of_code;
use super::verdict::Finding;
use crate::codes::TargetCode;
use crate::error::{Error, Result};
use crate::input::ingest::RawInput;
use crate::input::internal_units::Prepared;
use crate::output::frame::Frame;
use crate::output::origin;
use crate::output::parameters::{self, Doubts, Physics};
use crate::output::walls::Walls;
use crate::scene::{Conversion, Scene, is_heat};
use sph::domain::Axis;
use sph_formats::common::particle_names as names;
use sph_formats::halvings;
use sph_formats::{
    FormatError, FormatSpec, ParticleFile, ParticleStream, Species, WriteOptions, registry, would_be_lost, write_stream,
};
use std::path::{Path, PathBuf};

/// The output file of a scene, of which is known that it can be written.
pub struct Destination<'a> {
    path: &'a Path,
    /// `path`, unless there are several.
    files: Vec<PathBuf>,
    /// None of a picture.
    pub(super) format: Option<&'a FormatSpec>,
}

impl<'a> Destination<'a> {
    /// Tries the place and the format.
    ///
    /// # Errors
    /// No output file, no format that can be written, or a place that cannot.
    pub fn new(scene: &'a Scene, formats: &'a [FormatSpec]) -> Result<Self> {
        let missing = || Error::scene("output.file", "is missing (--out FILE)");
        let path = scene.output.file.as_deref().ok_or_else(missing)?;
        drawings::refuse(scene)?;
        let format = intended_format(scene, formats)?;
        format.map_or(Ok(()), |format| registry::writer(format, path).map(|_| ()))?;
        let files = match format {
            Some(format) => registry::output_files(format, path, scene.output.files)?,
            None if scene.output.files == 1 => vec![path.to_owned()],
            None => return Err(Error::scene("output.files", "is more than 1, but a picture is one file")),
        };
        if let (Some(format), Some(units)) = (format, &scene.output.units) {
            refuse_units_that_look_pure(format, "output.units", units)?;
        }
        if let Some(code) = scene.code().filter(|_| scene.output.parameters) {
            parameters::refuse_overwriting(code, path, scene.output.no_clobber)?;
        }
        if let Some(page) = scene.output.report.as_deref() {
            if page == path {
                return Err(Error::scene("output.report", "is the output file as well; name another"));
            }
            refuse_clobbering("output.report", page, scene.output.no_clobber)?;
            sph_formats::output::probe(page)?;
        }
        Ok(Self { path, files, format })
    }

    /// Refuses to write over what `scene` reads.
    ///
    /// # Errors
    /// An input that is the output or the checkpoint.
    pub fn refuse_overwriting_inputs(&self, scene: &Scene) -> Result<()> {
        for path in &self.files {
            refuse_overwriting_inputs(scene, path)?;
            refuse_clobbering("output.file", path, scene.output.no_clobber)?;
            sph_formats::output::probe(path)?;
        }
        scene.checkpoint.file.as_deref().map_or(Ok(()), refuse_other_content)
    }

    /// Writes the file, and parameters beside it where the scene asks for them. `drawing` is
    /// what pictures show beside the file, and `physics` what the scene says of what is not in it.
    ///
    /// # Errors
    /// What the writer says.
    pub(super) fn write(
        &self,
        scene: &Scene,
        formats: &[FormatSpec],
        (file, drawing): (&ParticleFile, &Drawing),
        physics: Physics,
    ) -> Result<Written> {
        let options = scene.output.write_options();
        let replaced: Vec<String> = self.files.iter().filter_map(|path| replaced(path)).collect();
        let mut notes = Vec::new();
        match self.format {
            Some(format) => {
                let (name, count) = (Some(format.name), scene.output.files);
                let written = sph_formats::write_files(formats, self.path, name, file, count, options)?;
                notes.extend(several(&written));
            }
            None => drawing.write_picture(file, self.path)?,
        }
        notes.extend(replaced);
        let Some(code) = scene.code() else { return Ok(Written { notes, doubts: Doubts::default() }) };
        let of = (self.path, self.format.map(|f| f.name));
        if !scene.output.parameters {
            return Ok(Written { notes, doubts: parameters::doubts_of(code, of, file, physics) });
        }
        let beside = parameters::beside(code, of, file, physics)?;
        for (path, text) in beside.files {
            write_text(&path, &text)?;
            notes.push(format!("parameters for {} are in '{}'", code.sheet.title, path.display()));
        }
        Ok(Written { notes, doubts: beside.doubts })
    }
}

/// What there is to say of a file that was written.
pub(super) struct Written {
    notes: Vec<String>,
    /// What the scene's code will not make of it as the scene means it.
    doubts: Doubts,
}

impl Written {
    /// Adds it to the `notes` of a report, and what it means to the verdict.
    pub fn tell(self, notes: &mut Vec<String>, verdict: &mut Vec<Finding>) {
        verdict.extend(of_code(self.doubts.stops.len(), self.doubts.others.len()));
        notes.extend(self.notes);
        notes.extend(self.doubts.texts().cloned());
    }
}

/// Refuses to replace what is there where that is asked for, be it a link to what is not there yet.
///
/// # Errors
/// That.
pub(crate) fn refuse_clobbering(key: &str, path: &Path, no_clobber: bool) -> Result<()> {
    match no_clobber && path.symlink_metadata().is_ok() {
        true => {
            let problem = format!("'{}' is there already, and --no-clobber is set; name another", path.display());
            Err(Error::scene(key, problem))
        }
        false => Ok(()),
    }
}

/// Writes particles row by row.
///
/// # Errors
/// What the writer says.
pub(super) fn write_rows(
    scene: &Scene,
    formats: &[FormatSpec],
    (format, path): (&FormatSpec, &Path),
    (stream, has_units): (&dyn ParticleStream, bool),
) -> Result<Written> {
    let (older, doubts) = (replaced(path), doubts_of_code(scene, format, (stream, has_units))?);
    let options = scene.output.write_options();
    let files = write_stream(formats, path, Some(format.name), stream, scene.output.files, options)?;
    Ok(Written { notes: older.into_iter().chain(several(&files)).collect(), doubts })
}

/// What the scene's code will not make of particles that are made while they are written, whose input has units of time and mass or none.
///
/// # Errors
/// Rows that cannot be made.
pub(super) fn doubts_of_code(
    scene: &Scene,
    format: &FormatSpec,
    (stream, has_units): (&dyn ParticleStream, bool),
) -> Result<Doubts> {
    let Some((code, path)) = scene.code().zip(scene.output.file.as_deref()) else { return Ok(Doubts::default()) };
    parameters::doubts_of_stream(code, (path, Some(format.name)), stream, Physics::of(scene, has_units))
}

/// Before a file is written: what there will be to note if it is there already.
fn replaced(path: &Path) -> Option<String> {
    path.exists().then(|| format!("an older '{}' was replaced (--no-clobber refuses that)", path.display()))
}

/// What there is to note of more than one file.
fn several(files: &[PathBuf]) -> Option<String> {
    let [first, .., last] = files else { return None };
    Some(format!("the particles are in {} files: '{}' to '{}'", files.len(), first.display(), last.display()))
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    let written = |temporary: &Path| std::fs::write(temporary, text).map_err(|e| FormatError::io(path, "write", e));
    Ok(sph_formats::output::atomically(path, written)?)
}

/// Refuses cgs for Phantom: it takes units of 1 for pure numbers, in which the constant of gravity is 1.
///
/// # Errors
/// The remedy.
pub(crate) fn refuse_units_that_look_pure(format: &FormatSpec, key: &str, units: &str) -> Result<()> {
    match (format.name, units) {
        ("phantom", "cgs") => {
            let problem = "is cgs, which Phantom takes for pure numbers, with a constant of gravity of 1; leave it out, or choose solar, planetary, \
                           galactic or si";
            Err(Error::scene(key, problem))
        }
        _ => Ok(()),
    }
}

/// Before the long work: what the writer would refuse at its end.
pub fn refuse_what_the_format_cannot_hold(scene: &Scene, format: &FormatSpec, dimension: usize) -> Result<()> {
    let can = format.capabilities;
    if !can.dimensions.contains(&dimension) {
        let known = can.dimensions.iter().map(usize::to_string).collect::<Vec<_>>().join(", ");
        let problem = format!("'{}' holds particles in {known} dimensions, but these are in {dimension}", format.name);
        return Err(Error::scene("output.format", problem));
    }
    if can.equal_masses && (scene.has_own_resolution() || scene.trim_masses.is_some()) {
        let problem = format!(
            "'{}' holds one mass for all particles of a type; leave out resolution, refine and trim_masses, or choose another",
            format.name
        );
        return Err(Error::scene("output.format", problem));
    }
    Ok(())
}

/// Refuses gas without heat before the work, where the format is for codes that do not start with none.
///
/// # Errors
/// The remedy.
pub fn refuse_cold(scene: &Scene, format: &FormatSpec, raw: &RawInput) -> Result<()> {
    let is_needed = format.capabilities.requires.contains(&names::INTERNAL_ENERGY);
    let cold = scene.fields.stated().find(|(name, value)| is_needed && is_heat(name) && value.is_never_positive());
    if let Some((name, _)) = cold {
        let problem = format!("is not positive anywhere, and '{}' needs an internal energy that is", format.name);
        return Err(Error::scene(format!("fields.{name}"), problem));
    }
    let is_given = scene.states_heat() || scene.balance.is_on() || scene.collisionless.is_some();
    match raw {
        RawInput::Snapshot(snapshot) if is_needed && !is_given && snapshot.is_cold() => {
            let problem = format!(
                "is 0 for all particles, with which '{}' is not written; state thermal.internal_energy in the scene",
                format.name
            );
            Err(Error::field(names::INTERNAL_ENERGY, problem))
        }
        _ => Ok(()),
    }
}

/// What the format says of the box of the output.
///
/// # Errors
/// A box or an origin that it cannot hold.
pub(crate) fn refuse_box<const D: usize>(
    scene: &Scene,
    format: Option<&FormatSpec>,
    (prepared, walls): (&Prepared<D>, Option<&Walls<D>>),
    into_input: &Conversion,
) -> Result<()> {
    let periodic = prepared.source.domain.axes.map(|a| a == Axis::Periodic);
    origin::refuse(scene, format, &periodic)?;
    if let Some(format) = format.filter(|f| f.capabilities.alike_axes && periodic.iter().any(|p| *p != periodic[0])) {
        let problem =
            format!("is periodic along some axes, but '{}' is along all or none; make them alike", format.name);
        return Err(Error::scene("domain.boundary", problem));
    }
    origin::refuse_far(scene, &prepared.source.domain, (into_input, prepared.length))?;
    let has_shape = |f: &&FormatSpec| f.capabilities.cubic_box || f.capabilities.halved_box;
    let Some(format) = format.filter(has_shape) else { return Ok(()) };
    let frame = match walls {
        Some(walls) => Frame::new(&walls.frame, 1.0),
        None => Frame::new(&prepared.source.domain, scene.output.box_factor),
    };
    let used = &frame.box_size[..D];
    let unit = prepared.length;
    let may_halve = format.capabilities.halved_box;
    if used.iter().all(|edge| *edge == used[0]) || may_halve && halvings(used).is_some() {
        return Ok(());
    }
    let edges: Vec<String> = used.iter().map(|edge| format!("{:.6e}", edge * unit)).collect();
    let (has, remedy) = match may_halve {
        true => {
            ("boxes whose edges are the longest one over 1, 2, 4 and so on (LONG_X_BITS of GADGET-4)", "such edges")
        }
        false => ("one number for the box", "equal edges"),
    };
    let problem = format!(
        "'{}' has {has}, but the edges are {} in the input's units; use {remedy}, or write swift instead (--to swift)",
        format.name,
        edges.join(", ")
    );
    Err(Error::scene("output.format", problem))
}

/// The format that a scene is for: of its output file, else the one it names, else that of its target code. None for a picture.
///
/// # Errors
/// No such format, or one of gas alone where the scene makes other particles.
pub fn intended_format<'f>(scene: &Scene, formats: &'f [FormatSpec]) -> Result<Option<&'f FormatSpec>> {
    if drawings::is_picture(scene) {
        return Ok(None);
    }
    let code = scene.code().map(|code| code.sheet.format);
    let format = match (scene.output.file.as_deref(), scene.output.format.as_deref().or(code)) {
        (Some(output), _) => output_format(scene, formats, output)?,
        (None, Some(name)) => registry::detect_output(formats, Path::new(""), Some(name))?,
        (None, None) => return Ok(None),
    };
    refuse_what_is_no_gas(scene, format)?;
    Ok(Some(format))
}

/// Counts coordinates from the corner of the box where the target demands that; a note where they did not.
pub fn meet_corner(file: &mut ParticleFile, target: &FormatSpec) -> Option<String> {
    let corner = target.capabilities.corner.misses(&file.header)?;
    file.move_corner_to_origin();
    Some(format!("the corner of the box was moved from {corner:?} to the origin, where '{}' has it", target.name))
}

/// Writes particles in the format that is named, else in that of the scene that placed them, of its code, or of the file's name; returns what there is to
/// note.
///
/// # Errors
/// Those of [`sph_formats::write()`]; a name that is one of another kind than the code's files.
pub fn write_placed(
    formats: &[FormatSpec],
    (path, format): (&Path, Option<&str>),
    (file, scene): (&mut ParticleFile, Option<&Scene>),
    options: WriteOptions,
) -> Result<Vec<String>> {
    let stated = format.or(scene.and_then(|scene| scene.output.format.as_deref()));
    let code = scene.and_then(Scene::code);
    let format = format_for(code.as_ref(), formats, (path, stated))?;
    let notes = meet_corner(file, format).into_iter().collect();
    sph_formats::write(formats, path, Some(format.name), file, options)?;
    Ok(notes)
}

fn output_format<'f>(scene: &Scene, formats: &'f [FormatSpec], output: &Path) -> Result<&'f FormatSpec> {
    format_for(scene.code().as_ref(), formats, (output, scene.output.format.as_deref()))
}

/// The format of an output: as given, else as the target code reads it where the file's name leaves that open.
///
/// # Errors
/// A name that no writer knows, or that is one of another kind than the code's files.
pub(crate) fn format_for<'f>(
    code: Option<&TargetCode>,
    formats: &'f [FormatSpec],
    (output, given): (&Path, Option<&str>),
) -> Result<&'f FormatSpec> {
    let by_name = registry::detect_output(formats, output, given);
    let Some(code) = code.filter(|_| given.is_none()) else { return Ok(by_name?) };
    let is_open = by_name.as_ref().map_or(true, |f| TargetCode::of_format(f.name).is_some());
    if !is_open {
        return Ok(by_name?);
    }
    refuse_name_of_another(formats, output, code)?;
    Ok(registry::detect_output(formats, output, Some(code.sheet.format))?)
}

/// Refuses a name by which people and programs would take the file for one of another kind than the code starts from.
fn refuse_name_of_another(formats: &[FormatSpec], output: &Path, code: &TargetCode) -> Result<()> {
    let Some(extension) = output.extension().and_then(|e| e.to_str()).map(str::to_lowercase) else { return Ok(()) };
    let of_code = code.sheet.format;
    let named: Vec<&FormatSpec> =
        formats.iter().filter(|f| f.capabilities.write_particles && f.extensions.contains(&&*extension)).collect();
    if named.is_empty() || named.iter().any(|f| kind_of_file(f.name) == kind_of_file(of_code)) {
        return Ok(());
    }
    let own = formats.iter().find(|f| f.name == of_code).and_then(|f| f.extensions.first());
    let better = own.map(|own| format!("; name it '{}'", output.with_extension(own).display())).unwrap_or_default();
    let problem = format!(
        "is '{}', but {} starts from '{of_code}', which files of that name are not{better}, or state the format yourself (--to, output.format)",
        output.display(),
        code.sheet.title
    );
    Err(Error::scene("output.file", problem))
}

/// What a file of one of the formats that codes start from is as a file: most are HDF5.
fn kind_of_file(format: &str) -> &str {
    match format {
        "gadget-binary" | "gadget-binary-1" => "gadget-binary",
        "phantom" | "numpy" | "dualsphysics" => format,
        _ => "hdf5",
    }
}

/// The format whose point masses need a radius.
const WITH_SINKS: &str = "phantom";

fn refuse_what_is_no_gas(scene: &Scene, format: &FormatSpec) -> Result<()> {
    for dust in scene.dust.iter().chain(scene.bodies.iter().filter_map(|body| body.dust.as_ref())) {
        dust.part_type(Some(format.name))?;
    }
    let bare =
        scene.bodies.iter().enumerate().find(|(_, body)| body.point_mass.is_some() && body.radii().next().is_none());
    if let Some((i, body)) = bare.filter(|_| format.name == WITH_SINKS) {
        let problem = format!(
            "is missing, or softening_radius: a point mass is a sink of '{WITH_SINKS}', which takes up what comes within that radius"
        );
        return Err(Error::scene(format!("bodies[{}].accretion_radius", body.title(i)), problem));
    }
    let made = [
        (scene.input.core.is_some(), "input.core makes a point mass"),
        (scene.bodies.iter().any(|body| body.point_mass.is_some()), "bodies has a point_mass"),
        (scene.walls.is_some(), "walls are particles of another type"),
        (scene.dust.is_some(), "dust is particles of another type"),
        (scene.bodies.iter().any(|body| body.dust.is_some()), "bodies has one with dust"),
        (scene.collisionless.is_some(), "the particles are collisionless"),
        (scene.bodies.iter().any(|body| body.collisionless.is_some()), "bodies has a collisionless one"),
    ];
    match made.iter().find(|(is_made, _)| *is_made) {
        Some((_, what)) if format.capabilities.gas_alone => {
            let problem = format!("'{}' holds gas alone, but {what}; choose another, or leave that out", format.name);
            Err(Error::scene("output.format", problem))
        }
        _ => Ok(()),
    }
}

/// Refuses a format that holds gas alone where a snapshot has `others`.
///
/// # Errors
/// Of the format, with what the scene can do about it.
pub(crate) fn refuse_other_types(format: Option<&FormatSpec>, others: &[Species]) -> Result<()> {
    match (format.filter(|f| f.capabilities.gas_alone), others.first()) {
        (Some(format), Some(other)) => {
            let (name, count, part_type) = (format.name, other.table.count, other.part_type);
            let problem = format!(
                "'{name}' holds gas alone, but the snapshot has {count} particles of type {part_type}; choose another, or leave them out with input.other_types: drop"
            );
            Err(Error::scene("output.format", problem))
        }
        _ => Ok(()),
    }
}

/// Renaming the output, or a checkpoint, onto an input would destroy it, so that the run could not be repeated.
fn refuse_overwriting_inputs(scene: &Scene, output: &Path) -> Result<()> {
    let checkpoint = scene.checkpoint.file.as_deref();
    if checkpoint == Some(output) {
        return Err(Error::scene("checkpoint.file", "is the output file as well; name another"));
    }
    let report = scene.output.report.as_deref();
    let inputs = scene.inputs();
    for (key, written) in [("output.file", Some(output)), ("output.report", report), ("checkpoint.file", checkpoint)] {
        let Some(written) = written else { continue };
        inputs.iter().try_for_each(|input| refuse_replacing(key, written, input))?;
    }
    Ok(())
}

/// Refuses an output, given under `key`, that is an input, or a piece of the snapshot that this is of.
///
/// # Errors
/// That it would be lost.
pub(crate) fn refuse_replacing(key: &str, output: &Path, input: &Path) -> Result<()> {
    if !would_be_lost(input, output) {
        return Ok(());
    }
    let name = input.display();
    let problem = match output.canonicalize().ok() == input.canonicalize().ok() {
        true => format!("is the input file '{name}' itself, which would be overwritten; choose another name"),
        false => {
            format!(
                "has the name of a piece of the snapshot to which '{name}' belongs, which would be lost; choose \
                     another name"
            )
        }
    };
    Err(Error::scene(key, problem))
}
