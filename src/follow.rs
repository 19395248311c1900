//! Evolves the gas of any particle file in time as a simulation code would, and reports whether it stays at rest.
//!
//! Neighbors, kernel, constant of gravity and the softening of point masses are those of the code, the adiabatic index is the file's. What it
//! does not say is stated: that index, where it is not 5/3, and gravity where units are pure numbers.

use crate::check::{PAIRED, points, support};
use crate::codes::{AS_PLANETARY, TargetCode};
use crate::eos::Material;
use crate::error::{Error, Result};
use crate::metrics::{InOwnUnits, Measured, Stated};
use crate::relaxation::{Certificate, Control, End, Followed, Point, State, follow, opened, settle, space, too_few};
use crate::target::{Materials, Positions, at};
use sph::domain::Axis;
use sph::geometry::distance;
use sph::kernel::KernelName;
use sph_formats::common::particle_names as names;
use sph_formats::{Column, ParticleFile, ParticleTable, Species, UnitDimension, UnitSystem, Values};

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// In dynamical times sqrt(R^3/(G M)); without gravity in those in which sound crosses the domain. 0 follows nothing.
    pub duration: f64,
    /// The constant of gravity in the file's units, 0 for none; by default the code's for a file in three dimensions that is not
    /// periodic, else none.
    pub gravity: Option<f64>,
    /// Adiabatic index of gas without materials; by default the file's.
    pub gamma: Option<f64>,
    /// How long motion is damped before, in the same times.
    pub settle: Option<f64>,
    /// Axes along which the faces of the file's box are walls that throw particles back; elsewhere what is not periodic is open.
    pub walls: [bool; 3],
}

impl Default for Options {
    fn default() -> Self {
        Self { duration: 3.0, gravity: None, gamma: None, settle: None, walls: [false; 3] }
    }
}

/// What became of the gas, and what is to be known about it.
#[derive(Debug, Clone)]
pub struct Outcome {
    pub certificate: Certificate,
    pub settled: Option<Settled>,
    pub notes: Vec<String>,
}

/// The particles after their motion was damped.
#[derive(Debug, Clone)]
pub struct Settled {
    /// How it fell.
    pub certificate: Certificate,
    pub file: ParticleFile,
    /// Smallest distance of two particles of gas over the spacing there.
    pub closest_pair: f64,
}

/// Time in which motion falls to 1/e while it is damped, in dynamical times: about what the slowest pulsation of a star is damped best by,
/// whose period is some 2 to 4 of them.
const DAMPING: f64 = 0.3;
/// Longest duration: what is not still by then is known.
const LONGEST: f64 = 1e4;
/// Kinetic energy over the gas's own, at most: steps are as short as the gas is fast.
const FASTEST: f64 = 1e12;

/// Follows the gas and the softened point masses of a file until `options.duration` or until `control` ends it.
///
/// # Errors
/// A file without gas, or without coordinates, masses or internal energies, with values that are not finite or not positive, with other
/// particles that attract, with materials that the code or this program does not know; options out of their ranges.
pub fn follow_file(
    file: &ParticleFile,
    code: &TargetCode,
    options: &Options,
    control: &Control<'_>,
) -> Result<Outcome> {
    options.check()?;
    let gas = file.species.iter().find(|s| s.part_type == 0 && s.table.count > 0);
    let table =
        &gas.ok_or_else(|| Error::field("PartType0", "the file has no gas particles; nothing can be followed"))?.table;
    match file.header.dimension {
        1 => in_dimension::<1>(file, table, code, options, control),
        2 => in_dimension::<2>(file, table, code, options, control),
        _ => in_dimension::<3>(file, table, code, options, control),
    }
}

impl Options {
    fn check(&self) -> Result<()> {
        let bad = |name: &str, value: f64, expected: &str| {
            Err(Error::scene(name, format!("is {value}, expected {expected}")))
        };
        if !(self.duration >= 0.0 && self.duration <= LONGEST) {
            return bad("--duration", self.duration, "a number from 0 to 10000");
        }
        if let Some(time) = self.settle.filter(|t| !(*t > 0.0 && *t <= LONGEST)) {
            return bad("--settle", time, "a number above 0, and 10000 at most");
        }
        if let Some(gamma) = self.gamma.filter(|g| !(*g > 1.0 && *g <= 10.0)) {
            return bad("--gamma", gamma, "a number above 1, and 10 at most");
        }
        match self.gravity {
            Some(g) if !(g >= 0.0 && g.is_finite()) => bad("--gravity", g, "0 or more, in the file's units"),
            _ => Ok(()),
        }
    }
}

fn in_dimension<const D: usize>(
    file: &ParticleFile,
    table: &ParticleTable,
    code: &TargetCode,
    options: &Options,
    control: &Control<'_>,
) -> Result<Outcome> {
    let problem = too_few(table.count, code.kernel_neighbors(D)).filter(|_| !file.header.periodic.contains(&true));
    if let Some(problem) = problem {
        return Err(Error::scene("run", format!("{problem}; take more particles")));
    }
    let mut notes = Vec::new();
    let constant = gravity_of::<D>(file, code, options, &mut notes)?;
    if constant.is_none() {
        let left_out = file.species.iter().filter(|s| s.part_type != 0 && s.table.count > 0);
        notes.extend(left_out.map(|s| {
            let (count, part_type) = (s.table.count, s.part_type);
            format!("the {count} particles of type {part_type} are left out: without gravity the gas alone is followed")
        }));
    }
    let read = Read::<D>::new(file, table, constant, options.walls)?;
    let kinds = materials(file, table, code, &read)?;
    let gamma = options.gamma.unwrap_or_else(|| file.header.adiabatic_index());
    if kinds.is_none() {
        notes.push(format!("gas with the adiabatic index {gamma:.4}"));
    }
    let materials = kinds.as_ref().map(|(materials, kinds)| (materials, kinds.as_slice()));
    let (mut followed, whole) = read.start(file, table, code, (gamma, materials))?;
    if !code.scheme.has_our_force {
        notes.push(format!(
            "forces are those of densities and entropies with grad-h terms, not of the scheme {}",
            code.scheme.name
        ));
    }
    notes.push(format!("kernel and neighbors: {}; no viscosity, no cooling, no other forces", code.sums(D)));
    let sums = (code.kernel, code.kernel_neighbors(D));
    let mut settled = None;
    if let Some(time) = options.settle {
        let damped = Followed { damping: Some(DAMPING), ..followed.clone() };
        let (certificate, end) = settle(sums, damped, time, control);
        let mut file = file.clone();
        let is_ideal = materials.is_none();
        notes.extend(read.put_back(&mut file, code, &end, (&whole, is_ideal.then_some(gamma))));
        let closest_pair = closest_pair(sums, &followed, &end);
        notes.extend(paired(closest_pair));
        settled = Some(Settled { certificate, file, closest_pair });
        let End { positions, velocities, internal_energy, support, points, .. } = end;
        followed = Followed { positions, velocities, internal_energy, support, points, ..followed };
    }
    let certificate = follow(sums, followed, options.duration, control);
    settled.iter().map(|s: &Settled| &s.certificate).chain([&certificate]).try_for_each(refuse_what_is_no_number)?;
    Ok(Outcome { certificate, settled, notes })
}

/// Columns that followed from those which have changed.
const STALE: [&str; 7] =
    [names::PRESSURE, names::TEMPERATURE, "Entropies", "Entropy", names::TARGET_DENSITY, "Potential", "SoundSpeed"];

/// What is read of the gas, in units of its own: the largest extent, the mass, and G M/L or, without gravity, the mean energy.
struct Read<const D: usize> {
    own: InOwnUnits<D>,
    energies: Vec<f64>,
    /// The unit of specific energy in the file's.
    specific: f64,
    has_gravity: bool,
}

impl<const D: usize> Read<D> {
    fn new(file: &ParticleFile, table: &ParticleTable, constant: Option<f64>, walls: [bool; 3]) -> Result<Self> {
        let coordinates = column::<D>(table, names::COORDINATES, D, |v| v.is_finite(), "finite numbers")?;
        let masses = column::<D>(table, names::MASSES, 1, |v| v > 0.0 && v.is_finite(), "positive numbers")?;
        let energies = column::<D>(table, names::INTERNAL_ENERGY, 1, |v| v > 0.0 && v.is_finite(), "positive numbers")?;
        let own = InOwnUnits::<D>::within(&coordinates, &masses, |k| stated(file, walls, k))
            .map_err(|e| Error::field(names::COORDINATES, format!("make no box: {e}")))?;
        if let Some([i, j]) = coincident(&own.positions) {
            let problem =
                format!("of rows {i} and {j} are the same place, from which no force parts them; move them apart");
            return Err(Error::field(names::COORDINATES, problem));
        }
        let mean_energy = energies.iter().zip(&own.masses).map(|(u, m)| u * m).sum::<f64>();
        let specific = constant.map_or(mean_energy, |g| g * own.total / own.size.powi(D as i32 - 2));
        if !(specific > 0.0 && specific.is_finite()) {
            let problem = format!(
                "and the extent give the specific energy {specific:e}, expected a positive number; check the units"
            );
            return Err(Error::field(names::MASSES, problem));
        }
        let energies = energies.iter().map(|u| u / specific).collect();
        Ok(Self { own, energies, specific, has_gravity: constant.is_some() })
    }

    /// The gas and the point masses at the start, at rest as a whole, and the velocity that they had so.
    fn start<'a>(
        &self,
        file: &ParticleFile,
        table: &ParticleTable,
        code: &TargetCode,
        (gamma, materials): (f64, Option<(&'a Materials, &'a [usize])>),
    ) -> Result<(Followed<'a, D>, [f64; D])> {
        let InOwnUnits { positions, masses, domain, start, size, total } = &self.own;
        let unit = self.specific.sqrt();
        let points = if self.has_gravity {
            others::<D>(file)?;
            let in_units = |(mass, v): (_, [f64; D])| Point { mass, velocity: Some(v.map(|v| v / unit)) };
            points::<D>(file, code, (*start, *size, *total)).into_iter().map(in_units).collect()
        } else {
            Vec::new()
        };
        let mut followed = Followed {
            velocities: velocities(table, unit)?,
            support: support(table, code, *size, domain),
            domain: opened(domain).unwrap_or_else(|| domain.clone()),
            positions: positions.clone(),
            masses: masses.clone(),
            internal_energy: self.energies.clone(),
            gamma,
            materials,
            center: None,
            field: None,
            points,
            bodies: table.bodies(),
            damping: None,
        };
        let whole = come_to_rest(&mut followed);
        let square = |i: usize| masses[i] * followed.velocities[i].iter().map(|v| v * v).sum::<f64>();
        let kinetic = (0..masses.len()).map(square).sum::<f64>();
        if !(kinetic < FASTEST) {
            let problem = format!(
                "make a kinetic energy of {kinetic:.1e} times the gas's own (at most {FASTEST:.0e}): no numbers that can be followed, since steps are as short as the gas \
                 is fast; check the units"
            );
            return Err(Error::field(names::VELOCITIES, problem));
        }
        if self.has_gravity {
            let center = middle(&followed);
            let radius = (0..masses.len()).map(|i| distance(&at(positions, i), &center)).fold(0.0, f64::max);
            if followed.domain.axes.iter().all(|axis| *axis == Axis::OPEN) {
                followed.domain = space(center, radius).unwrap_or(followed.domain);
            }
            followed.center = Some(center);
        }
        Ok((followed, whole))
    }

    /// Puts settled particles into their file, whose velocity as a whole was `whole`; the adiabatic index is that of an ideal gas. Returns
    /// what there is to say about it.
    fn put_back(
        &self,
        file: &mut ParticleFile,
        code: &TargetCode,
        end: &End<D>,
        (whole, gamma): (&[f64; D], Option<f64>),
    ) -> Vec<String> {
        let InOwnUnits { start, size, total, .. } = &self.own;
        let specific = self.specific;
        let velocity = |v: &[f64; D], k: usize| (v[k] + whole[k]) * specific.sqrt();
        let lengths = |h: &f64| h * size;
        let mut notes = Vec::new();
        let mut points = end.points.iter();
        for species in &mut file.species {
            let is_gas = species.part_type == 0;
            let count = species.table.count;
            let of_points: Vec<&Point<D>> = if is_gas { Vec::new() } else { points.by_ref().take(count).collect() };
            if !is_gas && of_points.len() < count {
                continue;
            }
            let x = |i: usize, k: usize| if is_gas { end.positions[k][i] } else { of_points[i].mass.center[k] };
            let v = |i: usize, k: usize| {
                velocity(if is_gas { &end.velocities[i] } else { of_points[i].velocity.as_ref().unwrap_or(whole) }, k)
            };
            let rows = |f: &dyn Fn(usize, usize) -> f64| {
                (0..count).flat_map(|i| (0..D).map(move |k| (i, k))).map(|(i, k)| f(i, k)).collect::<Vec<_>>()
            };
            set::<D>(&mut species.table, names::COORDINATES, &rows(&|i, k| start[k] + size * x(i, k)));
            set::<D>(&mut species.table, names::VELOCITIES, &rows(&v));
            if !is_gas {
                continue;
            }
            let scaled = |values: &[f64], unit: f64| values.iter().map(|v| v * unit).collect::<Vec<_>>();
            let energies = scaled(&end.internal_energy, specific);
            let densities = scaled(&end.density, total / size.powi(D as i32));
            let kept = gamma.map_or(Vec::new(), |gamma| of_ideal_gas(&species.table, gamma, &densities, &energies));
            kept.iter().for_each(|(name, values)| set::<1>(&mut species.table, name, values));
            set::<1>(&mut species.table, names::INTERNAL_ENERGY, &energies);
            set::<1>(&mut species.table, names::DENSITY, &densities);
            let radii: Vec<f64> = end.support.iter().map(lengths).collect();
            match species.table.column(names::SUPPORT_RADIUS) {
                Some(_) => set::<1>(&mut species.table, names::SUPPORT_RADIUS, &radii),
                None => species.table.columns.push(Column::new(
                    names::SUPPORT_RADIUS,
                    1,
                    Values::F64(radii),
                    UnitDimension::LENGTH,
                )),
            }
            // Formats have smoothing lengths of their own conventions from these.
            species.table.columns.retain(|c| c.name != names::SMOOTHING_LENGTH);
            species.table.columns.retain(|c| {
                let is_kept = kept.iter().any(|(name, _)| c.name == *name);
                let is_stale = STALE.contains(&c.name.as_str()) && !is_kept;
                if is_stale {
                    notes.push(format!("'{}' is no longer that of the particles and was left out", c.name));
                }
                !is_stale
            });
        }
        file.header.kernel = code.kernel.title().to_owned();
        file.header.kernel_neighbors = code.kernel_neighbors(D);
        notes
    }
}

/// Two particles at one place, if there are any.
fn coincident<const D: usize>(positions: &Positions<D>) -> Option<[usize; 2]> {
    let mut order: Vec<usize> = (0..positions[0].len()).collect();
    let by_place = |i: &usize, j: &usize| {
        let (x, y) = (at(positions, *i), at(positions, *j));
        (0..D).map(|k| x[k].total_cmp(&y[k])).find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
    };
    order.sort_unstable_by(by_place);
    order.windows(2).find(|pair| at(positions, pair[0]) == at(positions, pair[1])).map(|pair| [pair[0], pair[1]])
}

/// Numbers that are none say nothing of whether anything moves.
fn refuse_what_is_no_number(certificate: &Certificate) -> Result<()> {
    let is_known = |s: &State| [s.kinetic, s.energy, s.density_change].iter().all(|v| v.is_finite());
    match certificate.states.iter().find(|s| !is_known(s)) {
        None => Ok(()),
        Some(State { time, kinetic, .. }) => {
            let problem = format!(
                "the kinetic energy is {kinetic} and others are no numbers at the time {time:.3}: the extent, masses or energies are beyond what can be followed; check the units"
            );
            Err(Error::Numeric { stage: "run", problem })
        }
    }
}

/// An axis of the file's box that is periodic or has walls.
fn stated(file: &ParticleFile, walls: [bool; 3], k: usize) -> Option<Stated> {
    let header = &file.header;
    let axis = match (header.periodic[k], walls[k]) {
        (true, _) => Axis::Periodic,
        (false, true) => Axis::REFLECTING,
        _ => return None,
    };
    let corner = header.box_corner.map_or(0.0, |corner| corner[k]);
    (header.box_size[k] > 0.0).then_some(Stated { corner, edge: header.box_size[k], axis })
}

/// The pressures and temperatures of an ideal gas with other densities and energies than a table has, where it has them.
fn of_ideal_gas(
    table: &ParticleTable,
    gamma: f64,
    densities: &[f64],
    energies: &[f64],
) -> Vec<(&'static str, Vec<f64>)> {
    let mut all = Vec::new();
    if table.column(names::PRESSURE).is_some() {
        let pressures = densities.iter().zip(energies).map(|(rho, u)| (gamma - 1.0) * rho * u);
        all.push((names::PRESSURE, pressures.collect()));
    }
    if let (Some(old), Some(before)) = (table.column(names::TEMPERATURE), table.column(names::INTERNAL_ENERGY)) {
        let temperatures = energies.iter().enumerate().map(|(i, u)| old.values.get(i) * u / before.values.get(i));
        all.push((names::TEMPERATURE, temperatures.collect()));
    }
    all
}

/// Smallest distance of two particles at the end over the spacing there.
fn closest_pair<const D: usize>((kernel, neighbors): (KernelName, f64), start: &Followed<'_, D>, end: &End<D>) -> f64 {
    let measured = Measured::new(kernel, &start.domain, &end.positions, &start.masses, &end.support, neighbors);
    measured.neighbors(&start.domain, neighbors).closest_pair
}

/// What settling is apt to do with a kernel whose neighbors are more than it keeps apart.
fn paired(closest: f64) -> Option<String> {
    (closest < PAIRED).then(|| {
        format!(
            "particles have paired while they settled: the closest are {closest:.2} spacings apart, and it goes on in the code; fewer neighbors or a Wendland kernel keep them apart"
        )
    })
}

/// Replaces the values of a column, if it is there, in its precision; components beyond `D` stay.
fn set<const D: usize>(table: &mut ParticleTable, name: &str, values: &[f64]) {
    let Some(column) = table.columns.iter_mut().find(|c| c.name == name) else { return };
    let stride = column.components.max(1);
    let mut all = column.values.to_f64();
    for (row, new) in all.chunks_mut(stride).zip(values.chunks(D)) {
        row[..new.len()].copy_from_slice(new);
    }
    column.values = match column.values {
        Values::F32(_) => Values::F32(all.iter().map(|v| *v as f32).collect()),
        _ => Values::F64(all),
    };
}

/// A column that is there, of so many components, all of them good.
fn column<const D: usize>(
    table: &ParticleTable,
    name: &str,
    components: usize,
    is_good: impl Fn(f64) -> bool,
    expected: &str,
) -> Result<Vec<f64>> {
    let Some(column) = table.column(name) else {
        return Err(Error::field(name, "is missing; without it the gas cannot be followed"));
    };
    let stride = column.components.max(1);
    if stride < components {
        let problem = format!("has {stride} numbers for each particle, expected {components} in {D}-D");
        return Err(Error::field(name, problem));
    }
    let all = (0..table.count).flat_map(|i| (0..components).map(move |c| i * stride + c));
    let values: Vec<f64> = all.map(|at| column.values.get(at)).collect();
    match values.iter().position(|v| !is_good(*v)) {
        None => Ok(values),
        Some(bad) => {
            let problem = format!("is {} at particle {}, expected {expected}", values[bad], bad / components);
            Err(Error::field(name, problem))
        }
    }
}

/// The constant of gravity in the file's units; `None` for none.
fn gravity_of<const D: usize>(
    file: &ParticleFile,
    code: &TargetCode,
    options: &Options,
    notes: &mut Vec<String>,
) -> Result<Option<f64>> {
    let header = &file.header;
    let is_periodic = header.periodic != [false; 3];
    match options.gravity {
        Some(0.0) => return Ok(None),
        Some(_) if is_periodic => {
            return Err(Error::scene(
                "--gravity",
                "does not go with a periodic box; leave it out or set it to 0, or say that the box is no boundary (--open)",
            ));
        }
        Some(g) => return Ok(Some(g)),
        None => {}
    }
    if is_periodic || D < 3 {
        let why = if is_periodic {
            "the box is periodic (--open says that it is none)"
        } else {
            "the file has fewer than three dimensions"
        };
        notes.push(format!("without gravity: {why}"));
        return Ok(None);
    }
    if header.units == UnitSystem::CODE {
        let problem =
            "are pure numbers, so that the constant of gravity is not known; state it with --gravity, 0 for none";
        return Err(Error::field("units", problem));
    }
    Ok(Some(code.gravity_in(&header.units)))
}

/// Refuses what attracts but cannot be followed.
fn others<const D: usize>(file: &ParticleFile) -> Result<()> {
    let is_followed = |s: &Species| s.part_type == 0 || s.table.count == 0 || D == 3 && s.table.is_of_points();
    let other = file.species.iter().find(|s| !is_followed(s));
    let Some(Species { part_type, table }) = other else { return Ok(()) };
    let problem = format!(
        "holds {} particles that attract the gas, but beside gas only point masses with a softening radius, in three dimensions, can be followed; run the file in the code itself",
        table.count
    );
    Err(Error::field(format!("PartType{part_type}"), problem))
}

/// Materials and which each particle is of, where the file names some.
fn materials<const D: usize>(
    file: &ParticleFile,
    table: &ParticleTable,
    code: &TargetCode,
    read: &Read<D>,
) -> Result<Option<(Materials, Vec<usize>)>> {
    let Some(ids) = table.materials() else { return Ok(None) };
    if !AS_PLANETARY.contains(&code.scheme.name) {
        let problem =
            format!("name materials, which {} does not know; follow it for swift:scheme=planetary", code.describe(3));
        return Err(Error::field(names::MATERIAL_IDS, problem));
    }
    let ids: Vec<i32> = (0..table.count).map(|i| ids.values.get(i) as i32).collect();
    let mut known = ids.clone();
    known.sort_unstable();
    known.dedup();
    let mut equations = Vec::new();
    for &id in &known {
        let Some(material) = Material::of_id(id) else {
            let problem = format!("name {id}, whose equation of state needs a table; expected those with closed forms");
            return Err(Error::field(names::MATERIAL_IDS, problem));
        };
        equations.push(material.equation);
    }
    let u = &file.header.units;
    let density = read.own.total / read.own.size.powi(D as i32);
    let in_cgs = [density * u.mass / u.length.powi(3), read.specific * (u.length / u.time).powi(2)];
    let kinds = ids.iter().map(|id| known.partition_point(|k| k < id)).collect();
    Ok(Some((Materials::new(equations, in_cgs[0], in_cgs[1]), kinds)))
}

/// 0 where the file has none.
fn velocities<const D: usize>(table: &ParticleTable, unit: f64) -> Result<Vec<[f64; D]>> {
    if table.column(names::VELOCITIES).is_none() {
        return Ok(vec![[0.0; D]; table.count]);
    }
    let values = column::<D>(table, names::VELOCITIES, D, f64::is_finite, "finite numbers")?;
    Ok(values.chunks(D).map(|v| sph::array(|k| v[k] / unit)).collect())
}

/// The center of mass of gas and points.
fn middle<const D: usize>(followed: &Followed<'_, D>) -> [f64; D] {
    let points = followed.points.iter().map(|p| (p.mass.mass, p.mass.center));
    let gas = (0..followed.masses.len()).map(|i| (followed.masses[i], at(&followed.positions, i)));
    mean(gas.chain(points))
}

fn mean<const D: usize>(weighted: impl Iterator<Item = (f64, [f64; D])>) -> [f64; D] {
    let (mut sum, mut total) = ([0.0; D], 0.0);
    for (weight, v) in weighted {
        total += weight;
        (0..D).for_each(|k| sum[k] += weight * v[k]);
    }
    sum.map(|s| s / total)
}

/// Takes the motion of the whole away, and returns it: a body that flies is still. Between walls it stays as it is.
fn come_to_rest<const D: usize>(followed: &mut Followed<'_, D>) -> [f64; D] {
    let points = followed.points.iter().filter_map(|p| Some((p.mass.mass, p.velocity?)));
    let gas = followed.masses.iter().copied().zip(followed.velocities.iter().copied());
    let mut whole = mean(gas.chain(points));
    (0..D).filter(|&k| followed.domain.axes[k] == Axis::REFLECTING).for_each(|k| whole[k] = 0.0);
    let of_points = followed.points.iter_mut().filter_map(|p| p.velocity.as_mut());
    for v in followed.velocities.iter_mut().chain(of_points) {
        (0..D).for_each(|k| v[k] -= whole[k]);
    }
    whole
}
