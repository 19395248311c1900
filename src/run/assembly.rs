//! Joins the placed bodies: the position and velocity of each, and one file with all of them.

use crate::error::{Error, Result};
use crate::field::rotated;
use crate::output::particle_file::point_table;
use sph_formats::common::particle_names as names;
use sph_formats::{Column, ParticleFile, ParticleTable, RunHeader, Species, UnitDimension, UnitSystem, Values};
use std::collections::BTreeMap;

pub use sph_formats::common::particle_names::BODY_ID;
/// Of its fastest particle's: motion of a body as a whole that is more than noise.
const OWN_SHARE: f64 = 0.05;
/// Of the same: no motion at all.
const ROUNDING: f64 = 1e-9;

/// A body in the units of the output, about its center of mass.
pub struct Body {
    pub title: String,
    /// Gas, or a point, and a point in the center of gas. Coordinates, masses and velocities are in here until they are put
    /// together; coordinates from the center of mass.
    parts: Vec<Species>,
    dimension: usize,
    pub mass: f64,
    /// The center of mass in the coordinates of the file that it is from.
    pub center: [f64; 3],
    /// Distance of the outermost particle.
    pub radius: f64,
    /// Where it ends, which its outermost particle does not quite reach or lies beyond.
    pub surface: f64,
    /// Whether its particles go through those of other bodies.
    pub is_collisionless: bool,
}

/// Where a body is and how it moves.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct State {
    pub position: [f64; 3],
    pub velocity: [f64; 3],
    /// Angular velocity.
    pub spin: [f64; 3],
}

/// The box of the whole.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    pub lo: [f64; 3],
    pub edges: [f64; 3],
    pub periodic: [bool; 3],
    /// The point at the origin of the output, where it is chosen; else that is the corner.
    pub origin: Option<[f64; 3]>,
}

impl Frame {
    /// The lower corner in the output's coordinates, where their origin is chosen.
    pub fn corner(&self) -> Option<[f64; 3]> {
        self.origin.map(|origin| sph::array(|k| self.lo[k] - origin[k]))
    }
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// Row `i` of a column of vectors, with zeros for what it lacks.
pub(super) fn row(column: &Column, i: usize) -> [f64; 3] {
    let d = column.components;
    sph::array(|k| if k < d { column.values.get(i * d + k) } else { 0.0 })
}

/// Mean of rows by mass.
pub(super) fn mean(rows: impl Iterator<Item = (f64, [f64; 3])>) -> [f64; 3] {
    let (mut mass, mut sum) = (0.0, [0.0; 3]);
    for (m, x) in rows {
        mass += m;
        (0..3).for_each(|k| sum[k] += m * x[k]);
    }
    sum.map(|s| s / mass)
}

impl Body {
    /// Takes the gas of a placed file, and a point mass with it.
    ///
    /// # Errors
    /// A file without particles.
    pub fn new(title: String, mut file: ParticleFile, middle: Middle) -> Result<Self> {
        file.join_images();
        let (dimension, edges) = (file.header.dimension, file.header.box_size);
        let corner = file.header.box_corner.unwrap_or_default();
        let none = || Error::scene(format!("bodies[{title}]"), "came out without particles");
        let mut parts: Vec<Species> = file.species.into_iter().filter(|s| s.table.count > 0).collect();
        let mut all: Vec<(f64, [f64; 3])> = Vec::new();
        for Species { table, .. } in &parts {
            let (x, m) = (table.column(names::COORDINATES), table.column(names::MASSES));
            let (Some(x), Some(m)) = (x, m) else { return Err(none()) };
            all.extend((0..table.count).map(|i| (m.values.get(i), row(x, i))));
        }
        if all.is_empty() {
            return Err(none());
        }
        let center = match middle {
            Middle::OfMass => mean(all.iter().copied()),
            Middle::OfBox => sph::array(|k| if k < dimension { corner[k] + 0.5 * edges[k] } else { 0.0 }),
        };
        let mass = all.iter().map(|p| p.0).sum();
        let moved: Vec<[f64; 3]> = all.iter().map(|(_, x)| sph::array(|k| x[k] - center[k])).collect();
        let radius = moved.iter().map(|x| length(*x)).fold(0.0, f64::max);
        let mut rest = moved.as_slice();
        for table in parts.iter_mut().map(|p| &mut p.table) {
            let (own, others) = rest.split_at(table.count);
            rest = others;
            if let Some(column) = table.columns.iter_mut().find(|c| c.name == names::COORDINATES) {
                column.values = Values::F64(own.iter().flat_map(|x| x[..dimension].to_vec()).collect());
            }
        }
        let is_collisionless = parts.iter().all(|p| p.part_type != 0);
        Ok(Self { title, parts, dimension, mass, center, radius, surface: radius, is_collisionless })
    }

    /// As far as its surface, if that is known: how far out the outermost particle lies depends on how many there are.
    #[must_use]
    pub fn reaching(self, surface: Option<f64>) -> Self {
        Self { surface: surface.unwrap_or(self.surface), ..self }
    }

    /// What it moves with as a whole by itself.
    fn own_motion(&self) -> [f64; 3] {
        center_of_mass(std::slice::from_ref(self), &[State::default()]).1
    }

    /// The speed of its fastest particle by itself.
    fn fastest(&self) -> f64 {
        self.moved(&State::default()).iter().map(|(_, v)| length(*v)).fold(0.0, f64::max)
    }

    /// What it moves with as a whole by itself, where that is more than the noise of what its particles move with.
    pub fn drift(&self) -> Option<[f64; 3]> {
        let own = self.own_motion();
        (length(own) > OWN_SHARE * self.fastest()).then_some(own)
    }

    /// That of its center in a state, with what it moves by of its own.
    pub fn velocity(&self, state: &State) -> [f64; 3] {
        let own = Some(self.own_motion()).filter(|own| length(*own) > ROUNDING * self.fastest()).unwrap_or_default();
        sph::array(|k| state.velocity[k] + own[k])
    }

    /// Kinetic energy in a state about its motion as a whole.
    pub fn kinetic(&self, state: &State) -> f64 {
        let moved = self.moved(state);
        let mean = mean(self.masses().zip(moved.iter().map(|p| p.1)));
        let square = |v: &[f64; 3]| (0..3).map(|k| (v[k] - mean[k]).powi(2)).sum::<f64>();
        self.masses().zip(&moved).map(|(m, (_, v))| 0.5 * m * square(v)).sum()
    }

    /// Takes out of the velocities what the body moves by as a whole, where that is more than `rounding`; what it was.
    pub fn stop(&mut self, rounding: f64) -> Option<[f64; 3]> {
        let own = self.own_motion();
        if !(length(own) > rounding) {
            return None;
        }
        let d = self.dimension;
        for part in &mut self.parts {
            let count = part.table.count;
            let zeros =
                || Column::new(names::VELOCITIES, d, Values::F64(vec![0.0; d * count]), UnitDimension::VELOCITY);
            if part.table.column(names::VELOCITIES).is_none() {
                part.table.columns.push(zeros());
            }
            let columns = part.table.columns.iter_mut();
            for column in columns.filter(|c| c.name == names::VELOCITIES) {
                let (values, stride) = (&column.values, column.components);
                let at = |i: usize| values.get(i) - own[i % stride];
                column.values = Values::F64((0..values.len()).map(at).collect());
            }
        }
        Some(own)
    }

    /// A single particle, in as many dimensions, of a type that is not gas.
    pub fn point(title: String, mass: f64, radii: &[(&str, f64)], (dimension, part_type): (usize, u8)) -> Self {
        let table = point_table((vec![0.0; dimension], mass, None), radii, None);
        let parts = vec![Species { part_type, table }];
        Self { title, parts, dimension, mass, center: [0.0; 3], radius: 0.0, surface: 0.0, is_collisionless: false }
    }

    /// Turned about its center of mass by degrees about the axes x, y and z, in this order; in 2-D by one angle.
    ///
    /// # Errors
    /// Angles for another dimension.
    pub fn turned(mut self, degrees: &[f64]) -> Result<Self> {
        let d = self.dimension;
        let degrees = match (d, degrees) {
            (_, []) => return Ok(self),
            (2, [angle]) => [0.0, 0.0, *angle],
            (3, [x, y, z]) => [*x, *y, *z],
            _ => {
                let problem = format!(
                    "is {degrees:?}, expected {} in {d}-D",
                    ["none", "one angle", "three angles"][d.clamp(1, 3) - 1]
                );
                return Err(Error::scene(format!("bodies[{}].orientation", self.title), problem));
            }
        };
        let columns = self.parts.iter_mut().flat_map(|p| &mut p.table.columns);
        // A magnetic field has three components in 2-D as well.
        for column in columns.filter(|c| c.components == d || c.name == names::MAGNETIC_FIELD && c.components == 3) {
            let k = column.components;
            let rows = 0..column.values.len() / k;
            column.values = Values::F64(rows.flat_map(|i| rotated(&degrees, &row(column, i))[..k].to_vec()).collect());
        }
        Ok(self)
    }

    /// Places of its gas in a state, and their spacings by the density of a column of that name.
    pub fn gas_spacings(&self, state: &State, density: &str) -> Vec<([f64; 3], f64)> {
        let of_part = |table: &ParticleTable| -> Vec<([f64; 3], f64)> {
            let spacings = self.spacings_by(table, density);
            moved(table, state).into_iter().zip(spacings).map(|((x, _), s)| (x, s)).collect()
        };
        self.parts.iter().filter(|p| p.part_type == 0).flat_map(|p| of_part(&p.table)).collect()
    }

    pub fn is_gas(&self) -> bool {
        self.parts.iter().any(|p| p.part_type == 0)
    }

    /// Particles of all kinds.
    pub fn count(&self) -> usize {
        self.parts.iter().map(|p| p.table.count).sum()
    }

    /// Particles of the first kind, gas or a point, and their mass.
    pub fn first(&self) -> (usize, f64) {
        self.parts.first().map_or((0, 0.0), |p| (p.table.count, masses_of(&p.table).sum()))
    }

    /// The least and the largest mass of these.
    pub fn range_of_first(&self) -> (f64, f64) {
        let masses = self.parts.first().into_iter().flat_map(|p| masses_of(&p.table));
        masses.fold((f64::INFINITY, 0.0), |(least, most), m| (least.min(m), most.max(m)))
    }

    /// One mass for all particles of the first kind.
    pub fn set_particle_mass(&mut self, mass: f64) {
        let Some(table) = self.parts.first_mut().map(|p| &mut p.table) else { return };
        let n = table.count;
        if let Some(column) = table.columns.iter_mut().find(|c| c.name == names::MASSES) {
            column.values = Values::F64(vec![mass; n]);
        }
        let others: f64 = self.parts.iter().skip(1).flat_map(|p| masses_of(&p.table)).sum();
        self.mass = mass * n as f64 + others;
    }

    pub fn masses(&self) -> impl Iterator<Item = f64> + '_ {
        self.parts.iter().flat_map(|p| masses_of(&p.table))
    }

    /// Places and velocities of all particles in a state.
    pub fn moved(&self, state: &State) -> Vec<([f64; 3], [f64; 3])> {
        self.parts.iter().flat_map(|p| moved(&p.table, state)).collect()
    }

    /// (m / rho)^(1/d) of each particle, where the density is known.
    pub fn spacings(&self) -> Vec<f64> {
        self.parts.iter().flat_map(|p| self.spacings_by(&p.table, names::DENSITY)).collect()
    }

    fn spacings_by(&self, table: &ParticleTable, density: &str) -> Vec<f64> {
        let density = table.column(density);
        let at = |(i, m): (usize, f64)| {
            let rho = density.map_or(0.0, |c| c.values.get(i));
            if rho > 0.0 { (m / rho).powf(1.0 / self.dimension as f64) } else { 0.0 }
        };
        masses_of(table).enumerate().map(at).collect()
    }
}

pub(super) fn masses_of(table: &ParticleTable) -> impl Iterator<Item = f64> + '_ {
    let column = table.column(names::MASSES);
    column.into_iter().flat_map(|c| (0..c.values.len()).map(|i| c.values.get(i)))
}

/// Places and velocities of particles in a state.
fn moved(table: &ParticleTable, state: &State) -> Vec<([f64; 3], [f64; 3])> {
    let velocities = table.column(names::VELOCITIES);
    let Some(x) = table.column(names::COORDINATES) else { return Vec::new() };
    let moved = |i: usize| {
        let from_center = row(x, i);
        let swirl = cross(state.spin, from_center);
        let own = velocities.map_or([0.0; 3], |v| row(v, i));
        let place = sph::array(|k| from_center[k] + state.position[k]);
        (place, sph::array(|k| own[k] + swirl[k] + state.velocity[k]))
    };
    (0..table.count).map(moved).collect()
}

/// What of a body is put in its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Middle {
    OfMass,
    /// Of a disc about a point mass or within a halo: its center is that of its fields, and the few particles' center of mass is not.
    OfBox,
}

/// Brings the center of mass of bodies to the origin, and to rest.
pub fn about_center_of_mass(bodies: &[Body], states: &mut [State]) {
    let (center, velocity) = center_of_mass(bodies, states);
    for state in states {
        (0..3).for_each(|k| {
            state.position[k] -= center[k];
            state.velocity[k] -= velocity[k];
        });
    }
}

/// Center of mass and its velocity.
pub fn center_of_mass(bodies: &[Body], states: &[State]) -> ([f64; 3], [f64; 3]) {
    let of = |pick: fn(([f64; 3], [f64; 3])) -> [f64; 3]| {
        let pairs = bodies.iter().zip(states);
        mean(pairs.flat_map(|(b, s)| b.masses().collect::<Vec<_>>().into_iter().zip(b.moved(s).into_iter().map(pick))))
    };
    (of(|p| p.0), of(|p| p.1))
}

/// A cube around all particles, `factor` times as large as they need, with `center` in its middle, or the middle of them.
pub fn frame(bodies: &[Body], states: &[State], center: Option<[f64; 3]>, factor: f64) -> Frame {
    let d = bodies.first().map_or(3, |b| b.dimension);
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for (x, _) in bodies.iter().zip(states).flat_map(|(b, s)| b.moved(s)) {
        for k in 0..3 {
            lo[k] = lo[k].min(x[k]);
            hi[k] = hi[k].max(x[k]);
        }
    }
    let middle = center.unwrap_or_else(|| sph::array(|k| 0.5 * (lo[k] + hi[k])));
    let reach = (0..d).map(|k| (hi[k] - middle[k]).max(middle[k] - lo[k])).fold(0.0, f64::max);
    // A single particle has a box of its own spacing.
    let spacing = || bodies.iter().flat_map(Body::spacings).fold(0.0, f64::max);
    let edge = 2.0 * factor * if reach > 0.0 { reach } else { spacing() };
    Frame {
        lo: sph::array(|k| if k < d { middle[k] - 0.5 * edge } else { 0.0 }),
        edges: sph::array(|k| if k < d { edge } else { 0.0 }),
        periodic: [false; 3],
        origin: None,
    }
}

/// Coordinates have to tell particles apart, by this part of their spacing.
const RESOLVED: f64 = 1e-3;

/// Refuses bodies so far away that rounding moves their particles.
fn refuse_unresolved(bodies: &[Body], states: &[State], frame: &Frame) -> Result<()> {
    for (body, state) in bodies.iter().zip(states) {
        let corner = frame.corner().unwrap_or_default();
        let reach = state.position.iter().chain(&frame.edges).chain(&corner).fold(0.0_f64, |m, v| m.max(v.abs()));
        let spacing = body.spacings().into_iter().filter(|s| *s > 0.0).fold(f64::INFINITY, f64::min);
        if !(reach * f64::EPSILON < RESOLVED * spacing) {
            let problem = format!(
                "has particles {spacing:.3e} apart, which coordinates of {reach:.3e} do not tell apart; bring the bodies nearer"
            );
            return Err(Error::scene(format!("bodies[{}].position", body.title), problem));
        }
    }
    Ok(())
}

/// What a file says of how it came about.
pub struct Origin {
    pub units: UnitSystem,
    pub kernel: String,
    pub kernel_neighbors: f64,
    pub provenance: Vec<(String, String)>,
}

/// The file of all bodies, and what there is to note.
///
/// # Errors
/// Particles outside of the box, bodies of which some lack energies or materials that others have.
pub fn assemble(
    bodies: Vec<Body>,
    states: &[State],
    frame: &Frame,
    origin: Origin,
) -> Result<(ParticleFile, Vec<String>)> {
    refuse_unresolved(&bodies, states, frame)?;
    let moves = bodies.iter().zip(states).any(|(b, s)| b.moved(s).iter().any(|(_, v)| v.iter().any(|c| *c != 0.0)));
    let d = bodies.first().map_or(3, |b| b.dimension);
    let mut first = 1;
    let mut members: BTreeMap<u8, Vec<Member<'_>>> = BTreeMap::new();
    for (index, (body, state)) in bodies.iter().zip(states).enumerate() {
        for Species { part_type, table } in &body.parts {
            let member = Member { title: &body.title, table, state, number: index as i64 + 1, first };
            members.entry(*part_type).or_default().push(member);
            first += table.count as i64;
        }
    }
    let mut notes = Vec::new();
    let mut species = Vec::new();
    for (part_type, members) in members {
        let table = joined_table(d, &members, frame, moves, &mut notes)?;
        species.push(Species { part_type, table });
    }
    let Origin { units, kernel, kernel_neighbors, provenance } = origin;
    let header = RunHeader {
        dimension: d,
        box_size: frame.edges,
        box_corner: frame.corner(),
        periodic: frame.periodic,
        units,
        time: 0.0,
        kernel,
        kernel_neighbors,
        provenance,
        layouts: Vec::new(),
    };
    Ok((ParticleFile { header, species }, notes))
}

/// A body among those of its type.
struct Member<'a> {
    title: &'a str,
    table: &'a ParticleTable,
    state: &'a State,
    number: i64,
    /// ID of its first particle.
    first: i64,
}

/// The particles of one type.
fn joined_table(
    d: usize,
    members: &[Member<'_>],
    frame: &Frame,
    moves: bool,
    notes: &mut Vec<String>,
) -> Result<ParticleTable> {
    let corner = frame.corner();
    let (mut places, mut speeds, mut ids, mut numbers) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for Member { title, table, state, number, first } in members {
        for (i, (x, v)) in moved(table, state).into_iter().enumerate() {
            for k in 0..d {
                let place = inside(x[k] - frame.lo[k], frame.edges[k], frame.periodic[k]).ok_or_else(|| {
                    let problem = format!(
                        "reaches {:.6e} on axis {k}, out of the box from {:.6e} to {:.6e}; make domain.box larger, or leave it out",
                        x[k],
                        frame.lo[k],
                        frame.lo[k] + frame.edges[k]
                    );
                    Error::scene(format!("bodies[{title}]"), problem)
                })?;
                places.push(corner.map_or(place, |corner| place + corner[k]));
                speeds.push(v[k]);
            }
            ids.push(first + i as i64);
            numbers.push(*number);
        }
    }
    let mut columns = vec![Column::new(names::COORDINATES, d, Values::F64(places), UnitDimension::LENGTH)];
    let mut all: Vec<&str> = Vec::new();
    for name in members.iter().flat_map(|m| &m.table.columns).map(|c| c.name.as_str()) {
        let is_own = [names::COORDINATES, names::VELOCITIES, names::PARTICLE_IDS, BODY_ID].contains(&name);
        if !is_own && !all.contains(&name) {
            all.push(name);
        }
    }
    for name in all {
        columns.extend(joined(members, name, notes)?);
    }
    let count = ids.len();
    columns.push(Column::new(names::PARTICLE_IDS, 1, Values::I64(ids), UnitDimension::NONE));
    columns.push(Column::new(BODY_ID, 1, Values::I64(numbers), UnitDimension::NONE));
    if moves {
        columns.push(Column::new(names::VELOCITIES, d, Values::F64(speeds), UnitDimension::VELOCITY));
    }
    Ok(ParticleTable { count, columns })
}

/// A coordinate in [0, edge); `None` where it is out of a box that does not repeat.
fn inside(x: f64, edge: f64, is_periodic: bool) -> Option<f64> {
    if is_periodic {
        let wrapped = x.rem_euclid(edge);
        return Some(if wrapped < edge { wrapped } else { 0.0 });
    }
    (x >= 0.0 && x < edge).then_some(x)
}

/// One column of all bodies, one after the other; none of what some lack and others say as well.
fn joined(bodies: &[Member<'_>], name: &str, notes: &mut Vec<String>) -> Result<Option<Column>> {
    let having = |body: &&Member<'_>| body.table.column(name).is_some();
    let Some((owner, model)) = bodies.iter().find(having).and_then(|b| Some((b, b.table.column(name)?))) else {
        return Err(Error::scene("bodies", format!("have no column '{name}'")));
    };
    let without: Vec<&str> = bodies.iter().filter(|b| !having(b)).map(|b| b.title).collect();
    if let Some(first) = without.first() {
        if name == names::INTERNAL_ENERGY || name == names::MATERIAL_IDS {
            let remedy = if name == names::MATERIAL_IDS {
                "set its material, or that of none"
            } else {
                "set its fields or thermal.internal_energy, or those of none"
            };
            let problem = format!("has no {name}, which body {} has; {remedy}", owner.title);
            return Err(Error::scene(format!("bodies[{first}]"), problem));
        }
        let without = without.join(", ");
        // A pressure of 0 beside an energy would be another state.
        if name == names::PRESSURE && bodies.iter().all(|b| b.table.column(names::INTERNAL_ENERGY).is_some()) {
            let note = "is left out, which bodies do not have";
            notes.push(format!("'{name}' {note}: {without}; all have an internal energy"));
            return Ok(None);
        }
        notes.push(format!("'{name}' is 0 in bodies that do not have it: {without}"));
    }
    if let Some(other) = bodies.iter().find(|b| b.table.column(name).is_some_and(|c| c.components != model.components))
    {
        let problem = format!("has a '{name}' of another number of components than body {}", owner.title);
        return Err(Error::scene(format!("bodies[{}]", other.title), problem));
    }
    let are_whole = bodies.iter().all(|b| b.table.column(name).is_none_or(|c| matches!(c.values, Values::I64(_))));
    let values = |body: &Member<'_>| {
        let zeros = vec![0.0; body.table.count * model.components];
        body.table.column(name).map_or(zeros, |c| c.values.to_f64())
    };
    let flat: Vec<f64> = bodies.iter().flat_map(values).collect();
    let values = if are_whole { Values::I64(flat.iter().map(|v| *v as i64).collect()) } else { Values::F64(flat) };
    Ok(Some(Column { name: name.to_owned(), components: model.components, values, dimension: model.dimension }))
}
