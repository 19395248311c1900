//! Reads full and small dumps, of one or several MPI processes.

use super::layout::{
    BOX_CORNER, CAPTURE_END, CAPTURE_REAL, CENTERED_BOX, HFACT, IDENTITY, KINDS, Kind, PURE_NUMBERS, SUPPORT, TAG,
    part_type,
};
use super::schema::{CAPTURE, NAME};
use super::sinks::{SOFTENING, TAGS};
use crate::common::assemble::{self, Named};
use crate::common::facts::Facts;
use crate::common::fortran::Records;
use crate::error::{FormatError, Result};
use crate::limits::MAX_VARIABLE_BYTES;
use crate::model::{Column, ISOTHERMAL_KEY, ParticleFile, ParticleTable, Species, Values, adiabatic_fact};
use crate::particle_names as names;
use crate::registry::{FieldRequest, FileContent};
use crate::units::{UnitDimension, UnitSystem};
use std::path::Path;

/// The block that has the magnetic field, in files of a Phantom with one, and its components.
const OF_FIELD: usize = 3;
const FIELD: [&str; 3] = ["Bx", "By", "Bz"];
/// Phantom's numbers of equations of state in which the energy does not occur: isothermal, in one way or another, and barotropic.
const WITHOUT_ENERGIES: [f64; 6] = [1.0, 3.0, 6.0, 7.0, 8.0, 13.0];
/// Most items of a header block, arrays of a type and MPI blocks that are accepted.
const MAX_ITEMS: i64 = 4096;

pub(super) fn read(path: &Path, _request: &FieldRequest) -> Result<FileContent> {
    let mut records = Records::open(path, NAME)?;
    let real = capture(&mut records)?;
    let identity = records.exactly("the identity", IDENTITY as u64)?;
    if identity.get(1) != Some(&b'T') {
        return Err(FormatError::Unsupported {
            path: path.into(),
            format: NAME,
            what: "a dump without tags; read it with a recent Phantom and write it again".into(),
        });
    }
    let header = Header::read(&mut records, real)?;
    let mut dump =
        Dump { records, real, header, arrays: Vec::new(), sinks: Vec::new(), notes: Vec::new(), has_energies: false };
    dump.arrays()?;
    let identity = String::from_utf8_lossy(&identity).trim_end().to_owned();
    dump.finish(identity).map(FileContent::Particles)
}

/// Reads the first record; returns the width of a real.
fn capture(records: &mut Records) -> Result<usize> {
    let bytes = records.record("the capture pattern", 64)?;
    let real = match bytes.len() {
        24 => 8,
        20 => 4,
        n => {
            let problem = format!("it has {n} bytes, expected 24 or 20; name another format with --format");
            return Err(records.error("the capture pattern", problem));
        }
    };
    let (first, rest) = bytes.split_at(4);
    let (number, rest) = rest.split_at(real);
    let first = decode(first, Kind::Int, real, records.big_endian).get(0);
    let number = decode(number, Kind::Real, real, records.big_endian).get(0);
    let rest = decode(rest, Kind::Int, real, records.big_endian).to_f64();
    let expected = [f64::from(CAPTURE), f64::from(CAPTURE_REAL), f64::from(CAPTURE_REAL), f64::from(CAPTURE_END)];
    let found = [first, number, rest.first().copied().unwrap_or(0.0), rest.last().copied().unwrap_or(0.0)];
    if found != expected {
        let problem = format!("it has the numbers {found:?}, expected {expected:?}; it is not a Phantom dump");
        return Err(records.error("the capture pattern", problem));
    }
    Ok(real)
}

/// Numbers from a record.
fn decode(bytes: &[u8], kind: Kind, real: usize, big_endian: bool) -> Values {
    fn each<T, const W: usize>(bytes: &[u8], big_endian: bool, from: impl Fn([u8; W]) -> T) -> Vec<T> {
        let ordered = |word: &[u8; W]| {
            let mut word = *word;
            if big_endian {
                word.reverse();
            }
            from(word)
        };
        bytes.as_chunks::<W>().0.iter().map(ordered).collect()
    }
    match (kind, kind.width(real)) {
        (Kind::Real | Kind::Real4 | Kind::Real8, 4) => Values::F32(each(bytes, big_endian, f32::from_le_bytes)),
        (Kind::Real | Kind::Real4 | Kind::Real8, _) => Values::F64(each(bytes, big_endian, f64::from_le_bytes)),
        (_, 1) => Values::I64(each(bytes, big_endian, |b| i64::from(i8::from_le_bytes(b)))),
        (_, 2) => Values::I64(each(bytes, big_endian, |b| i64::from(i16::from_le_bytes(b)))),
        (_, 4) => Values::I64(each(bytes, big_endian, |b| i64::from(i32::from_le_bytes(b)))),
        _ => Values::I64(each(bytes, big_endian, i64::from_le_bytes)),
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).trim_end_matches([' ', '\0']).to_owned()
}

/// All items of the header, in order.
struct Header(Vec<(String, f64)>);

impl Header {
    fn read(records: &mut Records, real: usize) -> Result<Self> {
        let mut items = Vec::new();
        for (number, kind) in KINDS.into_iter().enumerate() {
            let location = format!("header block {}", number + 1);
            let count = whole(records, &location)?;
            if !(0..=MAX_ITEMS).contains(&count) {
                return Err(records.error(&location, format!("it has {count} items, expected 0 to {MAX_ITEMS}")));
            }
            if count == 0 {
                continue;
            }
            let tags = records.exactly(&location, count as u64 * TAG as u64)?;
            let bytes = records.exactly(&location, count as u64 * kind.width(real) as u64)?;
            let values = decode(&bytes, kind, real, records.big_endian);
            items.extend(tags.as_chunks::<TAG>().0.iter().enumerate().map(|(i, tag)| (text(tag), values.get(i))));
        }
        Ok(Self(items))
    }

    fn all<'a>(&'a self, tag: &'a str) -> impl Iterator<Item = f64> + 'a {
        self.0.iter().filter(move |(t, _)| t == tag).map(|(_, x)| *x)
    }

    fn number(&self, tag: &str) -> Option<f64> {
        self.all(tag).next().filter(|x| x.is_finite())
    }

    fn units(&self) -> UnitSystem {
        if self.number(PURE_NUMBERS).is_some_and(|pure| pure != 0.0) {
            return UnitSystem::CODE;
        }
        let unit = |tag: &str| self.number(tag).filter(|u| *u > 0.0);
        match (unit("udist"), unit("umass"), unit("utime")) {
            (Some(length), Some(mass), Some(time)) => UnitSystem { length, mass, time, temperature: 1.0 },
            _ => UnitSystem::CODE,
        }
    }
}

/// A record of one integer.
fn whole(records: &mut Records, location: &str) -> Result<i64> {
    let bytes = records.exactly(location, 4)?;
    Ok(decode(&bytes, Kind::Int, 8, records.big_endian).get(0) as i64)
}

struct Dump<'a> {
    records: Records<'a>,
    real: usize,
    header: Header,
    arrays: Vec<(String, Values)>,
    /// Those of sinks.
    sinks: Vec<(String, Values)>,
    notes: Vec<String>,
    has_energies: bool,
}

impl Dump<'_> {
    /// Reads the arrays of all MPI blocks.
    fn arrays(&mut self) -> Result<()> {
        let blocks = self.header.number("nblocks").map_or(1, |n| n as i64).max(1);
        let all = whole(&mut self.records, "the number of array lengths")?;
        let lengths = all / blocks;
        if all % blocks != 0 || !(1..=12).contains(&lengths) || blocks > MAX_ITEMS {
            let problem = format!("it is {all} for {blocks} MPI blocks, expected 1 to 12 for each");
            return Err(self.records.error("the number of array lengths", problem));
        }
        for _ in 0..blocks {
            let mut heads = Vec::new();
            for number in 1..=lengths {
                heads.push(self.array_head(number)?);
            }
            for (number, (length, counts)) in heads.into_iter().enumerate() {
                self.block(number, length, &counts)?;
            }
        }
        self.has_energies = self.arrays.iter().any(|(tag, _)| tag == "u");
        Ok(())
    }

    fn array_head(&mut self, number: i64) -> Result<(u64, Vec<i64>)> {
        let location = format!("array head {number}");
        let bytes = self.records.exactly(&location, 40)?;
        let (length, counts) = bytes.split_at(8);
        let big_endian = self.records.big_endian;
        let length = match decode(length, Kind::Int8, 8, big_endian) {
            Values::I64(v) => v.first().copied().unwrap_or(0),
            _ => 0,
        };
        let counts: Vec<i64> = decode(counts, Kind::Int4, 8, big_endian).to_f64().iter().map(|n| *n as i64).collect();
        let possible = (0..=(MAX_VARIABLE_BYTES / 8) as i64).contains(&length);
        if !possible || counts.iter().any(|n| !(0..=MAX_ITEMS).contains(n)) {
            let problem = format!("it declares {counts:?} arrays of length {length}, which cannot be");
            return Err(self.records.error(&location, problem));
        }
        Ok((length as u64, counts))
    }

    /// The arrays of one length: 0 the particles, 1 the sinks, 3 the magnetic field of particles, then others.
    fn block(&mut self, number: usize, length: u64, counts: &[i64]) -> Result<()> {
        for (kind, count) in KINDS.into_iter().zip(counts) {
            for _ in 0..*count {
                let tag = text(&self.records.exactly("an array's tag", TAG as u64)?);
                let location = format!("array '{tag}'");
                let bytes = length * kind.width(self.real) as u64;
                let is_known = match number {
                    0 => true,
                    1 => length > 0 && TAGS.contains(&tag.as_str()),
                    OF_FIELD => FIELD.contains(&tag.as_str()),
                    _ => false,
                };
                if !is_known {
                    self.records.skip(&location, bytes)?;
                    continue;
                }
                let record = self.records.exactly(&location, bytes)?;
                let values = decode(&record, kind, self.real, self.records.big_endian);
                if number == 1 {
                    // Every MPI block has all of them.
                    if self.sinks.iter().all(|(t, _)| *t != tag) {
                        self.sinks.push((tag, values));
                    }
                    continue;
                }
                match self.arrays.iter_mut().find(|(t, _)| *t == tag) {
                    None => self.arrays.push((tag, values)),
                    Some((_, known)) => {
                        if !append(known, values) {
                            return Err(self.records.error(&location, "it has another type in another MPI block"));
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn finish(mut self, identity: String) -> Result<ParticleFile> {
        let find = |tag: &str| self.arrays.iter().find(|(t, _)| t == tag).map(|(_, v)| v);
        let Some(h) = find("h") else {
            return Err(self.records.error("array 'h'", "it is missing, which every dump has"));
        };
        let count = h.len();
        if let Some((tag, values)) = self.arrays.iter().find(|(_, v)| v.len() != count) {
            let problem = format!("it has {} values for {count} particles", values.len());
            return Err(self.records.error(&format!("array '{tag}'"), problem));
        }
        let types: Vec<i64> = match find("itype") {
            Some(v) => v.to_f64().iter().map(|t| *t as i64).collect(),
            None => vec![1; count],
        };
        let alive: Vec<usize> = (0..count).filter(|&i| h.get(i) > 0.0).collect();
        if alive.len() < count {
            self.notes.push(format!("{} particles with h <= 0, which were accreted", count - alive.len()));
        }
        let masses = self.masses(&types)?;
        let mut named = self.derived(h, masses);
        let field = match FIELD.map(find) {
            [Some(x), Some(y), Some(z)] => {
                let rows = alive.iter().flat_map(|&i| [x.get(i), y.get(i), z.get(i)]);
                Some(Values::F64(rows.collect()))
            }
            _ => None,
        };
        if field.is_some() {
            self.arrays.retain(|(tag, _)| !FIELD.contains(&tag.as_str()));
        }
        let with_types = types.iter().any(|t| *t != 1);
        if with_types {
            let values = Values::I64(types.iter().map(|t| i64::from(part_type(t.abs()))).collect());
            named.push(array(names::PARTICLE_TYPE, values));
        }
        for (tag, values) in std::mem::take(&mut self.arrays) {
            let axis = ["x", "y", "z"].iter().position(|axis| *axis == tag);
            let shift = axis.map_or(0.0, |k| self.shift(k));
            let values = if shift == 0.0 { values } else { shifted(&values, shift) };
            match tag.as_str() {
                "h" | "itype" => {}
                "iorig" => named.push(array(names::PARTICLE_IDS, values)),
                _ => named.push(array(&tag, values)),
            }
        }
        if alive.len() < count {
            named.iter_mut().for_each(|a| a.values = picked(&a.values, &alive));
        }
        let whole = |values| Named { name: names::MAGNETIC_FIELD.into(), components: 3, values, unit: None };
        named.extend(field.map(whole));
        let sinks = self.sinks();
        let facts = self.facts(identity);
        let mut file = assemble::particles(alive.len(), named, facts)
            .map_err(|(location, problem)| self.records.error(&location, problem))?;
        for species in file.species.iter_mut().filter(|s| s.part_type != 0) {
            // Phantom stores zeros for whatever has no energy.
            let empty = |c: &Column| c.name == names::INTERNAL_ENERGY && c.values.range() == (0.0, 0.0, 0);
            species.table.columns.retain(|c| !empty(c));
        }
        if let Some(table) = sinks {
            let is_free = |t: &u8| file.species.iter().all(|s| s.part_type != *t);
            match [1, 5, 4, 3, 2].into_iter().find(is_free) {
                Some(part_type) => file.species.push(Species { part_type, table }),
                None => return Err(self.records.error("the sinks", "no particle type is left for them, of 1 to 5")),
            }
        }
        Ok(file)
    }

    /// The sinks.
    fn sinks(&mut self) -> Option<ParticleTable> {
        let arrays = std::mem::take(&mut self.sinks);
        let find = |tag: &str| arrays.iter().find(|(t, _)| t == tag).map(|(_, v)| v);
        let count = arrays.first().map(|(_, v)| v.len())?;
        if let Some(tag) = TAGS[..4].iter().find(|tag| find(tag).is_none_or(|v| v.len() != count)) {
            self.notes.push(format!("{count} sink particles, which have no '{tag}'"));
            return None;
        }
        let scalar = |tag: &str, factor: f64| -> Option<Values> {
            let found = find(tag).filter(|v| v.len() == count)?;
            Some(Values::F64((0..count).map(|i| factor * found.get(i)).collect()))
        };
        let vector = |prefix: &str, shift: &dyn Fn(usize) -> f64| -> Option<Values> {
            let axes = ["x", "y", "z"].map(|axis| find(&format!("{prefix}{axis}")).filter(|v| v.len() == count));
            let [Some(x), Some(y), Some(z)] = axes else { return None };
            let row = |i: usize| [x.get(i) + shift(0), y.get(i) + shift(1), z.get(i) + shift(2)];
            Some(Values::F64((0..count).flat_map(row).collect()))
        };
        let found = [
            (names::COORDINATES, 3, vector("", &|k| self.shift(k)), UnitDimension::LENGTH),
            (names::MASSES, 1, scalar("m", 1.0), UnitDimension::MASS),
            (names::VELOCITIES, 3, vector("v", &|_| 0.0), UnitDimension::VELOCITY),
            (names::ACCRETION_RADIUS, 1, scalar("h", 1.0), UnitDimension::LENGTH),
            (names::SOFTENING_RADIUS, 1, scalar("hsoft", SOFTENING), UnitDimension::LENGTH),
        ];
        let columns = found.into_iter().filter_map(|(name, components, values, dimension)| {
            Some(Column { name: name.into(), components, values: values?, dimension })
        });
        Some(ParticleTable { count, columns: columns.collect() })
    }

    fn masses(&self, types: &[i64]) -> Result<Vec<f64>> {
        let table: Vec<f64> = self.header.all("massoftype").collect();
        let mass = |t: &i64| {
            let slot = usize::try_from(t.abs() - 1).ok();
            slot.and_then(|slot| table.get(slot)).copied().filter(|m| m.is_finite() && *m > 0.0).ok_or_else(|| {
                let problem = format!("it has no mass for particles of type {t}, expected one in massoftype");
                self.records.error("the header", problem)
            })
        };
        types.iter().map(mass).collect()
    }

    /// Masses, densities and support radii.
    fn derived(&self, h: &Values, masses: Vec<f64>) -> Vec<Named> {
        let hfact = self.header.number("hfact").filter(|f| *f > 0.0).unwrap_or(HFACT);
        let density = (0..h.len()).zip(&masses).map(|(i, m)| m * (hfact / h.get(i)).powi(3)).collect();
        let support = (0..h.len()).map(|i| SUPPORT * h.get(i)).collect();
        vec![
            array(names::MASSES, Values::F64(masses)),
            array(names::DENSITY, Values::F64(density)),
            array(names::SUPPORT_RADIUS, Values::F64(support)),
        ]
    }

    /// From an open box about the origin to one with its corner there, where nothing else is said of its place.
    fn shift(&self, axis: usize) -> f64 {
        let edge = self.header.number(CENTERED_BOX[axis]).filter(|edge| *edge > 0.0);
        edge.filter(|_| self.header.number(BOX_CORNER[axis]).is_none()).map_or(0.0, |edge| 0.5 * edge)
    }

    /// Where the box lies, unless its corner is the origin.
    fn corner(&self, periodic: bool) -> Option<[f64; 3]> {
        let number = |tag: &str| self.header.number(tag).filter(|x| x.is_finite());
        let tags = if periodic { ["xmin", "ymin", "zmin"] } else { BOX_CORNER };
        let [Some(x), Some(y), Some(z)] = tags.map(number) else { return None };
        Some([x, y, z]).filter(|corner| !periodic || *corner != [0.0; 3])
    }

    /// What is said of gas without energies, whose equation of state needs none.
    fn isothermal(&self) -> Option<(String, String)> {
        let equation = self.header.number("ieos").filter(|ieos| WITHOUT_ENERGIES.contains(ieos))?;
        (!self.has_energies).then(|| (ISOTHERMAL_KEY.to_owned(), format!("equation of state {equation}")))
    }

    fn facts(&self, identity: String) -> Facts {
        let number = |tag: &str| self.header.number(tag);
        let span = |axis: &str| Some(number(&format!("{axis}max"))? - number(&format!("{axis}min"))?);
        let spans = ["x", "y", "z"].map(|axis| span(axis).filter(|l| *l > 0.0));
        let periodic = spans.iter().all(Option::is_some);
        let open = CENTERED_BOX.map(|tag| number(tag).filter(|l| *l >= 0.0));
        let edges = if periodic { spans } else { open };
        let mut provenance = vec![("Dump".to_owned(), identity)];
        provenance.extend(number("gamma").and_then(adiabatic_fact));
        provenance.extend(self.isothermal());
        provenance.extend(self.notes.iter().map(|note| ("not read".to_owned(), note.clone())));
        Facts {
            dimension: Some(3),
            box_size: Some(edges.map(|l| l.unwrap_or(0.0))),
            box_corner: self.corner(periodic),
            periodic: Some([periodic; 3]),
            units: Some(self.header.units()),
            time: number("time"),
            provenance,
            ..Facts::default()
        }
    }
}

fn array(name: &str, values: Values) -> Named {
    Named { name: name.into(), components: 1, values, unit: None }
}

fn shifted(values: &Values, by: f64) -> Values {
    Values::F64((0..values.len()).map(|i| values.get(i) + by).collect())
}

fn append(to: &mut Values, more: Values) -> bool {
    match (to, more) {
        (Values::F32(a), Values::F32(b)) => a.extend(b),
        (Values::F64(a), Values::F64(b)) => a.extend(b),
        (Values::I64(a), Values::I64(b)) => a.extend(b),
        _ => return false,
    }
    true
}

fn picked(values: &Values, rows: &[usize]) -> Values {
    match values {
        Values::F32(v) => Values::F32(rows.iter().filter_map(|&i| v.get(i).copied()).collect()),
        Values::F64(v) => Values::F64(rows.iter().filter_map(|&i| v.get(i).copied()).collect()),
        Values::I64(v) => Values::I64(rows.iter().filter_map(|&i| v.get(i).copied()).collect()),
    }
}
