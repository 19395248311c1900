//! Reads GADGET-style particle files: ours, and snapshots of GADGET-2/3/4, GIZMO, AREPO and SWIFT.
//!
//! * Units: `/Units` (ours, SWIFT), else `/Parameters` or `/Header` with UnitLength_in_cm and its like
//!   (GADGET-4, AREPO), else pure numbers.
//! * Periodic axes: ours, else SWIFT's parameter, else every axis of a box with positive size.
//! * SmoothingLength becomes SupportRadius where the file is GADGET's (ours, or GADGET-4's and GIZMO's own); where it is SWIFT's
//!   for the cubic spline, or for the neighbors that our own file states, it is scaled to that; elsewhere the convention is unknown and the
//!   column keeps its name.
//! * Where Flag_Entropy_ICs is not 0, the entropies of gas become energies ([`crate::common::entropy`]).
//! * Where NumFilesPerSnapshot says that there are several files, all of them are read, whichever was named.
//! * MassTable gives the masses of a type; a dataset Masses beside it counts in SWIFT's files alone, and the provenance says where both
//!   differ ([`super::doubts`]).
//! * Datasets that are not columns of numbers are named in the provenance under `not read`.

use super::doubts;
use super::laid_out::{self, DYNAMICAL_MASSES};
use crate::common::cosmology;
use crate::common::entropy;
use crate::common::flavor::{CUBIC_SPLINE_ETA, spacing_over_support};
use crate::common::hdf5_read::{Attributes, Reader};
use crate::common::parts;
use crate::common::snapshot::{OWN_EDGES, OWN_GROUP, joined};
use crate::error::{FormatError, Result};
use crate::family::{self, Family};
use crate::magnetic::MagneticUnit;
use crate::model::{Column, LACKS_KEY, MESH_KEY, ParticleFile, ParticleTable, RunHeader, Species, VORONOI, Values};
use crate::particle_names as names;
use crate::registry::{FieldRequest, FileContent};
use crate::units::{UnitDimension, UnitSystem};
use std::path::Path;

const FORMAT: &str = "gadget";
/// Attributes of SWIFT's units, in the order of [`UnitSystem`].
const SWIFT_UNITS: [&str; 4] =
    ["Unit length in cgs (U_L)", "Unit mass in cgs (U_M)", "Unit time in cgs (U_t)", "Unit temperature in cgs (U_T)"];
/// Our flavors whose SmoothingLength is the support radius.
const SUPPORT_RADIUS_FLAVORS: [&str; 2] = [FORMAT, "gizmo"];
/// Files of one snapshot, at most.
const MOST_FILES: f64 = 1e6;
/// Fewer particles than these may lie in a plane by chance.
const FLAT: usize = 5;
/// More columns than this in one dataset are not a particle's components.
const MAX_COMPONENTS: usize = 64;

/// Reads all particles of `path`, and of the other files of its snapshot.
///
/// # Errors
/// [`FormatError::Input`] where the file is damaged, has no particles' header, or lacks others of its snapshot,
/// [`FormatError::Unsupported`] for entropies without densities, [`FormatError::Limit`], [`FormatError::Io`].
pub fn read(path: &Path, _request: &FieldRequest) -> Result<FileContent> {
    let opened = Opened::new(path)?;
    let files = opened.files()?;
    if files == 1 {
        let read = opened.particles(None)?;
        return match opened.dimension_of(&read) {
            None => Ok(read),
            Some(dimension) => opened.particles(Some(dimension)),
        }
        .map(FileContent::Particles);
    }
    let members = match opened.attributes.number("Virtual") {
        // SWIFT's file without particles of its own, which shows those of the others as if they were.
        Some(flag) if flag != 0.0 => Family::for_output(path).complete(FORMAT, path, files)?,
        _ => family::members_of(path, FORMAT, files)?,
    };
    let totals = opened.totals();
    drop(opened);
    let mut sums: Vec<f64> = Vec::new();
    let particles = parts::joined(FORMAT, &members, |member| {
        let part = Opened::new(member)?;
        let found = (part.files()?, part.totals());
        if found != (files, totals.clone()) {
            let problem = format!(
                "it counts {:?} particles in {} files, but '{}' {:?} in {files}; the files are of two snapshots",
                found.1.unwrap_or_default(),
                found.0,
                path.display(),
                totals.clone().unwrap_or_default(),
            );
            return Err(part.file.input("group 'Header'", problem));
        }
        let counts = part.counts()?;
        sums.resize(counts.len().max(sums.len()), 0.0);
        sums.iter_mut().zip(counts).for_each(|(sum, n)| *sum += n);
        part.particles(None)
    })?;
    if let Some(totals) = totals.filter(|t| *t != sums && t.iter().any(|n| *n != 0.0)) {
        let problem = format!("its files have {sums:?} particles together, but NumPart_Total says {totals:?}");
        return Err(FormatError::input(path, FORMAT, "group 'Header'", problem));
    }
    Ok(FileContent::Particles(particles))
}

/// One file with its header.
struct Opened<'p> {
    path: &'p Path,
    file: Reader<'p>,
    groups: Vec<String>,
    attributes: Attributes,
}

impl<'p> Opened<'p> {
    fn new(path: &'p Path) -> Result<Self> {
        let file = Reader::open(path, FORMAT)?;
        let groups = file.groups()?;
        if !groups.iter().any(|g| g == "Header") {
            return Err(file.input(
                "group '/'",
                "there is no group Header, expected a GADGET or SWIFT particle file; name another format with --format",
            ));
        }
        let attributes = file.group_attributes("Header")?;
        Ok(Self { path, file, groups, attributes })
    }

    /// How many files the snapshot has.
    fn files(&self) -> Result<usize> {
        let files = self.attributes.number("NumFilesPerSnapshot").unwrap_or(1.0);
        match files {
            // Some programs leave it at 0.
            n if n == 0.0 || n == 1.0 => Ok(1),
            n if n.fract() == 0.0 && (2.0..=MOST_FILES).contains(&n) => Ok(n as usize),
            n => Err(self
                .file
                .input("group 'Header'", format!("NumFilesPerSnapshot is {n}, expected 1 to {MOST_FILES}"))),
        }
    }

    /// Particles of each type in all files.
    fn totals(&self) -> Option<Vec<f64>> {
        let high = self.attributes.numbers("NumPart_Total_HighWord").unwrap_or_default();
        Some(joined(&self.attributes.numbers("NumPart_Total")?, &high))
    }

    /// Particles of each type in this file.
    fn counts(&self) -> Result<Vec<f64>> {
        let counts = self.attributes.numbers("NumPart_ThisFile").or_else(|| self.totals());
        counts.ok_or_else(|| self.file.input("group 'Header'", "attribute NumPart_ThisFile is missing"))
    }

    /// Of a file that states none: the dimension of a plane or line, if all of its gas lies on one that axes span.
    fn dimension_of(&self, read: &ParticleFile) -> Option<usize> {
        let gas = read.species.iter().find(|s| s.part_type == 0 && s.table.count >= FLAT)?;
        if self.attributes.number("Dimension").is_some() {
            return None;
        }
        let places: Vec<&Column> = read
            .species
            .iter()
            .filter_map(|s| s.table.column(names::COORDINATES))
            .filter(|c| c.components == 3)
            .collect();
        let first = gas.table.column(names::COORDINATES)?;
        let is_one = |k: usize| {
            let value = first.values.get(k);
            places.iter().all(|c| (0..c.values.len() / 3).all(|i| c.values.get(3 * i + k) == value))
        };
        match (is_one(0), is_one(1), is_one(2)) {
            (false, false, true) => Some(2),
            (false, true, true) => Some(1),
            _ => None,
        }
    }

    /// All particles, in the dimension that the header states, or else in `dimension`.
    fn particles(&self, dimension: Option<usize>) -> Result<ParticleFile> {
        let (file, groups, attributes) = (&self.file, &self.groups, &self.attributes);
        let origin = Origin::of(file, groups, attributes)?;
        let mut header = read_header(file, (attributes, dimension), &origin)?;
        header.provenance.extend(dimension.map(|d| {
            let on = if d == 2 { "in one plane" } else { "on one line" };
            ("converted".to_owned(), format!("it states no Dimension, and all gas lies {on}: it is read in {d}-D"))
        }));
        if is_voronoi(file, groups)? {
            header.provenance.push((MESH_KEY.into(), VORONOI.into()));
        }
        let masses = attributes.numbers("MassTable").unwrap_or_default();
        let counts = self.counts()?;
        header.provenance.extend(origin.cosmology(attributes).fact());
        header.provenance.extend(doubts::of_header(attributes, self.files()?, &counts, self.totals().as_deref()));
        let mut species = Vec::new();
        for (part_type, &count) in counts.iter().enumerate().take(usize::from(u8::MAX)) {
            if count == 0.0 {
                continue;
            }
            let reading = SpeciesReading {
                file,
                origin: &origin,
                part_type,
                group: format!("PartType{part_type}"),
                count: whole(file, count)?,
                dimension: header.dimension,
            };
            if !groups.contains(&reading.group) {
                return Err(file.input(
                    format!("group '{}'", reading.group),
                    format!("it is missing, but the header counts {count} such particles"),
                ));
            }
            let mass = masses.get(part_type).copied().filter(|&m| m > 0.0);
            let mut table = reading.table(mass, &mut header.provenance)?;
            if origin.magnetic.is_none() && header.units != UnitSystem::CODE {
                header.provenance.extend(doubts::of_magnetic_field(&table));
            }
            origin.magnetic.unwrap_or_default().read(&mut table, &header.units);
            if part_type == 0 && attributes.number("Flag_Entropy_ICs").is_some_and(|flag| flag != 0.0) {
                let done = entropy::to_energies(self.path, FORMAT, &mut table)?;
                header.provenance.extend(done.map(|what| ("converted".to_owned(), what)));
            }
            species.push(Species { part_type: part_type as u8, table });
        }
        let units = groups.iter().any(|g| g == "Units").then_some(&origin.units);
        let types = species.iter().map(|s| s.part_type);
        let stated = (units, origin.support_over_length(header.dimension));
        header.layouts.push(laid_out::layout((self.path, file), attributes, stated, types)?);
        Ok(ParticleFile { header, species })
    }
}

/// Whether the gas is cells of AREPO: it has what belongs to such, or was compiled with options of the mesh, and has no kernels.
fn is_voronoi(file: &Reader, groups: &[String]) -> Result<bool> {
    const OF_CELLS: [&str; 2] = ["Volume", "CenterOfMass"];
    const OPTIONS: [&str; 2] = ["VORONOI", "REGULARIZE_MESH"];
    if !groups.iter().any(|g| g == "PartType0") {
        return Ok(false);
    }
    let datasets = file.datasets("PartType0")?;
    if datasets.iter().any(|name| ["SmoothingLength", "SmoothingLengths"].contains(&name.as_str())) {
        return Ok(false);
    }
    let options = file.group_attributes("Config")?;
    let is_mesh = options.names().any(|name| OPTIONS.iter().any(|option| name.starts_with(option)));
    Ok(is_mesh || datasets.iter().any(|name| OF_CELLS.contains(&name.as_str())))
}

fn whole(file: &Reader, count: f64) -> Result<usize> {
    if count.fract() == 0.0 && (0.0..1e15).contains(&count) {
        Ok(count as usize)
    } else {
        Err(file.input("group 'Header'", format!("NumPart_ThisFile has {count}, expected a number of particles")))
    }
}

/// What the file says of the program that wrote it.
struct Origin {
    own: Attributes,
    parameters: Attributes,
    units: Attributes,
    /// SWIFT's own group.
    cosmology: Attributes,
    /// SmoothingLength is the kernel's support radius.
    support_radius: bool,
    /// SmoothingLength is SWIFT's with its default eta, for the cubic spline or the neighbors that the file states.
    swift_length: bool,
    /// What a magnetic field is in, where the file or its author says.
    magnetic: Option<MagneticUnit>,
    /// By what BoxSize is longer than each edge, as GADGET-4 was built.
    shortened: [f64; 3],
    /// It is SWIFT's, or for SWIFT: it has units in SWIFT's way, or says so.
    is_swift: bool,
}

impl Origin {
    fn of(file: &Reader, groups: &[String], header: &Attributes) -> Result<Self> {
        let own = file.group_attributes(OWN_GROUP)?;
        let flavor = own.text("Flavor");
        // GADGET-4 alone writes its compile-time options into a group of this name.
        let gadget4 = groups.iter().any(|g| g == "Config");
        let gizmo = header.names().any(|name| name == "GIZMO_version");
        let swift = file.group_attributes("Code")?.text("Code").is_some();
        let kernel = file.group_attributes("HydroScheme")?.text("Kernel function");
        let cubic_spline = kernel.is_none_or(|k| k.starts_with("Cubic spline"));
        let units = file.group_attributes("Units")?;
        let current = units.number("Unit current in cgs (U_I)").unwrap_or(1.0);
        let magnetic = match flavor.as_deref() {
            Some("arepo") => Some(MagneticUnit::Gaussian),
            Some("gizmo") => Some(MagneticUnit::Gauss),
            None if gizmo => Some(MagneticUnit::Gauss),
            Some("swift") => Some(MagneticUnit::Current(current)),
            None if swift => Some(MagneticUnit::Current(current)),
            None if is_voronoi(file, groups)? => Some(MagneticUnit::Gaussian),
            None => None,
            Some(_) => Some(MagneticUnit::HeavisideLorentz),
        };
        let config =
            if gadget4 && own.numbers(OWN_EDGES).is_none() { Some(file.group_attributes("Config")?) } else { None };
        let bits = ["LONG_X_BITS", "LONG_Y_BITS", "LONG_Z_BITS"];
        let shortened = bits.map(|name| {
            let bits =
                config.as_ref().and_then(|config| config.number(name)).filter(|bits| (0.0..=32.0).contains(bits));
            bits.map_or(1.0, f64::exp2)
        });
        Ok(Self {
            magnetic,
            shortened,
            is_swift: swift
                || flavor.as_deref().map_or_else(|| units.number(SWIFT_UNITS[0]).is_some(), |f| f == "swift"),
            swift_length: (swift || flavor.as_deref() == Some("swift")) && cubic_spline,
            support_radius: flavor.as_deref().is_some_and(|f| SUPPORT_RADIUS_FLAVORS.contains(&f))
                || gizmo
                || (gadget4 && !swift),
            own,
            parameters: file.group_attributes("Parameters")?,
            cosmology: file.group_attributes("Cosmology")?,
            units,
        })
    }

    /// Support radii over what the file calls smoothing lengths, where that is known.
    fn support_over_length(&self, dimension: usize) -> Option<f64> {
        // Our own files say for which neighbors they are; all others are for the default build.
        let neighbors = self.own.number("KernelNeighbors").unwrap_or(0.0);
        let of_swift = || 1.0 / (CUBIC_SPLINE_ETA * spacing_over_support(dimension, neighbors));
        if self.support_radius { Some(1.0) } else { self.swift_length.then(of_swift) }
    }

    /// Pure numbers where the file states none.
    fn units(&self, file: &Reader, header: &Attributes) -> Result<UnitSystem> {
        let valid = |key: &str, found: Option<f64>| match found {
            Some(u) if !(u.is_finite() && u > 0.0) => {
                let problem =
                    format!("'{key}' is {u:e}, expected a positive number; correct it, or take all units out");
                Err(file.input("the units", problem))
            }
            found => Ok(found),
        };
        let swift = |key: &str| valid(key, self.units.number(key));
        let [length, mass, time, temperature] = SWIFT_UNITS;
        if let (Some(length), Some(mass), Some(time)) = (swift(length)?, swift(mass)?, swift(time)?) {
            let temperature = swift(temperature)?.unwrap_or(1.0);
            return Ok(UnitSystem { length, mass, time, temperature });
        }
        let gadget = |key: &str| valid(key, self.parameters.number(key).or_else(|| header.number(key)));
        Ok(match (gadget("UnitLength_in_cm")?, gadget("UnitMass_in_g")?, gadget("UnitVelocity_in_cm_per_s")?) {
            (Some(length), Some(mass), Some(velocity)) => {
                UnitSystem { length, mass, time: length / velocity, temperature: 1.0 }
            }
            _ => UnitSystem::CODE,
        })
    }

    /// What is stated of an expanding box. SWIFT's numbers are not per h.
    fn cosmology(&self, header: &Attributes) -> cosmology::Stated {
        let number = |key: &str| self.parameters.number(key).or_else(|| header.number(key));
        cosmology::Stated {
            time: self.cosmology.number("Scale-factor").or_else(|| header.number("Time")),
            redshift: self.cosmology.number("Redshift").or_else(|| header.number("Redshift")),
            hubble: number("HubbleParam").filter(|_| !self.is_swift),
            matter: number("Omega0").or_else(|| number("OmegaMatter")).filter(|_| !self.is_swift),
            is_comoving: self
                .cosmology
                .number("Cosmological run")
                .or_else(|| number("ComovingIntegrationOn"))
                .map(|flag| flag != 0.0),
        }
    }

    fn periodic(&self, used: [bool; 3]) -> [bool; 3] {
        if let Some(axes) = self.own.numbers("Periodic") {
            return std::array::from_fn(|i| axes.get(i).is_some_and(|&p| p != 0.0));
        }
        match self.parameters.text("InitialConditions:periodic").as_deref() {
            Some("0") => [false; 3],
            _ => used,
        }
    }
}

fn read_header(file: &Reader, (header, otherwise): (&Attributes, Option<usize>), origin: &Origin) -> Result<RunHeader> {
    let dimension = match header.number("Dimension") {
        None => otherwise.unwrap_or(3),
        Some(d) if d == 1.0 || d == 2.0 || d == 3.0 => d as usize,
        Some(d) => {
            return Err(file.input("group 'Header'", format!("Dimension is {d}, expected 1, 2 or 3")));
        }
    };
    let edges = origin.own.numbers(OWN_EDGES).or_else(|| header.numbers("BoxSize")).unwrap_or_default();
    let edge = |i: usize| edges.get(i).or(edges.first()).copied().unwrap_or(0.0) / origin.shortened[i];
    let box_size: [f64; 3] = std::array::from_fn(|i| if i < dimension { edge(i) } else { 0.0 });
    if let Some(l) = box_size.iter().find(|l| !(l.is_finite() && **l >= 0.0)) {
        return Err(file.input("group 'Header'", format!("BoxSize is {l}, expected a length")));
    }
    let own = &origin.own;
    let kept = |name: &&str| !matches!(*name, "Flavor" | "Kernel");
    let provenance = own.names().filter(kept).filter_map(|name| Some((name.to_owned(), own.text(name)?))).collect();
    Ok(RunHeader {
        dimension,
        box_size,
        box_corner: None,
        periodic: origin.periodic(box_size.map(|l| l > 0.0)),
        units: origin.units(file, header)?,
        time: header.number("Time").unwrap_or(0.0),
        kernel: own.text("Kernel").unwrap_or_default(),
        kernel_neighbors: own.number("KernelNeighbors").unwrap_or(0.0),
        provenance,
        layouts: Vec::new(),
    })
}

/// One particle group being read.
struct SpeciesReading<'a> {
    file: &'a Reader<'a>,
    origin: &'a Origin,
    part_type: usize,
    group: String,
    count: usize,
    dimension: usize,
}

impl SpeciesReading<'_> {
    fn table(&self, mass: Option<f64>, notes: &mut Vec<(String, String)>) -> Result<ParticleTable> {
        let mut columns = Vec::new();
        for name in self.file.datasets(&self.group)? {
            let path = format!("{}/{name}", self.group);
            match self.column(&path, &name)? {
                Some(column) => columns.push(column),
                None => notes.push(("not read".into(), format!("{path}: not a column of numbers"))),
            }
        }
        if !columns.iter().any(|c| c.name == names::MASSES)
            && let Some(mass) = columns.iter_mut().find(|c| c.name == DYNAMICAL_MASSES)
        {
            (mass.name, mass.dimension) = (names::MASSES.into(), UnitDimension::MASS);
        }
        if !columns.iter().any(|c| c.name == names::COORDINATES) {
            return Err(self.file.input(
                format!("group '{}'", self.group),
                "there is no dataset Coordinates, which every particle file has",
            ));
        }
        let stated = columns.iter().position(|c| c.name == names::MASSES);
        if let Some((m, i)) = mass.zip(stated) {
            // GADGET lets the table override a dataset of masses, SWIFT does not read it: so do as they do.
            let by_table = !self.origin.is_swift;
            notes.extend(doubts::of_masses(self.part_type, m, &columns[i].values.to_f64(), by_table));
            if by_table {
                columns.remove(i);
            }
        }
        if let Some(m) = mass.filter(|_| !columns.iter().any(|c| c.name == names::MASSES)) {
            if stated.is_none() {
                notes.push((LACKS_KEY.into(), format!("Masses of type {}, which MassTable has", self.part_type)));
            }
            columns.push(Column {
                name: names::MASSES.into(),
                components: 1,
                values: Values::F64(vec![m; self.count]),
                dimension: UnitDimension::MASS,
            });
        }
        Ok(ParticleTable { count: self.count, columns })
    }

    fn column(&self, path: &str, name: &str) -> Result<Option<Column>> {
        let Some((shape, values)) = self.file.numbers(path)? else {
            return Ok(None);
        };
        if shape.rows != self.count {
            return Err(self.file.input(
                format!("dataset '{path}'"),
                format!("it has {} rows, but the header counts {} particles", shape.rows, self.count),
            ));
        }
        if shape.columns == 0 || shape.columns > MAX_COMPONENTS {
            return Ok(None);
        }
        let (name, values) = self.renamed(name, values);
        let vector = name == names::COORDINATES || name == names::VELOCITIES;
        if vector && shape.columns < self.dimension {
            return Err(self.file.input(
                format!("dataset '{path}'"),
                format!("it has {} components, expected {}", shape.columns, self.dimension),
            ));
        }
        let (components, values) = if vector {
            (self.dimension, first_components(values, shape.columns, self.dimension))
        } else {
            (shape.columns, values)
        };
        let dimension = match name.as_str() {
            names::MAGNETIC_FIELD => UnitDimension::MAGNETIC_FIELD,
            _ => self.unit_dimension(path, &name)?,
        };
        Ok(Some(Column { name, components, values, dimension }))
    }

    fn renamed(&self, name: &str, values: Values) -> (String, Values) {
        let name = laid_out::singular(name);
        match (name, self.origin.support_over_length(self.dimension)) {
            ("SmoothingLength", Some(1.0)) => (names::SUPPORT_RADIUS.into(), values),
            ("SmoothingLength", Some(gamma)) => {
                let radii = (0..values.len()).map(|i| gamma * values.get(i)).collect();
                (names::SUPPORT_RADIUS.into(), Values::F64(radii))
            }
            (name, _) => (name.into(), values),
        }
    }

    /// By the dataset's own exponents, else by what the name means in every code.
    fn unit_dimension(&self, path: &str, name: &str) -> Result<UnitDimension> {
        let attributes = self.file.dataset_attributes(path)?;
        let exponent = |key: &str| {
            let x = attributes.number(key)?;
            (x.fract() == 0.0 && x.abs() <= 127.0).then_some(x as i8)
        };
        if let (Some(length), Some(mass), Some(time), Some(temperature)) =
            (exponent("U_L exponent"), exponent("U_M exponent"), exponent("U_t exponent"), exponent("U_T exponent"))
        {
            return Ok(UnitDimension::new(length, mass, time, temperature));
        }
        Ok(names::meaning(name, self.dimension))
    }
}

/// Drops the padding of vectors in fewer than three dimensions.
fn first_components(values: Values, from: usize, to: usize) -> Values {
    fn take<T: Copy>(v: Vec<T>, from: usize, to: usize) -> Vec<T> {
        if from == to {
            return v;
        }
        v.chunks_exact(from).flat_map(|row| row.iter().take(to).copied()).collect()
    }
    match values {
        Values::F32(v) => Values::F32(take(v, from, to)),
        Values::F64(v) => Values::F64(take(v, from, to)),
        Values::I64(v) => Values::I64(take(v, from, to)),
    }
}
