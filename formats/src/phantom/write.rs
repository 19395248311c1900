//! Writes a full dump.

use super::layout::{
    BOX_CORNER, CAPTURE_END, CAPTURE_REAL, CENTERED_BOX, DUST, FLAVOR, HFACT, IDENTITY, KINDS, Kind, PURE_NUMBERS, TAG,
    TYPES, factor, itype, shift,
};
use super::locally_isothermal::LocallyIsothermal;
use super::schema::{CAPTURE, units_of_header};
use super::sinks::Sinks;
use crate::common::flavor::{Component, Job, Planned, Storage};
use crate::common::fortran::{self as records, padded, record};
use crate::error::{FormatError, Result};
use crate::model::{ParticleFile, Species};
use crate::particle_names as names;
use crate::registry::WriteOptions;
use crate::units::{UnitDimension, UnitSystem};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Spread of masses that rounding to f4 leaves.
const ROUNDING: f64 = 1e-6;
/// Particles converted at a time.
const CHUNK: usize = 1 << 14;

/// A species with what it is in Phantom.
struct Kindred<'a> {
    species: &'a Species,
    planned: &'a [Planned<'a>],
    itype: i8,
    mass: f64,
    first_id: u64,
    /// What its internal energy is multiplied by.
    energy: f64,
}

pub(super) fn write(path: &Path, particles: &ParticleFile, options: WriteOptions) -> Result<()> {
    let job = Job { flavor: &FLAVOR, path, header: &particles.header, options, first_row: 0 };
    job.only_in_3d()?;
    let (points, others): (Vec<&Species>, Vec<&Species>) =
        particles.species.iter().partition(|s| s.table.is_of_points());
    let sinks = Sinks::new(&job, &points)?;
    let plan = job.plan_of(others.iter().copied())?;
    let law = LocallyIsothermal::of(particles);
    // Phantom's of isothermal gas is 3/2 c^2.
    let energy = law.map_or(1.0, |_| 1.5 * (particles.header.adiabatic_index() - 1.0));
    let mut kindred = Vec::new();
    let mut first_id = 1;
    for (&species, planned) in others.iter().zip(&plan).filter(|(s, _)| s.table.count > 0) {
        let itype = itype(species).ok_or_else(|| {
            job.refuse(format!(
                "Phantom has no particles of type {}; leave them out (`convert --types {}`)",
                species.part_type,
                known_types(particles)
            ))
        })?;
        kindred.push(Kindred { species, planned, itype, mass: one_mass(&job, species)?, first_id, energy });
        first_id += species.table.count as u64;
    }
    if i32::try_from(first_id).is_err() {
        return Err(job.refuse(format!("there are {} particles, but a dump counts to 2^31 - 1", first_id - 1)));
    }
    let periodic = match job.header.periodic {
        [true, true, true] => true,
        [false, false, false] => false,
        axes => {
            return Err(job.refuse(format!(
                "the periodic axes are {axes:?}, but Phantom is periodic along all axes or none; make them alike"
            )));
        }
    };
    let (arrays, of_field) = (arrays(&job, &kindred)?, arrays_of_field(&job, &kindred));
    let io = |e| FormatError::io(path, "write", e);
    let mut out = BufWriter::with_capacity(1 << 18, File::create(path).map_err(io)?);
    let has_field = !of_field.is_empty();
    let identity = identity(&kindred, has_field);
    let lengths = if has_field { 4 } else { 2 };
    head(&mut out, &header(&job, &kindred, (sinks.count, periodic, law), has_field)?, (&identity, lengths))
        .map_err(io)?;
    let total = kindred.iter().map(|k| k.species.table.count as u64).sum();
    array_heads(&mut out, total, (&arrays, &of_field), &sinks).map_err(io)?;
    for array in &arrays {
        array.write(&job, &kindred, total, &mut out)?;
    }
    sinks.write(&mut out).map_err(io)?;
    for array in &of_field {
        array.write(&job, &kindred, total, &mut out)?;
    }
    out.flush().map_err(io)
}

/// The mass of all particles of a species.
fn one_mass(job: &Job, species: &Species) -> Result<f64> {
    let masses = species.table.column(names::MASSES).map(|c| c.values.range());
    let (least, most, _) = masses.unwrap_or((0.0, 0.0, 0));
    if least > 0.0 && most - least <= ROUNDING * most {
        return Ok(least);
    }
    Err(job.refuse(format!(
        "the masses of type {} go from {least:e} to {most:e}, but Phantom has one mass per type; place particles of equal mass, or write another format",
        species.part_type
    )))
}

/// Phantom's name of the fraction of dust.
const DUST_FRACTION: &str = "dustfrac";

/// Whether particles carry dust as a fraction of their mass.
fn has_dust_fraction(kindred: &[Kindred]) -> bool {
    kindred.iter().flat_map(|k| k.planned).any(|p| p.name == DUST_FRACTION)
}

/// Types of a file that Phantom has.
fn known_types(particles: &ParticleFile) -> String {
    let known = particles.species.iter().filter(|s| s.table.is_of_points() || itype(s).is_some());
    known.map(|s| s.part_type.to_string()).collect::<Vec<_>>().join(",")
}

enum Items {
    Ints(Kind, Vec<(&'static str, i64)>),
    Reals(Kind, Vec<(&'static str, f64)>),
}

/// The header's blocks that have something in them.
fn header(
    job: &Job,
    kindred: &[Kindred],
    (sinks, periodic, law): (usize, bool, Option<LocallyIsothermal>),
    has_field: bool,
) -> Result<Vec<Items>> {
    let total: i64 = kindred.iter().map(|k| k.species.table.count as i64).sum();
    let of = |number: usize| kindred.iter().find(|k| usize::try_from(k.itype) == Ok(number));
    let counts = (1..=TYPES).map(|t| ("npartoftype", of(t).map_or(0, |k| k.species.table.count as i64)));
    let mut ints = vec![("nparttot", total), ("ntypes", TYPES as i64)];
    ints.extend(counts);
    let longs = ints.clone();
    let large = i64::from(kindred.iter().any(|k| k.itype == DUST));
    let small = i64::from(has_dust_fraction(kindred));
    ints.extend([("nblocks", 1), ("nptmass", sinks as i64), ("ndustlarge", large), ("ndustsmall", small)]);
    ints.extend([("idust", i64::from(DUST)), ("idtmax_n", 1), ("idtmax_frac", 0)]);
    ints.extend(law.map(|law| ("isink", law.sink as i64)));
    let h = job.header;
    let time = h.time * factor(job, UnitDimension::TIME);
    let gamma = if law.is_some() { 1.0 } else { h.adiabatic_index() };
    let squared_speed = law.map_or(0.0, |law| {
        let length = factor(job, UnitDimension::LENGTH);
        law.squared_speed * factor(job, UnitDimension::VELOCITY).powi(2) * length.powf(2.0 * law.fall)
    });
    let mut reals = vec![("time", time), ("hfact", HFACT), ("gamma", gamma), ("RK2", 1.5 * squared_speed)];
    reals.extend(law.map(|law| ("qfacdisc", law.fall)));
    reals.extend((1..=TYPES).map(|t| ("massoftype", of(t).map_or(0.0, |k| k.mass))));
    if periodic {
        let edges = job.box_size()?;
        let edge = |i: usize| edges.get(i).or(edges.first()).copied().unwrap_or(0.0);
        let [x, y, z] = h.box_corner.unwrap_or_default();
        reals.extend([("xmin", x), ("xmax", x + edge(0)), ("ymin", y), ("ymax", y + edge(1))]);
        reals.extend([("zmin", z), ("zmax", z + edge(2))]);
    } else {
        let [x, y, z] = h.box_size;
        reals.extend(CENTERED_BOX.into_iter().zip([x, y, z]));
        reals.extend(h.box_corner.into_iter().flat_map(|corner| BOX_CORNER.into_iter().zip(corner)));
    }
    let is_pure = h.units == UnitSystem::CODE && !periodic;
    reals.extend(is_pure.then_some((PURE_NUMBERS, 1.0)));
    if has_field {
        // Of a field from outside.
        reals.extend([("Bextx", 0.0), ("Bexty", 0.0), ("Bextz", 0.0)]);
    }
    let u = units_of_header(&h.units, !periodic);
    // The field's unit in Gauss: B^2 / 4 pi has that of pressure.
    let field = (4.0 * std::f64::consts::PI * u.mass / u.length).sqrt() / u.time;
    let doubles = vec![("udist", u.length), ("umass", u.mass), ("utime", u.time), ("umagfd", field)];
    Ok(vec![
        Items::Ints(Kind::Int, ints),
        Items::Ints(Kind::Int4, vec![("iexternalforce", 0), ("ieos", if law.is_some() { 6 } else { 2 })]),
        Items::Ints(Kind::Int8, longs),
        Items::Reals(Kind::Real, reals),
        Items::Reals(Kind::Real8, doubles),
    ])
}

/// Everything before the arrays.
fn head(out: &mut impl Write, blocks: &[Items], (identity, lengths): (&str, i32)) -> std::io::Result<()> {
    let pattern = [
        &CAPTURE.to_le_bytes()[..],
        &f64::from(CAPTURE_REAL).to_le_bytes(),
        &CAPTURE_REAL.to_le_bytes(),
        &1i32.to_le_bytes(),
        &CAPTURE_END.to_le_bytes(),
    ]
    .concat();
    record(out, &pattern)?;
    record(out, &padded::<IDENTITY>(identity))?;
    for kind in KINDS {
        let (tags, values) = blocks.iter().find_map(|block| block.encoded(kind)).unwrap_or_default();
        record(out, &((tags.len() / TAG) as i32).to_le_bytes())?;
        if !tags.is_empty() {
            record(out, &tags)?;
            record(out, &values)?;
        }
    }
    record(out, &lengths.to_le_bytes())
}

/// What Phantom knows the kind of a dump by: it takes dust for a fraction of the gas only where this says so.
fn identity(kindred: &[Kindred], has_field: bool) -> String {
    let version = env!("CARGO_PKG_VERSION");
    let what = if has_field { "mhd+clean" } else { "hydro" };
    let grains = if kindred.iter().any(|k| k.itype == DUST) { "+dust" } else { "" };
    let fraction = if has_dust_fraction(kindred) { "+1dust" } else { "" };
    format!("FT:Phantom:sph-prep {version} ({what}{grains}{fraction})")
}

impl Items {
    /// Tags and values, if the block is of this kind.
    fn encoded(&self, kind: Kind) -> Option<(Vec<u8>, Vec<u8>)> {
        let tags = |names: &mut dyn Iterator<Item = &'static str>| names.flat_map(padded::<TAG>).collect();
        match self {
            Self::Ints(k, items) if *k == kind => {
                let values = items.iter().flat_map(|(_, n)| n.to_le_bytes().into_iter().take(kind.width(8)));
                Some((tags(&mut items.iter().map(|i| i.0)), values.collect()))
            }
            Self::Reals(k, items) if *k == kind => {
                Some((tags(&mut items.iter().map(|i| i.0)), items.iter().flat_map(|(_, x)| x.to_le_bytes()).collect()))
            }
            _ => None,
        }
    }
}

/// The lengths of the particles' and of the sinks' arrays, with how many there are of each type; then, where there is a magnetic field, of none and of the
/// field's.
fn array_heads(
    out: &mut impl Write,
    total: u64,
    (arrays, of_field): (&[Array], &[Array]),
    sinks: &Sinks,
) -> std::io::Result<()> {
    let numbers = |arrays: &[Array]| KINDS.map(|kind| arrays.iter().filter(|a| a.kind == kind).count() as i32);
    let of_sinks = KINDS.map(|kind| if kind == Kind::Real { sinks.arrays.len() as i32 } else { 0 });
    let mut heads = vec![(total, numbers(arrays)), (sinks.count as u64, of_sinks)];
    if !of_field.is_empty() {
        heads.extend([(0, [0; KINDS.len()]), (total, numbers(of_field))]);
    }
    for (length, numbers) in heads {
        let mut bytes = length.to_le_bytes().to_vec();
        bytes.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
        record(out, &bytes)?;
    }
    Ok(())
}

/// One array over all species.
struct Array {
    tag: String,
    kind: Kind,
    /// The planned dataset and its component; none for itype.
    from: Option<(String, usize)>,
}

/// All arrays in the order of their types.
fn arrays(job: &Job, kindred: &[Kindred]) -> Result<Vec<Array>> {
    let float = if job.options.double_precision { Kind::Real } else { Kind::Real4 };
    let mut arrays = Vec::new();
    let mut add = |tag: &str, kind, from: &str, component| {
        arrays.push(Array { tag: tag.to_owned(), kind, from: Some((from.to_owned(), component)) });
    };
    for (i, axis) in ["x", "y", "z"].iter().enumerate() {
        add(axis, Kind::Real, "Coordinates", i);
        add(&format!("v{axis}"), Kind::Real, "Velocities", i);
    }
    add("u", Kind::Real, "u", 0);
    if has_dust_fraction(kindred) {
        add(DUST_FRACTION, Kind::Real, DUST_FRACTION, 0);
    }
    add("h", float, "h", 0);
    add("iorig", Kind::Int8, "iorig", 0);
    let known = FLAVOR.rules.iter().map(|r| r.name);
    let taken: Vec<&str> = known.chain(FLAVOR.taken.iter().copied()).collect();
    let mut extras: Vec<(&str, Storage)> = Vec::new();
    for p in kindred.iter().flat_map(|k| k.planned) {
        let fits = p.components == 1 && p.name.len() <= TAG && p.name.is_ascii();
        if fits && !taken.contains(&p.name.as_str()) && !extras.iter().any(|e| e.0 == p.name) {
            extras.push((&p.name, p.storage));
        }
    }
    for (name, storage) in extras {
        add(name, if storage == Storage::Int { Kind::Int4 } else { float }, name, 0);
    }
    if kindred.iter().any(|k| k.itype != 1) {
        arrays.push(Array { tag: "itype".into(), kind: Kind::Int1, from: None });
    }
    let order = |kind: Kind| KINDS.iter().position(|k| *k == kind);
    arrays.sort_by_key(|a| order(a.kind));
    Ok(arrays)
}

/// Those of the magnetic field, which Phantom has in a block of its own.
fn arrays_of_field(job: &Job, kindred: &[Kindred]) -> Vec<Array> {
    let kind = if job.options.double_precision { Kind::Real } else { Kind::Real4 };
    let has_field = kindred.iter().flat_map(|k| k.planned).any(|p| p.name == names::MAGNETIC_FIELD);
    let axes = if has_field { &["Bx", "By", "Bz"][..] } else { &[] };
    let array = |(i, axis): (usize, &&str)| Array {
        tag: (*axis).to_owned(),
        kind,
        from: Some((names::MAGNETIC_FIELD.to_owned(), i)),
    };
    axes.iter().enumerate().map(array).collect()
}

impl Array {
    fn write(&self, job: &Job, kindred: &[Kindred], total: u64, out: &mut impl Write) -> Result<()> {
        let io = |e| FormatError::io(job.path, "write", e);
        record(out, &padded::<TAG>(&self.tag)).map_err(io)?;
        let mut failed = None;
        let written = records::write(out, total * self.kind.width(8) as u64, |parts| {
            for k in kindred {
                let mut start = 0;
                while start < k.species.table.count {
                    let end = k.species.table.count.min(start + CHUNK);
                    match self.bytes(job, k, start..end) {
                        Ok(bytes) => parts.put(&bytes)?,
                        Err(e) => {
                            failed = Some(e);
                            return Err(std::io::Error::other("a value cannot be written"));
                        }
                    }
                    start = end;
                }
            }
            Ok(())
        });
        match failed {
            Some(e) => Err(e),
            None => written.map_err(io),
        }
    }

    /// The bytes of some particles; zeros where the species has no such numbers.
    fn bytes(&self, job: &Job, k: &Kindred, range: std::ops::Range<usize>) -> Result<Vec<u8>> {
        let width = self.kind.width(8);
        let Some((from, component)) = &self.from else {
            return Ok(vec![k.itype as u8; range.len()]);
        };
        let Some(planned) = k.planned.iter().find(|p| p.name == *from) else {
            return Ok(vec![0; range.len() * width]);
        };
        let energy = if planned.name == "u" { k.energy } else { 1.0 };
        let factor = energy * factor(job, planned.dimension);
        let shift = if planned.name == "Coordinates" { shift(job, *component) } else { 0.0 };
        let component = Component { index: *component, factor, shift, may_vanish: false };
        match self.kind {
            Kind::Int8 => {
                let mut ids = Vec::new();
                job.ids(planned, range, k.first_id, &mut ids)?;
                Ok(ids.iter().flat_map(|n| n.to_le_bytes()).collect())
            }
            Kind::Int4 => {
                let mut ints = Vec::new();
                job.ints(planned, range, &mut ints)?;
                Ok(ints.iter().flat_map(|n| n.to_le_bytes()).collect())
            }
            Kind::Real4 => {
                let mut singles = Vec::new();
                job.component_singles(planned, component, range, &mut singles)?;
                Ok(singles.iter().flat_map(|x| x.to_le_bytes()).collect())
            }
            _ => {
                let mut doubles = Vec::new();
                job.component_doubles(planned, component, range, &mut doubles)?;
                Ok(doubles.iter().flat_map(|x| x.to_le_bytes()).collect())
            }
        }
    }
}
