//! Builds a source from the scene's input, in the input's own units, and records what is known about those units.

use crate::error::{Error, Result};
use crate::field::{
    Centering, FieldOptions, Missing, Period, ScalarField, Source, Staggering, from_raw, in_units_of,
    natural_dimension, total_mass,
};
use crate::input::constants::Constants;
use crate::input::from_spacing::FromSpacing;
use crate::input::interpolation::interpolation;
use crate::input::particles::{LEFT_OUT, OfSnapshot, Snapshot, is_alone};
use crate::input::profile::Numbers;
use crate::input::roles::{
    Assignment, adopt_units, apply, assign, divide_momenta, reduce_energies, restore_names, warn_of_missing,
};
use crate::input::surfaces::{density_within, refuse_domain_of_a_surface, refuse_orientation};
use crate::input::units::{RunUnits, named_unit};
use crate::input::{beside, profile, request, shapes};
use crate::scene::{
    BoundaryName, CenteringName, Conversion, CylinderInput, DomainInput, MissingValues, OtherTypes, ProfileInput,
    Quantity, ResolutionInput, Scene, StaggeringName, values, vector,
};
use crate::seeding::Seeding;
use sph::domain::{Axis, Domain, Region, Wall};
use sph_formats::{FieldRequest, FileContent, FormatSpec, Geometry, ParticleFile, RawField, UnitDimension, UnitSystem};
use std::path::Path;

/// A raw field, particles of another run, or the fact that the density is an expression.
pub enum RawInput {
    File(Box<RawField>),
    Snapshot(Box<Snapshot>),
    Expression(String),
    /// The disc of a scene's profile, whose numbers are in these.
    Disc(Numbers),
    /// The gas of a scene's profile that others hold, whose numbers are in these.
    Hydrostatic(Numbers),
}

impl RawInput {
    /// What was read, if anything was.
    pub fn field(&self) -> Option<&RawField> {
        match self {
            Self::File(field) => Some(field),
            Self::Snapshot(snapshot) => Some(&snapshot.field),
            Self::Expression(_) | Self::Disc(_) | Self::Hydrostatic(_) => None,
        }
    }
}

/// Reads the input file, if there is one.
///
/// # Errors
/// What the reader says.
pub fn read(scene: &Scene, formats: &[FormatSpec]) -> Result<RawInput> {
    match stated(scene)? {
        Some(raw) => Ok(raw),
        None => of_content(scene, content(scene, formats)?),
    }
}

/// The input of a scene that says itself what it is.
///
/// # Errors
/// Those of a profile.
pub(super) fn stated(scene: &Scene) -> Result<Option<RawInput>> {
    let input = &scene.input;
    if let Some(expression) = &input.expression {
        return Ok(Some(RawInput::Expression(expression.clone())));
    }
    Ok(match &input.profile {
        Some(disc @ ProfileInput::Disc(_)) => Some(RawInput::Disc(Numbers::new(scene, disc, false)?)),
        Some(gas @ ProfileInput::Hydrostatic(_)) => Some(RawInput::Hydrostatic(Numbers::new(scene, gas, false)?)),
        Some(model) => Some(RawInput::File(Box::new(profile::field(scene, model)?))),
        None => None,
    })
}

/// What the input file holds.
///
/// # Errors
/// What the reader says.
pub(super) fn content(scene: &Scene, formats: &[FormatSpec]) -> Result<FileContent> {
    Ok(sph_formats::read(formats, path(scene), scene.input.format.as_deref(), &request::of(scene)?)?)
}

fn path(scene: &Scene) -> &Path {
    scene.input.file.as_deref().unwrap_or(Path::new(""))
}

/// What a file holds as the input that it is of.
///
/// # Errors
/// Particles that are no density field.
pub(super) fn of_content(scene: &Scene, content: FileContent) -> Result<RawInput> {
    let density = scene.density_name()?;
    match content {
        FileContent::Field(mut field) => {
            if density.is_some() {
                field.density = density;
            }
            Ok(RawInput::File(Box::new(field)))
        }
        FileContent::Particles(mut particles) => {
            let note = units_of_snapshot(scene, &mut particles.header.units)?;
            let stated = boundary_of_snapshot(scene, &mut particles);
            let is_kept = scene.input.keeps_particles() || scene.refine.is_some() && scene.particles.is_none();
            let is_alone = stated == [None; 3] && !scene.domain.has_extent() && is_alone(&particles);
            let is_taken_out = is_alone && !is_kept;
            if is_taken_out {
                particles.header.periodic = [false; 3];
            }
            let mut snapshot = Snapshot::new(path(scene), &particles, density.as_deref())?;
            (snapshot.stated, snapshot.is_alone) = (stated, is_alone && is_kept);
            snapshot.field.notes.extend(note.into_iter().chain(is_taken_out.then(|| ALONE.to_owned())));
            let file = is_kept.then_some(particles);
            if file.is_some() {
                // All columns of those that stay, stay.
                snapshot.field.notes.retain(|note| !note.ends_with(LEFT_OUT));
            }
            Ok(RawInput::Snapshot(Box::new(Snapshot { file, ..snapshot })))
        }
    }
}

/// The note where the box of a snapshot is not taken as periodic.
const ALONE: &str = "the box of the file is treated as open, because no particle is near its faces, and many files do not state whether their box is \
                     periodic; `--boundary periodic` keeps the box";

/// Takes what the scene says of the faces of a snapshot's own box for what the file says: open axes end with the particles. What it says of
/// each axis.
fn boundary_of_snapshot(scene: &Scene, particles: &mut ParticleFile) -> [Option<BoundaryName>; 3] {
    if scene.domain.has_extent() {
        return [None; 3];
    }
    let header = &mut particles.header;
    let stated = sph::array(|k| scene.domain.boundary_along(k));
    for k in 0..header.dimension {
        match stated[k] {
            Some(BoundaryName::Open) => header.periodic[k] = false,
            Some(BoundaryName::Periodic) => header.periodic[k] |= header.box_size[k] > 0.0,
            Some(BoundaryName::Reflecting) | None => {}
        }
    }
    stated
}

/// Gives a snapshot that states no units those of the scene, where it has some; what there is to say of it. Units of 1 are those of
/// pure numbers, which formats write that cannot do without.
pub(super) fn units_of_snapshot(scene: &Scene, units: &mut UnitSystem) -> Result<Option<String>> {
    if *units != UnitSystem::CODE {
        return Ok(None);
    }
    let note = match (scene.stated_units()?, scene.units.as_deref()) {
        (Some(system), Some(name)) => {
            *units = system;
            format!("the file states no units: its numbers are assumed to be in those of the scene ({name})")
        }
        _ => "the file states no units, or units of 1: its numbers are pure numbers; if they are not, `units` says what they are in"
            .to_owned(),
    };
    Ok(Some(note))
}

/// A file's field, or the particles of a snapshot as points that have one.
fn read_field(formats: &[FormatSpec], path: &Path, format: Option<&str>, request: &FieldRequest) -> Result<RawField> {
    match sph_formats::read(formats, path, format, request)? {
        FileContent::Field(field) => Ok(field),
        FileContent::Particles(particles) => {
            Snapshot::new(path, &particles, request.density.as_deref()).map(|s| s.field)
        }
    }
}

/// The dimension of the run.
///
/// # Errors
/// A dimension asked for that the input cannot have, or none to be found.
pub fn dimension(scene: &Scene, raw: &RawInput) -> Result<usize> {
    let asked = scene.input.dimension;
    match raw.field() {
        Some(field) => {
            let natural = natural_dimension(field);
            match asked {
                Some(d) if d != natural && !matches!(field.geometry, Geometry::Radial { .. }) => Err(Error::scene(
                    "input.dimension",
                    format!("is {d}, but the input is a {natural}-D {}", field.geometry.kind()),
                )),
                _ => Ok(asked.unwrap_or(natural)),
            }
        }
        None if matches!(raw, RawInput::Disc(_) | RawInput::Hydrostatic(_)) => match asked {
            None | Some(3) => Ok(3),
            Some(d) => {
                let problem = format!("is {d}, but the {} is one in 3 dimensions", scene.input_name());
                Err(Error::scene("input.dimension", problem))
            }
        },
        None => {
            let from_domain = scene.domain.bounds.as_ref().map(|b| b[0].len());
            let from_center = scene.domain.ball.as_ref().map(|b| b.center.len()).filter(|&d| d > 0);
            let from_cylinder = scene.domain.cylinder.as_ref().map(|_| 3);
            let from_shape = scene.domain.shape().and_then(|shape| shape.dimension());
            asked
                .or(from_domain)
                .or(from_center)
                .or(from_cylinder)
                .or(from_shape)
                .filter(|d| (1..=3).contains(d))
                .ok_or_else(|| {
                    Error::scene(
                        "input.dimension",
                        "is not known: an expression needs `input.dimension`, or a domain with 1 to 3 coordinates",
                    )
                })
        }
    }
}

/// A source, with what there is to say of where it is from.
pub struct Ingested<const D: usize> {
    pub source: Source<D>,
    pub variables: Vec<Assignment>,
    /// Mass of the whole input, where the scene's domain is another than the input's and the input tells.
    pub input_mass: Option<f64>,
    pub(crate) of_snapshot: Option<OfSnapshot>,
}

/// The source, over the scene's domain, in the input's units.
///
/// # Errors
/// A field that is no density, or a domain that does not fit it.
pub fn source<const D: usize>(
    scene: &Scene,
    formats: &[FormatSpec],
    mut raw: RawInput,
    units: &RunUnits,
) -> Result<Ingested<D>> {
    let conversion = &units.to_input();
    let walls = boundaries::<D>(&scene.domain)?;
    let mut options = field_options(scene, &walls, conversion)?;
    let variables = match &mut raw {
        RawInput::File(field) if matches!(field.geometry, Geometry::Surface { .. }) => {
            refuse_domain_of_a_surface(&scene.domain)?;
            Vec::new()
        }
        RawInput::File(field) => give_roles(scene, field, &mut options, units)?,
        RawInput::Snapshot(snapshot) => give_roles(scene, &mut snapshot.field, &mut options, units)?,
        RawInput::Expression(_) | RawInput::Disc(_) | RawInput::Hydrostatic(_) => Vec::new(),
    };
    let density = density_within(scene, raw.field());
    let mut notes = Vec::new();
    let stated = match scene.domain.shape() {
        Some(_) if walls.contains(&Some(BoundaryName::Periodic)) => {
            let problem = "is periodic, which only a box and the axis of a cylinder can be";
            return Err(Error::scene("domain.boundary", problem));
        }
        Some(shape) => Some(shapes::domain::<D>(&shape, formats, (surface(walls[0]), conversion), &mut notes)?),
        None => scene_domain::<D>(&scene.domain, &walls, conversion)?,
    };
    let mut of_snapshot = None;
    let mut source = match raw {
        RawInput::File(field) => {
            refuse_orientation(scene, &field)?;
            if let Some((number, _)) = density {
                options.density_name = Some(number);
            }
            from_raw(*field, &options)?
        }
        RawInput::Snapshot(snapshot) => {
            refuse_orientation(scene, &snapshot.field)?;
            let (mut source, mut found) = snapshot.into_source(&options)?;
            if scene.input.other_types == OtherTypes::Drop {
                source.notes.extend(found.leave_others("input.other_types is drop"));
            }
            of_snapshot = Some(found);
            source
        }
        RawInput::Disc(_) | RawInput::Hydrostatic(_) => {
            return Err(Error::scene("input.profile", "is no table by itself"));
        }
        RawInput::Expression(text) => {
            let domain = stated.clone().ok_or_else(|| {
                Error::scene(
                    "domain",
                    "is missing: an expression needs a `box`, a `ball`, a `cylinder` or another shape to be evaluated in",
                )
            })?;
            let asked = ("input.expression", text.as_str());
            let known = Constants::new(scene, conversion.from);
            let density = known.field(asked, UnitDimension::mass_density(3), domain.center())?;
            density.check(&domain)?;
            Source {
                density: Box::new(density),
                carried: Vec::new(),
                domain,
                mass: None,
                radial: None,
                notes: Vec::new(),
            }
        }
    };
    let mut input_mass = None;
    source.notes.extend(notes);
    match stated {
        Some(domain) => {
            input_mass = source.mass.take().map(|mass| mass.value);
            if let (Some(_), Some(mass)) = (&of_snapshot, input_mass) {
                source = of_mass(source, mass)?;
            }
            source.domain = domain;
            if let Some(of_snapshot) = &mut of_snapshot {
                source.notes.extend(of_snapshot.leave_all_but_fields("the scene has a domain of its own"));
            }
        }
        None => apply_walls(&mut source.domain, &walls),
    }
    if let Some((found, said)) = beside::others(scene, formats, units)? {
        if of_snapshot.is_some() {
            let problem = "stands beside a snapshot, whose own particles of other types are kept; leave it out";
            return Err(Error::scene("input.others", problem));
        }
        source.notes.extend(said);
        of_snapshot = Some(found);
    }
    Ok(Ingested { source, variables, input_mass, of_snapshot })
}

/// Accuracy to which the mass of a field is found that the densities of particles make.
const SUMMED: f64 = 1e-5;
/// A change of that mass which is worth a note.
const SEEN: f64 = 1e-3;

/// A snapshot's field with the mass that its particles have: summed densities count each particle's own share as well, and are too large as a whole.
fn of_mass<const D: usize>(source: Source<D>, mass: f64) -> Result<Source<D>> {
    let summed = total_mass(source.density.as_ref(), &source.domain, SUMMED)?.value;
    let factor = mass / summed;
    if !(factor.is_finite() && factor > 0.0) {
        return Ok(source);
    }
    let mut source = source.scaled(1.0, factor);
    if (factor - 1.0).abs() > SEEN {
        source.notes.push(format!(
            "the summed densities of the snapshot hold {:.4} times the mass of its particles, and are divided by that everywhere",
            1.0 / factor
        ));
    }
    Ok(source)
}

const MAGNETIC_UNIT: &str = "input.magnetic_field_unit";
/// A format that tells data of points from those of cells.
const VTK: &str = "vtk";

/// Decides what the variables of a field are, and makes them so.
fn give_roles<const D: usize>(
    scene: &Scene,
    field: &mut RawField,
    options: &mut FieldOptions<D>,
    units: &RunUnits,
) -> Result<Vec<Assignment>> {
    if let Some(name) = &options.density_name {
        field.density = Some(name.clone());
    }
    if field.format == VTK && options.centering == Centering::Unknown {
        options.centering = Centering::Points;
    }
    let divided = divide_momenta(field, |name| scene.map.contains_key(name));
    let mut variables = assign(field, D, &scene.map)?;
    let magnetic = scene.input.magnetic_field_unit.as_deref();
    let magnetic = named_unit(MAGNETIC_UNIT, magnetic, UnitDimension::MAGNETIC_FIELD)?;
    if magnetic.is_some() && units.input.is_none() {
        let problem = "cannot be converted, as the units of length and density are not known: state input.length_unit and \
                       input.density_unit, too";
        return Err(Error::scene(MAGNETIC_UNIT, problem));
    }
    if let Some(input) = &units.input {
        let of_scene = scene.units.as_deref().filter(|_| units.are_the_scenes());
        adopt_units(field, &mut variables, (input, of_scene), magnetic.as_ref());
    }
    if options.missing != Missing::Zero {
        warn_of_missing(field, &mut variables);
    }
    reduce_energies(field, &mut variables, units.input.as_ref());
    apply(field, &variables, D)?;
    restore_names(&mut variables, &divided);
    if let Some(carried) = &mut options.carried {
        let mut columns = Vec::new();
        for name in carried.iter().chain(scene.map.keys()).filter(|n| Some(*n) != field.density.as_ref()) {
            let column = variables.iter().find(|v| v.variable == *name).map_or(name, |v| &v.column);
            if !columns.contains(column) {
                columns.push(column.clone());
            }
        }
        *carried = columns;
    }
    Ok(variables)
}

fn field_options<const D: usize>(
    scene: &Scene,
    walls: &[Option<BoundaryName>; D],
    conversion: &Conversion,
) -> Result<FieldOptions<D>> {
    let stated_box = match &scene.domain.bounds {
        Some(_) => scene_domain::<D>(&scene.domain, walls, conversion)?.map(|domain| [domain.lo, domain.hi]),
        None => None,
    };
    let periodic = walls.map(|w| (w == Some(BoundaryName::Periodic)).then_some(Period::Auto));
    Ok(FieldOptions {
        interpolation: scene.input.interpolation.map(interpolation),
        density_name: scene.density_name()?,
        missing: match scene.input.missing {
            MissingValues::Error => Missing::Error,
            MissingValues::Zero => Missing::Zero,
        },
        periodic,
        centering: match scene.input.centering {
            Some(CenteringName::Cells) => Centering::Cells,
            Some(CenteringName::Nodes) => Centering::Nodes,
            None => Centering::Unknown,
        },
        stated_box,
        carried: scene.input.carry.clone(),
        orientation: scene.input.orientation(),
        staggering: match scene.input.staggering {
            StaggeringName::Auto => None,
            StaggeringName::Nodes => Some(Staggering::Nodes),
            StaggeringName::OuterFaces => Some(Staggering::OuterFaces),
            StaggeringName::InnerFaces => Some(Staggering::InnerFaces),
            StaggeringName::Centers => Some(Staggering::Centers),
        },
        ..FieldOptions::default()
    })
}

/// Boundary of each axis as the scene says; `None` where it does not.
fn boundaries<const D: usize>(input: &DomainInput) -> Result<[Option<BoundaryName>; D]> {
    match input.boundary.len() {
        many if many > 1 && many != D => {
            Err(Error::scene("domain.boundary", format!("has {many} entries, expected 1 or {D}")))
        }
        _ => Ok(sph::array(|k| input.boundary_along(k))),
    }
}

fn axis(boundary: Option<BoundaryName>) -> Axis {
    match boundary {
        Some(BoundaryName::Periodic) => Axis::Periodic,
        Some(BoundaryName::Reflecting) => Axis::REFLECTING,
        Some(BoundaryName::Open) | None => Axis::OPEN,
    }
}

fn surface(boundary: Option<BoundaryName>) -> Wall {
    if boundary == Some(BoundaryName::Reflecting) { Wall::Reflecting } else { Wall::Open }
}

fn scene_domain<const D: usize>(
    input: &DomainInput,
    walls: &[Option<BoundaryName>; D],
    conversion: &Conversion,
) -> Result<Option<Domain<D>>> {
    if let Some([lo, hi]) = &input.bounds {
        let corner = |v: &[Quantity]| {
            <[f64; D]>::try_from(values("domain.box", v, UnitDimension::LENGTH, conversion)?).map_err(|v| {
                Error::scene("domain.box", format!("has a corner of {} coordinates, expected {D}", v.len()))
            })
        };
        return Ok(Some(Domain::new(corner(lo)?, corner(hi)?, walls.map(axis), Region::Box)?));
    }
    if let Some(cylinder) = &input.cylinder {
        return scene_cylinder(cylinder, walls, conversion).map(Some);
    }
    let Some(ball) = &input.ball else { return Ok(None) };
    if walls.contains(&Some(BoundaryName::Periodic)) {
        return Err(Error::scene("domain.boundary", "is periodic, which a ball cannot be; use a box"));
    }
    let length = |key: &str, quantity: &Quantity| quantity.value(key, UnitDimension::LENGTH, conversion);
    let inner = length("domain.ball.inner_radius", &ball.inner_radius)?;
    let outer = length("domain.ball.radius", &ball.radius)?;
    check_radii("domain.ball", inner, outer)?;
    let center = vector("domain.ball.center", &ball.center, UnitDimension::LENGTH, conversion)?;
    let mut domain = Domain::ball(center, outer, surface(walls[0]))?;
    if let Region::Ball { inner_radius, .. } = &mut domain.region {
        *inner_radius = inner;
    }
    Ok(Some(domain))
}

fn check_radii(key: &str, inner: f64, outer: f64) -> Result<()> {
    match inner >= 0.0 && inner < outer {
        true => Ok(()),
        false => Err(Error::scene(key, format!("has radii {inner} to {outer}, expected 0 <= inner_radius < radius"))),
    }
}

fn scene_cylinder<const D: usize>(
    input: &CylinderInput,
    walls: &[Option<BoundaryName>; D],
    conversion: &Conversion,
) -> Result<Domain<D>> {
    let length = |key: &str, quantity: &Quantity| quantity.value(key, UnitDimension::LENGTH, conversion);
    let inner = length("domain.cylinder.inner_radius", &input.inner_radius)?;
    let outer = length("domain.cylinder.radius", &input.radius)?;
    check_radii("domain.cylinder", inner, outer)?;
    input.length.check_positive("domain.cylinder.length", UnitDimension::LENGTH)?;
    let height = length("domain.cylinder.length", &input.length)?;
    let along = input.axis as usize;
    let around: Vec<_> = (0..D).filter(|&k| k != along).map(|k| walls[k]).collect();
    if around.contains(&Some(BoundaryName::Periodic)) {
        return Err(Error::scene(
            "domain.boundary",
            "is periodic across a cylinder; only along its axis can it be, as in [open, open, periodic]",
        ));
    }
    let ends = axis(walls.get(along).copied().flatten());
    let wall = surface(around.first().copied().flatten());
    let center = vector("domain.cylinder.center", &input.center, UnitDimension::LENGTH, conversion)?;
    Ok(Domain::cylinder(center, along, [inner, outer], height, (wall, ends))?)
}

/// Boundary names on the input's own domain.
fn apply_walls<const D: usize>(domain: &mut Domain<D>, walls: &[Option<BoundaryName>; D]) {
    match &mut domain.region {
        Region::Box => {
            for k in 0..D {
                if walls[k].is_some() {
                    domain.axes[k] = axis(walls[k]);
                }
            }
        }
        Region::Cylinder { axis: along, wall, .. } => {
            *wall = surface(walls[usize::from(*along == 0)]);
            domain.axes[*along] = axis(walls[*along]);
        }
        Region::Ball { wall, .. } | Region::Hull(_, wall) => *wall = surface(walls[0]),
    }
}

/// The number density that the scene's resolution asks for, in any scale.
///
/// # Errors
/// As for the density.
pub fn resolution<const D: usize>(
    scene: &Scene,
    formats: &[FormatSpec],
    domain: &Domain<D>,
    conversion: &Conversion,
) -> Result<Option<Box<dyn ScalarField<D>>>> {
    let even = ResolutionInput { number_density: Some("1".into()), ..ResolutionInput::default() };
    let asked = match &scene.resolution {
        Some(asked) => asked,
        None if scene.seeding == Some(Seeding::VariableMasses) => &even,
        None => return Ok(None),
    };
    let (field, is_spacing): (Box<dyn ScalarField<D>>, bool) = match (asked.expression(), asked.variable()) {
        (Some(text), _) => {
            // The expression counts in the scene's units, the domain in the input's.
            let unit = conversion.factor(UnitDimension::LENGTH);
            let own = domain.scaled(1.0 / unit);
            let length = if asked.spacing.is_some() { 1 } else { -(D as i8) };
            let measured = UnitDimension::new(length, 0, 0, 0);
            let field = Constants::new(scene, conversion.from).field(("resolution", text), measured, own.center())?;
            field.check(&own)?;
            let field: Box<dyn ScalarField<D>> = Box::new(field);
            (if unit == 1.0 { field } else { in_units_of(1.0 / unit, field) }, asked.spacing.is_some())
        }
        (None, Some(name)) => {
            let own = scene.input.file.as_deref();
            let path = asked.file.as_deref().or(own).ok_or_else(|| {
                Error::scene("resolution.file", "is missing: an expression for the density has no variables")
            })?;
            let request = FieldRequest {
                density: Some(name.into()),
                carry: Some(Vec::new()),
                optional: Vec::new(),
                time: scene.input.time,
                ..request::planet(scene)?
            };
            let format = if asked.file.is_none() { scene.input.format.as_deref() } else { None };
            let mut raw = read_field(formats, path, format, &request)?;
            raw.density = Some(name.into());
            let walls = boundaries::<D>(&scene.domain)?;
            let options = FieldOptions {
                density_name: Some(name.into()),
                has_mass: false,
                ..field_options(scene, &walls, conversion)?
            };
            (from_raw(raw, &options)?.density, asked.spacing_variable.is_some())
        }
        (None, None) => return Ok(None),
    };
    Ok(Some(if is_spacing { Box::new(FromSpacing(field)) } else { field }))
}
