//! A relaxed periodic box, repeated along its axes and, if there is a target, mapped to it by mass coordinates ([`crate::seeding::MassMap`]).
//! This gives more particles than could be relaxed at once, with the noise of the box. Only the box and a few blocks are in memory.

use super::remarks::Remarks;
use super::streamed::{Places, Read, Streamed, prepare};
use crate::error::{Error, Result};
use crate::input::particles::is_zero;
use crate::scene::Scene;
use crate::seeding::MassMap;
use crate::target::{Positions, Target};
use sph::domain::{Domain, Region};
use sph::parallel;
use sph_formats::common::particle_names as names;
use sph_formats::model::FILES_KEY;
use sph_formats::stream::TYPES;
use sph_formats::{Column, FormatError, FormatSpec, ParticleFile, ParticleStream, ParticleTable, RunHeader, Values};
use std::ops::Range;

/// Copies, at most: the first particle of each is kept where only some of them are used.
const MOST_COPIES: usize = 1 << 24;
/// Largest relative spread of the densities of a box that is taken for uniform.
const UNIFORM: f64 = 0.05;
/// A stretch of the box beyond this factor is worth a note.
const STRETCHED: f64 = 1.01;

/// A periodic box with its copies.
#[derive(Debug)]
pub struct Repeated {
    tile: ParticleFile,
    times: [usize; 3],
    copies: usize,
    header: RunHeader,
    /// Added to a particle's number for each copy before its own.
    stride: i64,
}

impl Repeated {
    /// Repeats `tile` so many `times` along each of its axes.
    ///
    /// # Errors
    /// A box that is not periodic where it is repeated, particles outside of it, or numbers that 64 bits do not hold.
    pub fn new(tile: ParticleFile, times: &[usize]) -> Result<Self> {
        let d = tile.header.dimension;
        let refuse = |problem: String| Err(Error::scene("--times", problem));
        if times.len() != d || times.contains(&0) {
            let problem = format!("is {times:?}, expected {d} numbers from 1 on, one for each axis of the box");
            return refuse(problem);
        }
        for (k, name) in ["x", "y", "z"].iter().enumerate().take(d) {
            let edge = tile.header.box_size[k];
            if !(edge > 0.0 && edge.is_finite()) {
                return refuse(format!("repeats a box whose edge along {name} is {edge}; expected a positive length"));
            }
            if times[k] > 1 && !tile.header.periodic[k] {
                return refuse(format!(
                    "repeats the box along {name}, where it is not periodic: its copies would not fit together; relax it with boundary: periodic"
                ));
            }
        }
        let all: [usize; 3] = sph::array(|k| times.get(k).copied().unwrap_or(1));
        let copies = all.iter().try_fold(1_usize, |n, &t| n.checked_mul(t)).filter(|&n| n <= MOST_COPIES);
        let Some(copies) = copies else {
            return refuse(format!("is {times:?}, more than {MOST_COPIES} copies; relax a larger box"));
        };
        let stride = check(&tile, d)?;
        let largest = i64::try_from(copies).ok().and_then(|n| n.checked_mul(stride));
        let total = tile.counts().iter().sum::<usize>().checked_mul(copies);
        if largest.is_none() || total.is_none() {
            return refuse(format!("is {times:?}: the particles' numbers would go beyond 64 bits"));
        }
        let mut header = tile.header.clone();
        (0..d).for_each(|k| header.box_size[k] *= all[k] as f64);
        header.provenance.retain(|(key, _)| key != FILES_KEY);
        header.provenance.push(("Repeated".into(), times.iter().map(usize::to_string).collect::<Vec<_>>().join(" x ")));
        Ok(Self { tile, times: all, copies, header, stride })
    }

    /// Place of a copy among the others along each axis.
    fn place(&self, copy: usize) -> [usize; 3] {
        let [nx, ny, _] = self.times;
        [copy % nx, copy / nx % ny, copy / nx / ny]
    }
}

/// Refuses particles outside of their box; returns by how much numbers of a copy differ from those of the one before.
fn check(tile: &ParticleFile, d: usize) -> Result<i64> {
    let (mut smallest, mut largest) = (i64::MAX, 0);
    for species in &tile.species {
        let table = &species.table;
        let refuse = |problem: String| Err(Error::field(format!("particles of type {}", species.part_type), problem));
        let Some(x) = table.column(names::COORDINATES).filter(|c| c.components == d) else {
            return refuse(format!("have no coordinates along {d} axes"));
        };
        let outside = (0..x.values.len()).find(|i| !(0.0..=tile.header.box_size[i % d]).contains(&x.values.get(*i)));
        if let Some(i) = outside {
            return refuse(format!("lie outside of their box: particle {} has {}", i / d, x.values.get(i)));
        }
        if let Some(ids) = table.column(names::PARTICLE_IDS) {
            let own = |i: usize| match &ids.values {
                Values::I64(v) => v[i],
                values => values.get(i) as i64,
            };
            for i in 0..ids.values.len() {
                if own(i) < 0 {
                    return refuse(format!("have the number {}, expected none below 0", own(i)));
                }
                (smallest, largest) = (smallest.min(own(i)), largest.max(own(i)));
            }
        }
    }
    // Numbers from 1 to N go on with N + 1.
    Ok((largest - smallest.min(largest)).saturating_add(1))
}

impl ParticleStream for Repeated {
    fn header(&self) -> &RunHeader {
        &self.header
    }

    fn counts(&self) -> [usize; TYPES] {
        self.tile.counts().map(|n| n * self.copies)
    }

    fn rows(
        &self,
        part_type: u8,
        rows: Range<usize>,
        wanted: &dyn Fn(&str) -> bool,
    ) -> std::result::Result<ParticleTable, FormatError> {
        let mut tables = self.tile.species.iter().filter(|s| s.part_type == part_type).map(|s| &s.table);
        let Some(table) = tables.find(|t| t.count > 0) else { return Ok(ParticleTable::default()) };
        let columns = table.columns.iter().filter(|c| wanted(&c.name));
        let columns =
            columns.map(|c| Column { values: self.values(c, table.count, &rows), name: c.name.clone(), ..*c });
        Ok(ParticleTable { count: rows.len(), columns: columns.collect() })
    }
}

impl Repeated {
    fn values(&self, column: &Column, n: usize, rows: &Range<usize>) -> Values {
        let d = column.components;
        let flat = || rows.clone().flat_map(|i| (i % n * d..i % n * d + d).map(move |j| (i / n, j)));
        match (column.name.as_str(), &column.values) {
            (names::COORDINATES, values) => {
                let at = |(copy, j): (usize, usize)| {
                    let k = j % d;
                    let x = values.get(j) + self.place(copy)[k] as f64 * self.tile.header.box_size[k];
                    // Rounding must not carry a particle beyond the box.
                    x.min(self.header.box_size[k].next_down())
                };
                Values::F64(flat().map(at).collect())
            }
            (names::PARTICLE_IDS, Values::I64(v)) => {
                Values::I64(flat().map(|(copy, j)| v[j] + copy as i64 * self.stride).collect())
            }
            (_, Values::F32(v)) => Values::F32(flat().map(|(_, j)| v[j]).collect()),
            (_, Values::F64(v)) => Values::F64(flat().map(|(_, j)| v[j]).collect()),
            (_, Values::I64(v)) => Values::I64(flat().map(|(_, j)| v[j]).collect()),
        }
    }
}

/// Copies of a uniform box that fill a domain, mapped to its target.
struct Tiles<'a, const D: usize> {
    repeated: &'a Repeated,
    coordinates: Vec<[f64; D]>,
    domain: &'a Domain<D>,
    scale: [f64; D],
    /// Number of the first particle of each copy that is in the domain, and of all at the end.
    firsts: Vec<usize>,
}

impl<'a, const D: usize> Tiles<'a, D> {
    fn new(repeated: &'a Repeated, domain: &'a Domain<D>) -> Result<Self> {
        let mut gas = repeated.tile.species.iter().filter(|s| s.table.count > 0);
        let (Some(gas), None) = (gas.next(), gas.next()) else {
            return Err(Error::field("box", "has no particles or several types; a target is for one"));
        };
        refuse_uneven(&gas.table)?;
        let column = gas.table.column(names::COORDINATES).map(|c| &c.values);
        let coordinate = |i: usize, k: usize| column.map_or(0.0, |c| c.get(i * D + k));
        let coordinates = (0..gas.table.count).map(|i| sph::array(|k| coordinate(i, k))).collect();
        let (extent, size) = (domain.extent(), &repeated.header.box_size);
        let whole: [f64; D] = sph::array(|k| extent[k] / size[k]);
        let largest = whole.iter().copied().fold(0.0, f64::max);
        let is_box = matches!(domain.region, Region::Box);
        let mut tiles = Self {
            repeated,
            coordinates,
            domain,
            scale: if is_box { whole } else { [largest; D] },
            firsts: Vec::new(),
        };
        let n = gas.table.count;
        let counts = parallel::map(repeated.copies, |copy| match is_box {
            true => n,
            false => (0..n).filter(|&j| domain.contains(&tiles.point(copy, j))).count(),
        });
        tiles.firsts.push(0);
        for count in counts {
            let before = tiles.firsts.last().copied().unwrap_or(0);
            tiles.firsts.push(before + count);
        }
        if tiles.count() == 0 {
            return Err(Error::field(
                "box",
                "has no particle that falls into the target's domain; repeat it more often",
            ));
        }
        Ok(tiles)
    }

    fn count(&self) -> usize {
        self.firsts.last().copied().unwrap_or(0)
    }

    /// A particle of a copy, in the domain's unit, before it is mapped.
    fn point(&self, copy: usize, j: usize) -> [f64; D] {
        let (tile, all) = (&self.repeated.tile.header.box_size, &self.repeated.header.box_size);
        let place = self.repeated.place(copy);
        sph::array(|k| {
            let x = self.coordinates[j][k] + place[k] as f64 * tile[k];
            let middle = 0.5 * (self.domain.lo[k] + self.domain.hi[k]);
            (middle + (x - 0.5 * all[k]) * self.scale[k]).clamp(self.domain.lo[k], self.domain.hi[k])
        })
    }

    fn points(&self, numbers: Range<usize>) -> Vec<[f64; D]> {
        let mut points = Vec::with_capacity(numbers.len());
        let mut copy = self.firsts.partition_point(|&first| first <= numbers.start).saturating_sub(1);
        let mut skip = numbers.start - self.firsts[copy];
        while points.len() < numbers.len() && copy + 1 < self.firsts.len() {
            let all = self.firsts[copy + 1] - self.firsts[copy] == self.coordinates.len();
            let inside = (0..self.coordinates.len()).map(|j| self.point(copy, j));
            let inside = inside.filter(|x| all || self.domain.contains(x));
            points.extend(inside.skip(skip).take(numbers.len() - points.len()));
            (copy, skip) = (copy + 1, 0);
        }
        points
    }

    /// What is done to the box.
    fn notes(&self) -> Vec<String> {
        let (least, most) = self.scale.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), &s| (a.min(s), b.max(s)));
        let stretched = (most > STRETCHED * least).then(|| {
            format!(
                "the copies are stretched by up to {:.1} % along an axis to fill the domain; --times {:?} is nearer to its shape",
                100.0 * (most / least - 1.0),
                self.better_times()
            )
        });
        let all = self.coordinates.len() * self.repeated.copies;
        let cut = (self.count() < all).then(|| format!("{} of {all} particles are in the domain", self.count()));
        stretched.into_iter().chain(cut).collect()
    }

    /// As many copies along the longest axis, and what the domain's shape asks for along the others.
    fn better_times(&self) -> Vec<usize> {
        let (extent, tile) = (self.domain.extent(), &self.repeated.tile.header.box_size);
        let per: [f64; D] = sph::array(|k| extent[k] / tile[k]);
        let longest = (0..D).fold(0, |best, k| if per[k] > per[best] { k } else { best });
        let unit = self.repeated.times[longest] as f64 / per[longest];
        per.iter().map(|p| ((p * unit).round() as usize).max(1)).collect()
    }
}

/// A target is for particles of one mass in a uniform box.
fn refuse_uneven(table: &ParticleTable) -> Result<()> {
    let range = |name: &str| table.column(name).map(|c| c.values.range());
    if let Some((least, most, _)) = range(names::MASSES)
        && most > least * (1.0 + 1e-6)
    {
        let problem = format!("go from {least:e} to {most:e}; a target is for a box of equal ones");
        return Err(Error::field(names::MASSES, problem));
    }
    if let Some(c) = table.column(names::DENSITY) {
        let n = c.values.len() as f64;
        let mean = (0..c.values.len()).map(|i| c.values.get(i)).sum::<f64>() / n;
        let spread = ((0..c.values.len()).map(|i| (c.values.get(i) - mean).powi(2)).sum::<f64>() / n).sqrt() / mean;
        if !(spread <= UNIFORM) {
            let problem = format!(
                "varies by {:.1} % within the box, expected at most {:.0} %; a target is for a uniform box",
                100.0 * spread,
                100.0 * UNIFORM
            );
            return Err(Error::field(names::DENSITY, problem));
        }
    }
    Ok(())
}

struct Mapped<'a, const D: usize> {
    tiles: &'a Tiles<'a, D>,
    map: MassMap<'static, D>,
}

impl<const D: usize> Places<D> for Mapped<'_, D> {
    fn positions(&self, numbers: Range<usize>) -> Result<Positions<D>> {
        let mut points = self.tiles.points(numbers);
        parallel::update(&mut points, |_, x| *x = self.map.apply(*x));
        Ok(std::array::from_fn(|k| points.iter().map(|x| x[k]).collect()))
    }
}

/// Calls `with` with the copies mapped to the target of `scene`, and with what there is to say of them.
///
/// # Errors
/// A scene whose target has no symmetry by which it can be mapped to, another dimension than the box's, and what `with` says.
pub fn mapped<R>(
    repeated: &Repeated,
    scene: &Scene,
    formats: &[FormatSpec],
    format: Option<&FormatSpec>,
    with: impl FnOnce(&dyn ParticleStream, Remarks) -> Result<R>,
) -> Result<R> {
    let read = Read::new(scene, formats)?;
    if read.dimension != repeated.tile.header.dimension {
        let problem = format!(
            "is in {} dimensions, but the box in {}; they must be the same",
            read.dimension, repeated.tile.header.dimension
        );
        return Err(Error::scene("--scene", problem));
    }
    match read.dimension {
        1 => mapped_in::<1, R>(repeated, scene, (formats, format), read, with),
        2 => mapped_in::<2, R>(repeated, scene, (formats, format), read, with),
        _ => mapped_in::<3, R>(repeated, scene, (formats, format), read, with),
    }
}

fn mapped_in<const D: usize, R>(
    repeated: &Repeated,
    scene: &Scene,
    (formats, format): (&[FormatSpec], Option<&FormatSpec>),
    Read { raw, units, mut told, .. }: Read,
    with: impl FnOnce(&dyn ParticleStream, Remarks) -> Result<R>,
) -> Result<R> {
    let all: usize = repeated.counts().iter().sum();
    let mut prepared = prepare::<D>(scene, formats, (raw, &units), all)?;
    let mut tiles = Tiles::new(repeated, &prepared.source.domain)?;
    let count = tiles.count();
    if count != all && prepared.source.radial.is_some() {
        // Where an atmosphere is cut depends on how many particles there are, which follows from the domain.
        prepared = prepare::<D>(scene, formats, (Read::new(scene, formats)?.raw, &units), count)?;
        tiles = Tiles::new(repeated, &prepared.source.domain)?;
    }
    let target: Target<'_, D> = prepared.target().with_count(tiles.count());
    let mapped = Mapped { tiles: &tiles, map: MassMap::new(&target, "replicate")?.tabulated() };
    let stream = Streamed::new(scene, (&prepared, units), (target, &mapped), format, "Replicated")?;
    told.notes.extend(tiles.notes().into_iter().chain(left_behind(&repeated.tile)));
    told.of_target(scene, &prepared, tiles.count());
    stream.tell(&mut told, true, format)?;
    with(&stream, told)
}

/// What a box brings of which nothing comes to the target: everything but its places that is not 0 throughout.
fn left_behind(tile: &ParticleFile) -> Option<String> {
    let made_anew = [
        names::COORDINATES,
        names::PARTICLE_IDS,
        names::MASSES,
        names::DENSITY,
        names::SUPPORT_RADIUS,
        names::SMOOTHING_LENGTH,
    ];
    let columns = tile.species.iter().flat_map(|s| &s.table.columns);
    let left = columns.filter(|c| !made_anew.contains(&c.name.as_str()) && !is_zero(&c.values));
    let left: Vec<&str> = left.map(|c| c.name.as_str()).collect();
    let text = || {
        format!(
            "only places come from the box: its {} stay there, and the scene says what particles have",
            left.join(", ")
        )
    };
    (!left.is_empty()).then(text)
}
