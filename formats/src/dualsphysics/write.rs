//! Writes a case from which the code starts.

use super::binary::{self, Kind, Value};
use super::liquid::Liquid;
use super::schema::{COLUMNS, DIMENSIONS, NAME, NORMALS, OWN_ITEM, SURFACE_DISTANCE, UNIT, UNKNOWN_AXES, WALLS, slot};
use crate::common::facts;
use crate::common::flatten::{Flat, flatten_species};
use crate::error::{FormatError, Result};
use crate::model::{ParticleFile, RunHeader, Species};
use crate::particle_names as names;
use crate::registry::WriteOptions;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Spread of masses that rounding to f4 leaves.
const ROUNDING: f64 = 1e-6;

/// Names that the code has for something else.
const TAKEN: [&str; 17] = [
    "Cpart",
    "TimeStep",
    "Npok",
    "Nout",
    "Step",
    "RunTime",
    "DomainMin",
    "DomainMax",
    "Idp",
    "Idpd",
    "Pos",
    "Posd",
    "Vel",
    "Rhop",
    "BoundNor",
    "Mass",
    "Hvar",
];

/// Columns that are arrays of the code's own, or in its header.
const OWN: [&str; 3] = [names::COORDINATES, names::MASSES, names::PARTICLE_TYPE];

/// An array, and how it is written.
struct Planned<'a> {
    name: String,
    kind: (Kind, usize),
    count: usize,
    rows: Rows<'a>,
}

/// Where the numbers of an array come from.
enum Rows<'a> {
    /// From 0 on: of these the code tells which block a particle is of.
    Ids,
    /// A scalar, or a vector of so many components.
    Flat(&'a Flat<'a>),
    Zeros,
    Density,
    /// From particles of walls to the surface.
    ToSurface,
}

/// The particles in the order of the code's blocks.
struct Case<'a> {
    header: &'a RunHeader,
    blocks: Vec<&'a Species>,
    walls: usize,
    fluid: usize,
    liquid: Liquid,
}

pub(super) fn write(path: &Path, file: &ParticleFile, options: WriteOptions) -> Result<()> {
    let refuse = |problem: String| FormatError::Output { path: path.into(), format: NAME, problem };
    let case = Case::new(file).map_err(refuse)?;
    let flats = flatten_species(&case.blocks).map_err(refuse)?;
    let arrays = case.arrays(&flats, options.double_precision).map_err(refuse)?;
    let bytes: usize = arrays.iter().map(|a| a.count * a.kind.0.width() * a.kind.1).sum();
    let mut own = facts::texts(case.header);
    own.extend(flats.iter().filter_map(|flat| {
        let symbol = case.header.units.symbol(flat.dimension);
        (!symbol.is_empty()).then(|| (format!("{UNIT}{}", flat.name), symbol))
    }));
    let own: Vec<(&str, Value)> = own.iter().map(|(k, v)| (k.as_str(), Value::Text(v.clone()))).collect();
    let own = binary::item(OWN_ITEM, &own, 0, 0);
    let (head, wide) = binary::head((bytes + own.len()) as u64);
    let io = |e| FormatError::io(path, "write", e);
    let mut out = BufWriter::with_capacity(1 << 18, File::create(path).map_err(io)?);
    let mut put = |bytes: &[u8]| out.write_all(bytes).map_err(io);
    put(&head)?;
    put(&binary::item("JPartDataBi4", &case.of_case(), 0, 2))?;
    put(&binary::item("PART_0000", &case.of_part(), arrays.len(), 0))?;
    for array in &arrays {
        put(&binary::array(&array.name, array.kind, array.count, wide))?;
        case.numbers(array, &mut put)?;
    }
    put(&own)?;
    out.flush().map_err(io)
}

/// The mass of all particles of a species.
fn one_mass(species: &Species) -> std::result::Result<(), String> {
    let masses = species.table.column(names::MASSES).map(|c| c.values.range());
    let (least, most, _) = masses.unwrap_or((0.0, 0.0, 0));
    if least > 0.0 && most - least <= ROUNDING * most {
        return Ok(());
    }
    Err(format!(
        "the masses of type {} go from {least:e} to {most:e}, but DualSPHysics has one mass for its fluid and one for its walls; place \
         particles of equal mass, or write another format",
        species.part_type
    ))
}

impl<'a> Case<'a> {
    /// # Errors
    /// What the code has no place for.
    fn new(file: &'a ParticleFile) -> std::result::Result<Self, String> {
        let header = &file.header;
        if !DIMENSIONS.contains(&header.dimension) {
            return Err(format!(
                "the particles are in {} dimension, but DualSPHysics has two, x and z, or three",
                header.dimension
            ));
        }
        let there: Vec<&Species> = file.species.iter().filter(|s| s.table.count > 0).collect();
        there.iter().try_for_each(|s| one_mass(s))?;
        let is_other = |s: &&&Species| ![0, WALLS].contains(&s.part_type) || s.table.is_of_points();
        if let Some(other) = there.iter().find(is_other) {
            return Err(format!(
                "there are particles of type {}, but DualSPHysics has fluid (0) and walls ({WALLS}) only; leave them out (`convert --types 0`)",
                other.part_type
            ));
        }
        let of = |t: u8| there.iter().copied().filter(move |s| s.part_type == t);
        let count = |t: u8| of(t).map(|s| s.table.count).sum::<usize>();
        let (walls, fluid) = (count(WALLS), count(0));
        if walls + fluid > u32::MAX as usize / 2 {
            return Err(format!("there are {} particles, but DualSPHysics numbers them to 2^31", walls + fluid));
        }
        let Some(liquid) = Liquid::of(file) else {
            return Err("there are no particles of fluid (type 0) with masses and densities, of which the code's constants are made".into());
        };
        Ok(Self { header, blocks: of(WALLS).chain(of(0)).collect(), walls, fluid, liquid })
    }

    fn count(&self) -> usize {
        self.walls + self.fluid
    }

    /// What is said of all times.
    fn of_case(&self) -> Vec<(&'static str, Value)> {
        let text = |text: &str| Value::Text(text.into());
        let long = |n: usize| Value::Whole(Kind::U64, n as i64);
        let l = &self.liquid;
        let (low, high) = self.limits();
        let none = Value::Triple([0.0; 3]);
        let axes = (0..self.header.dimension).filter(|&k| self.header.periodic[k]);
        let axes: i64 = axes.map(|k| 1 << slot(k, self.header.dimension)).sum();
        vec![
            ("Piece", Value::Whole(Kind::U32, 0)),
            ("Npiece", Value::Whole(Kind::U32, 1)),
            // The time of writing would make equal particles unequal files.
            ("RunCode", text("00000000")),
            ("Date", text("???")),
            ("AppName", text(concat!("sph-prep ", env!("CARGO_PKG_VERSION")))),
            ("CaseName", text("")),
            ("Data2d", Value::Bool(self.header.dimension == 2)),
            ("Data2dPosY", Value::Real(0.0)),
            // The code finds them by itself, and from what it is told of its domain.
            ("MapPosMin", none.clone()),
            ("MapPosMax", none.clone()),
            ("PeriMode", Value::Whole(Kind::I32, if axes == 7 { UNKNOWN_AXES } else { axes })),
            ("PeriXinc", none.clone()),
            ("PeriYinc", none.clone()),
            ("PeriZinc", none),
            ("AxisDiv", Value::Whole(Kind::I32, 0)),
            ("CaseNp", long(self.count())),
            ("CaseNfixed", long(self.walls)),
            ("CaseNmoving", long(0)),
            ("CaseNfloat", long(0)),
            ("CaseNfluid", long(self.fluid)),
            ("CasePosMin", Value::Triple(low)),
            ("CasePosMax", Value::Triple(high)),
            ("NpDynamic", Value::Bool(false)),
            ("ReuseIds", Value::Bool(false)),
            ("Dp", Value::Real(l.spacing)),
            ("H", Value::Real(l.smoothing_length)),
            ("B", Value::Real(l.stiffness())),
            ("Rhop0", Value::Real(l.density)),
            ("Gamma", Value::Real(l.gamma)),
            ("MassBound", Value::Real(l.wall_mass)),
            ("MassFluid", Value::Real(l.mass)),
        ]
    }

    /// What is said of this time.
    fn of_part(&self) -> Vec<(&'static str, Value)> {
        let whole = |n: usize| Value::Whole(Kind::U32, n as i64);
        let (low, high) = self.limits();
        vec![
            ("Cpart", whole(0)),
            ("TimeStep", Value::Real(self.header.time)),
            ("Npok", whole(self.count())),
            ("Nout", whole(0)),
            ("Step", whole(0)),
            ("RunTime", Value::Real(0.0)),
            ("DomainMin", Value::Triple(low)),
            ("DomainMax", Value::Triple(high)),
        ]
    }

    /// The box of all particles. Along periodic axes it ends half a spacing before the faces: the code takes it for that of a
    /// lattice, and adds as much for the period.
    fn limits(&self) -> ([f64; 3], [f64; 3]) {
        let d = self.header.dimension;
        let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
        for axis in 0..d {
            let k = slot(axis, d);
            if self.header.periodic[axis] && self.header.box_size[axis] > 0.0 {
                let corner = self.header.box_corner.map_or(0.0, |c| c[axis]);
                low[k] = corner + 0.5 * self.liquid.spacing;
                high[k] = corner + self.header.box_size[axis] - 0.5 * self.liquid.spacing;
                continue;
            }
            (low[k], high[k]) = (f64::INFINITY, f64::NEG_INFINITY);
            for column in self.blocks.iter().filter_map(|s| s.table.column(names::COORDINATES)) {
                for i in (axis..column.values.len()).step_by(d) {
                    let x = column.values.get(i);
                    (low[k], high[k]) = (low[k].min(x), high[k].max(x));
                }
            }
        }
        (low, high)
    }

    /// Every array: those of the code first.
    fn arrays<'f>(&self, flats: &'f [Flat<'f>], double: bool) -> std::result::Result<Vec<Planned<'f>>, String> {
        let find = |name: &str| flats.iter().find(|f| f.name == name);
        let count = self.count();
        let plan = |name: &str, kind, rows| Planned { name: name.into(), kind, count, rows };
        let places = find(names::COORDINATES).ok_or("there are no coordinates")?;
        let speeds = find(names::VELOCITIES);
        let mut arrays = vec![
            plan("Idp", (Kind::U32, 1), Rows::Ids),
            plan("Posd", (Kind::F64, 3), Rows::Flat(places)),
            plan("Vel", (Kind::F32, 3), speeds.map_or(Rows::Zeros, Rows::Flat)),
            plan("Rhop", (Kind::F32, 1), Rows::Density),
        ];
        let has_surface =
            self.walls > 0 && self.blocks.iter().take_while(|s| s.part_type == WALLS).all(|s| has_surface(s));
        if has_surface {
            arrays.push(Planned { count: self.walls, ..plan("BoundNor", (Kind::F32, 3), Rows::ToSurface) });
        }
        for flat in flats {
            let name = flat.name.as_str();
            let is_held = match name {
                names::VELOCITIES => !double,
                NORMALS | SURFACE_DISTANCE => has_surface,
                _ => OWN.contains(&name),
            };
            let is_lost = COLUMNS.loses(name, flat.components).is_some();
            if is_held || is_lost {
                continue;
            }
            let kind = match flat.integers {
                true => Kind::I64,
                false if flat.wants_double(double) => Kind::F64,
                false => Kind::F32,
            };
            let components = if flat.components == 1 { 1 } else { 3 };
            let name = if TAKEN.contains(&name) { names::apart(name) } else { name.to_owned() };
            arrays.push(plan(&name, (kind, components), Rows::Flat(flat)));
        }
        Ok(arrays)
    }

    fn numbers(&self, array: &Planned, put: &mut impl FnMut(&[u8]) -> Result<()>) -> Result<()> {
        let (kind, components) = array.kind;
        let mut real = |v: f64| match kind {
            Kind::F32 => put(&(v as f32).to_le_bytes()),
            _ => put(&v.to_le_bytes()),
        };
        match &array.rows {
            Rows::Zeros => (0..components * array.count).try_for_each(|_| real(0.0)),
            Rows::Density => {
                self.blocks.iter().flat_map(|s| (0..s.table.count).map(|i| self.density(s, i))).try_for_each(real)
            }
            Rows::ToSurface => {
                let walls = self.blocks.iter().filter(|s| s.part_type == WALLS);
                let rows = walls.flat_map(|s| (0..s.table.count).map(|i| to_surface(s, i, self.header.dimension)));
                rows.flatten().try_for_each(real)
            }
            Rows::Flat(flat) if components == 1 && kind == Kind::I64 => {
                flat.whole().try_for_each(|v| put(&v.to_le_bytes()))
            }
            Rows::Flat(flat) if components == 1 => flat.floats().try_for_each(real),
            Rows::Flat(flat) => {
                let mut row = Vec::with_capacity(flat.components);
                flat.floats().try_for_each(|v| {
                    row.push(v);
                    if row.len() < flat.components {
                        return Ok(());
                    }
                    let triple = in_space(&row);
                    row.clear();
                    triple.into_iter().try_for_each(&mut real)
                })
            }
            Rows::Ids => (0..array.count as u32).try_for_each(|i| put(&i.to_le_bytes())),
        }
    }

    /// The code knows no pressures: gas has the density that belongs to its own, and that of rest without one. A summed density lacks what is
    /// not there beside a free surface, which would be a large negative pressure.
    fn density(&self, species: &Species, i: usize) -> f64 {
        let value = |name: &str| species.table.column(name).map(|c| c.values.get(i));
        let pressure = value(names::PRESSURE).filter(|p| species.part_type == 0 && p.is_finite());
        match pressure {
            Some(pressure) => self.liquid.density_at(pressure),
            None if species.part_type == WALLS => value(names::DENSITY).unwrap_or(self.liquid.density),
            None => self.liquid.density,
        }
    }
}

/// A vector in the code's axes.
fn in_space(row: &[f64]) -> [f64; 3] {
    let mut triple = [0.0; 3];
    for (axis, v) in row.iter().enumerate().take(3) {
        triple[slot(axis, row.len())] = *v;
    }
    triple
}

fn has_surface(species: &Species) -> bool {
    [NORMALS, SURFACE_DISTANCE].iter().all(|name| species.table.column(name).is_some())
}

/// From a particle of a wall to the nearest point of its surface.
fn to_surface(species: &Species, i: usize, d: usize) -> [f64; 3] {
    let value = |name: &str, at: usize| species.table.column(name).map_or(0.0, |c| c.values.get(at));
    let distance = value(SURFACE_DISTANCE, i);
    let normal: Vec<f64> = (0..d).map(|k| distance * value(NORMALS, d * i + k)).collect();
    in_space(&normal)
}
