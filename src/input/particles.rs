//! The particles of one run as the field of a new one: re-sampling to another number of particles.
//!
//! The gas of a snapshot is a cloud of points whose density is the file's own column or, where it has none, the sum
//! rho_i = sum_j m_j W(r_ij, H_i) over the neighbors with n V_d H^d = N_H (Price 2012, J. Comput. Phys. 231, 759, equations 7
//! and 10), with the default kernel and its neighbor number. The mass is that of the particles, not of the interpolated
//! density. Periodic axes are those of the file's box; other axes end with the particles.
//!
//! Cells of AREPO are no samples: each has its density throughout, up to the places that are nearer to another one's position
//! (Springel 2010, MNRAS 401, 791, section 3). They fill the box, and their masses are exact. With `input.interpolation: nearest`
//! any particles are taken for such cells.
//!
//! What belongs to a particle and not to its place is not carried: masses, smoothing lengths, numbers.

use crate::error::{Error, Result};
use crate::field::{FieldOptions, Interpolation, MassEstimate, Missing, Samples, Scatter, Source, from_particles};
use crate::input::totals::Totals;
use crate::metrics::Measured;
use crate::scene::BoundaryName;
use sph::domain::{Axis, Domain, Region};
use sph::kernel::{KernelName, default_kernel_neighbors};
use sph::sums::support_guess;
use sph_formats::{
    Geometry, Location, ParticleFile, ParticleTable, RawField, Species, Unit, UnitDimension, UnitSystem, Values,
    Variable,
    common::particle_names,
    model::{COSMOLOGY_KEY, DOUBT_KEY, MESH_KEY, VORONOI},
};
use std::collections::BTreeMap;
use std::path::Path;

/// A particle file as a field.
#[derive(Debug)]
pub struct Snapshot {
    pub field: RawField,
    /// Edge lengths of the box; unused axes are 0.
    pub box_size: [f64; 3],
    /// Lower corner of the box.
    pub box_corner: [f64; 3],
    pub periodic: [bool; 3],
    /// What the scene says of the faces along each axis.
    pub(crate) stated: [Option<BoundaryName>; 3],
    /// Whether no particle is near the faces of a periodic box that is kept, of which the scene says nothing.
    pub(crate) is_alone: bool,
    /// Whether the gas is cells of a moving mesh.
    pub is_mesh: bool,
    /// Of all gas, in the file's units.
    pub mass: f64,
    pub masses: Vec<f64>,
    /// Particles that are no gas.
    pub others: Vec<Species>,
    pub units: UnitSystem,
    /// The file's unit of time, in s.
    pub time_unit: f64,
    /// That of the snapshot, in it.
    pub time: f64,
    /// What the file says of a box that expands.
    pub cosmology: Option<String>,
    /// As it was read, where most of it stays as it is.
    pub(crate) file: Option<ParticleFile>,
}

/// Share of a box's edge by which places may be beyond it, by rounding in single precision.
const BEYOND: f64 = 1e-6;
/// What is empty of a box about a body which is probably alone: a share of the edge, and spacings of the gas.
const ISOLATED: f64 = 0.1;
const APART: f64 = 4.0;

/// Columns that mean nothing at another place.
const OF_PARTICLES: [&str; 4] = [
    particle_names::MASSES,
    particle_names::SUPPORT_RADIUS,
    particle_names::SMOOTHING_LENGTH,
    particle_names::COORDINATES,
];
/// How notes end on columns that are not carried.
pub(crate) const LEFT_OUT: &str = "was left out";
/// The same of cells.
const OF_CELLS: [&str; 2] = ["Volume", "CenterOfMass"];

impl Snapshot {
    /// Takes the gas of a particle file. `density` names another column than the usual one.
    ///
    /// # Errors
    /// No gas, no coordinates or masses, or values that are no masses.
    pub fn new(path: &Path, file: &ParticleFile, density: Option<&str>) -> Result<Self> {
        let wrong = |problem: String| Error::field(path.display().to_string(), problem);
        let missing = |what: &str| wrong(format!("a particle file without {what} is no density field"));
        let gas = file.species.iter().find(|s| s.part_type == 0 && s.table.count > 0);
        let table = &gas.ok_or_else(|| missing("gas particles"))?.table;
        let header = &file.header;
        let points = points(table).ok_or_else(|| missing("Coordinates"))?;
        let masses = table.column(particle_names::MASSES).ok_or_else(|| missing("Masses"))?.values.to_f64();
        if let Some(i) = masses.iter().position(|m| !(m.is_finite() && *m >= 0.0)) {
            return Err(wrong(format!("particle {i} has mass {}; masses must be finite and not negative", masses[i])));
        }
        let is_mesh = header.provenance.iter().any(|(key, kind)| key == MESH_KEY && kind == VORONOI);
        let mut notes = vec![match is_mesh {
            true => format!("the file has {} cells of a moving mesh instead of particles", table.count),
            false => format!("{} gas particles are read as samples of their own density", table.count),
        }];
        notes.extend(header.provenance.iter().filter(|fact| fact.0 == DOUBT_KEY).map(|fact| fact.1.clone()));
        let others = file.species.iter().filter(|s| s.part_type != 0 && s.table.count > 0).cloned().collect();
        let has_units = header.units != UnitSystem::CODE;
        let unit = |d: UnitDimension| {
            let stated = header.units.unit(d);
            has_units.then(|| if d == UnitDimension::NONE { Unit { symbol: "none".into(), ..stated } } else { stated })
        };
        let name = density.unwrap_or(particle_names::DENSITY);
        let mut variables = Vec::new();
        for c in &table.columns {
            if OF_PARTICLES.contains(&c.name.as_str()) || (c.name == name && is_zero(&c.values)) {
                continue;
            }
            if is_mesh && OF_CELLS.contains(&c.name.as_str()) {
                notes.push(format!("'{}' belongs to the cells and {LEFT_OUT}", c.name));
                continue;
            }
            let is_material = particle_names::standard(&c.name) == Some(particle_names::MATERIAL_IDS);
            if matches!(c.values, Values::I64(_)) && !is_material {
                notes.push(format!("'{}' belongs to the particles and {LEFT_OUT}", c.name));
                continue;
            }
            variables.push(Variable {
                name: c.name.clone(),
                description: None,
                unit: match c.name.as_str() {
                    particle_names::MAGNETIC_FIELD => unit(UnitDimension::MAGNETIC_FIELD),
                    _ => unit(c.dimension),
                },
                location: Location::Node,
                components: c.components,
                values: c.values.clone(),
            });
        }
        let mut snapshot = Self {
            mass: masses.iter().sum(),
            masses,
            others,
            units: header.units,
            field: RawField {
                path: path.into(),
                format: "particles",
                geometry: Geometry::Cloud { dimension: header.dimension, points, unit: unit(UnitDimension::LENGTH) },
                variables,
                density: Some(name.into()),
                metadata: Vec::new(),
                notes,
            },
            box_size: header.box_size,
            box_corner: header.box_corner.unwrap_or_default(),
            periodic: header.periodic,
            stated: [None; 3],
            is_alone: false,
            is_mesh,
            time_unit: header.units.time,
            time: header.time,
            cosmology: header.provenance.iter().find(|fact| fact.0 == COSMOLOGY_KEY).map(|fact| fact.1.clone()),
            file: None,
        };
        if snapshot.field.variable(name).is_none() {
            if density.is_some_and(|d| d != particle_names::DENSITY) {
                return Err(wrong(format!("there is no column '{name}' with densities")));
            }
            let values = match header.dimension {
                1 => snapshot.summed::<1>(),
                2 => snapshot.summed::<2>(),
                _ => snapshot.summed::<3>(),
            }?;
            let note = "the particles have no density column; densities were computed by summation over neighbors";
            snapshot.field.notes.push(note.into());
            snapshot.field.variables.push(Variable {
                name: name.into(),
                description: None,
                unit: unit(UnitDimension::mass_density(header.dimension)),
                location: Location::Node,
                components: 1,
                values: Values::F64(values),
            });
        }
        Ok(snapshot)
    }

    /// Whether it has internal energies, and all of them are 0.
    pub(crate) fn is_cold(&self) -> bool {
        self.field.variable(particle_names::INTERNAL_ENERGY).is_some_and(|u| is_zero(&u.values))
    }

    /// What its particles have together.
    pub(crate) fn totals(&self) -> Totals {
        let Geometry::Cloud { dimension, points, .. } = &self.field.geometry else {
            return Totals::default();
        };
        let periodic = sph::array(|k| self.is_periodic(k) && self.stated[k] != Some(BoundaryName::Reflecting));
        Totals::new((&self.field, self.units == UnitSystem::CODE), points, &self.masses, *dimension, periodic)
    }

    /// Of a periodic box: particles that are beyond it, and a body that ends far from its faces.
    fn doubts_of_box(&self) -> Vec<String> {
        let Geometry::Cloud { dimension, points, .. } = &self.field.geometry else { return Vec::new() };
        let axes: Vec<usize> = (0..*dimension).filter(|&k| self.is_periodic(k)).collect();
        // From the lower corner, in edges.
        let place = |p: &[f64; 3], k: usize| (p[k] - self.box_corner[k]) / self.box_size[k];
        let is_beyond = |p: &&[f64; 3]| axes.iter().any(|&k| !(-BEYOND..=1.0 + BEYOND).contains(&place(p, k)));
        let beyond = points.iter().filter(is_beyond).count();
        if beyond > 0 {
            return vec![format!(
                "{beyond} of {} particles lie outside the periodic box of the file, and are replaced by their images \
                 inside: check its size and the corner that \
                 its coordinates count from; `--boundary open` takes them as they are",
                points.len()
            )];
        }
        let text = "the box of the file counts as periodic, but no particle is near its faces: if the body is alone there, which many files do not say, \
                    `--boundary open` keeps its angular momentum; if it is not, `--boundary periodic` says so";
        Vec::from_iter(self.is_alone.then(|| text.to_owned()))
    }

    fn is_periodic(&self, axis: usize) -> bool {
        self.periodic[axis] && self.box_size[axis] > 0.0
    }

    /// Its fields, with its mass, and what else is known of it.
    ///
    /// # Errors
    /// Particles that span no volume, or values that are no densities.
    pub(crate) fn into_source<const D: usize>(self, options: &FieldOptions<D>) -> Result<(Source<D>, OfSnapshot)> {
        self.refuse_unfinished(options)?;
        let mut options = options.clone();
        if self.is_mesh {
            options.interpolation.get_or_insert(Interpolation::Constant);
        }
        let has_cells = options.interpolation == Some(Interpolation::Constant);
        let domain = if has_cells { self.filled::<D>()? } else { self.domain::<D>()? };
        let mass = MassEstimate { value: self.mass, error: 0.0 };
        let is_material = |v: &&Variable| particle_names::standard(&v.name) == Some(particle_names::MATERIAL_IDS);
        let of_materials = |v: &Variable| material_shares(&v.values, &self.masses);
        let materials = self.field.variables.iter().find(is_material).map(of_materials).unwrap_or_default();
        let mut doubts = self.doubts_of_box();
        let (totals, others, units) = (self.totals(), self.others, self.units);
        let (source, Samples { scatter, doubt }) = from_particles(self.field, (&domain, Some(&self.masses)), &options)?;
        doubts.extend(doubt);
        Ok((Source { mass: Some(mass), ..source }, OfSnapshot { totals, scatter, doubts, others, units, materials }))
    }

    /// Refuses velocities and energies that are no numbers: without them the particles would be at rest, or cold. Energies of a gas
    /// are not negative either; those of materials count from a state of their own.
    fn refuse_unfinished<const D: usize>(&self, options: &FieldOptions<D>) -> Result<()> {
        let is_wanted = |name: &str| options.carried.as_ref().is_none_or(|names| names.iter().any(|n| n == name));
        let is_gas = !self
            .field
            .variables
            .iter()
            .any(|v| particle_names::standard(&v.name) == Some(particle_names::MATERIAL_IDS));
        for name in [particle_names::VELOCITIES, particle_names::INTERNAL_ENERGY] {
            let Some(variable) = self.field.variable(name).filter(|_| is_wanted(name)) else { continue };
            let values = &variable.values;
            let find = |is_bad: &dyn Fn(f64) -> bool| (0..values.len()).find(|&i| is_bad(values.get(i)));
            let refused = |i: usize, expected: &str| {
                let (value, particle) = (values.get(i), i / variable.components.max(1));
                Err(Error::field(name, format!("is {value} at particle {particle}, expected {expected}")))
            };
            if options.missing == Missing::Error
                && let Some(i) = find(&|v| !v.is_finite())
            {
                let remedy =
                    "finite numbers; correct the file, set input.missing: zero, or leave it out with input.carry";
                return refused(i, remedy);
            }
            if name == particle_names::INTERNAL_ENERGY
                && is_gas
                && let Some(i) = find(&|v| v < 0.0)
            {
                return refused(i, "0 or more; correct the file, or leave it out with input.carry");
            }
        }
        Ok(())
    }

    /// The box where it is periodic, else as far as there are particles.
    ///
    /// # Errors
    /// Coordinates that are not finite, or that span no volume.
    pub fn domain<const D: usize>(&self) -> Result<Domain<D>> {
        let Geometry::Cloud { points, .. } = &self.field.geometry else {
            return Err(Error::field("Coordinates", "are no points".to_owned()));
        };
        let is_periodic = |k: usize| self.is_periodic(k);
        let ends = |k: usize, fold: fn(f64, f64) -> f64, start: f64| points.iter().map(|p| p[k]).fold(start, fold);
        let lo = sph::array(|k| if is_periodic(k) { self.box_corner[k] } else { ends(k, f64::min, f64::INFINITY) });
        let hi = sph::array(|k| {
            if is_periodic(k) { self.box_corner[k] + self.box_size[k] } else { ends(k, f64::max, f64::NEG_INFINITY) }
        });
        let axes = std::array::from_fn(|k| if is_periodic(k) { Axis::Periodic } else { Axis::OPEN });
        if let Some(k) = (0..D).find(|&k| !(lo[k] < hi[k])) {
            let problem = format!("run from {} to {} on axis {k}, which spans no volume", lo[k], hi[k]);
            return Err(Error::field("Coordinates", problem));
        }
        Ok(Domain::new(lo, hi, axes, Region::Box)?)
    }

    /// The box that cells fill: that of the file, and as far as there are cells.
    fn filled<const D: usize>(&self) -> Result<Domain<D>> {
        let Domain { lo, hi, axes, .. } = self.domain::<D>()?;
        let has_box = |k: usize| self.box_size[k] > 0.0;
        let lo = sph::array(|k| if has_box(k) { lo[k].min(self.box_corner[k]) } else { lo[k] });
        let end = |k: usize| self.box_corner[k] + self.box_size[k];
        let hi = sph::array(|k| if has_box(k) { hi[k].max(end(k)) } else { hi[k] });
        Ok(Domain::new(lo, hi, axes, Region::Box)?)
    }

    /// Mass densities by summation over the neighbors.
    fn summed<const D: usize>(&self) -> Result<Vec<f64>> {
        let masses = &self.masses;
        let domain = self.domain::<D>()?;
        let Geometry::Cloud { points, .. } = &self.field.geometry else {
            return Err(Error::field("Coordinates", "are no points".to_owned()));
        };
        if let Some(i) = points.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(Error::field(
                "Coordinates",
                format!("particle {i} lies at {:?}, expected finite ones", points[i]),
            ));
        }
        let wrapped: Vec<[f64; D]> = points.iter().map(|p| domain.wrapped(&sph::array(|k| p[k]))).collect();
        let positions = std::array::from_fn(|k| wrapped.iter().map(|p| p[k]).collect());
        let neighbors = default_kernel_neighbors(D);
        let spacing = domain.mean_spacing(masses.len());
        let guess = support_guess::<D>(neighbors, masses.len(), |_| spacing);
        let measured = Measured::new(KernelName::default(), &domain, &positions, masses, &guess, neighbors);
        Ok(measured.sums.iter().map(|s| s.weighted).collect())
    }
}

/// What is known of a snapshot beside its fields.
#[derive(Debug, Clone)]
pub(crate) struct OfSnapshot {
    /// Of all its gas; empty where only a part of it is taken.
    pub totals: Totals,
    pub scatter: Option<Scatter>,
    /// What is wrong with its box, densities or masses, with the remedy.
    pub doubts: Vec<String>,
    /// Particles that are no gas, in the file's units; none where only a part of the gas is taken.
    pub others: Vec<Species>,
    pub units: UnitSystem,
    /// Shares of the mass of all its gas by the number of their material; none where only a part of it is taken.
    pub materials: BTreeMap<i64, f64>,
}

impl OfSnapshot {
    /// Forgets what is true of all its particles alone, and says `why` where particles are left out.
    pub(crate) fn leave_all_but_fields(&mut self, why: &str) -> Option<String> {
        (self.totals, self.materials) = (Totals::default(), BTreeMap::new());
        self.leave_others(why)
    }

    /// Leaves out what is no gas, and says `why` where there is some.
    pub(crate) fn leave_others(&mut self, why: &str) -> Option<String> {
        let count: usize = std::mem::take(&mut self.others).iter().map(|s| s.table.count).sum();
        (count > 0).then(|| format!("{count} particles of other types than gas are left out: {why}"))
    }
}

/// Shares of the mass by the number of the material.
pub(crate) fn material_shares(materials: &Values, masses: &[f64]) -> BTreeMap<i64, f64> {
    let total: f64 = masses.iter().sum();
    let mut shares = BTreeMap::new();
    for (i, mass) in masses.iter().enumerate().take(materials.len()) {
        *shares.entry(materials.get(i) as i64).or_insert(0.0) += mass / total;
    }
    shares
}

fn points(table: &ParticleTable) -> Option<Vec<[f64; 3]>> {
    let x = table.column(particle_names::COORDINATES)?;
    let component = |i: usize, k: usize| if k < x.components { x.values.get(i * x.components + k) } else { 0.0 };
    Some((0..table.count).map(|i| sph::array(|k| component(i, k))).collect())
}

/// Whether particles of a periodic box end far from all of its faces: by a part of its edges, and by some spacings of the gas.
pub(crate) fn is_alone(file: &ParticleFile) -> bool {
    let header = &file.header;
    let (d, corner) = (header.dimension, header.box_corner.unwrap_or_default());
    if !header.periodic[..d].iter().all(|is_periodic| *is_periodic) {
        return false;
    }
    let ends: Vec<[[f64; 2]; 3]> = file.species.iter().map(|s| sph::array(|k| ends(&s.table, k))).collect();
    let gas = file.species.iter().position(|s| s.part_type == 0);
    let Some((count, ends_of_gas)) = gas.map(|i| (file.species[i].table.count, ends[i])) else { return false };
    let volume: f64 = ends_of_gas[..d].iter().map(|[lo, hi]| hi - lo).product();
    let spacing = (volume / count as f64).powf(1.0 / d as f64);
    (0..d).all(|k| {
        let (edge, start) = (header.box_size[k], corner[k]);
        let [lo, hi] = ends.iter().fold(NOWHERE, |all, of| [all[0].min(of[k][0]), all[1].max(of[k][1])]);
        let gap = edge - (hi - lo);
        lo >= start && hi <= start + edge && gap > ISOLATED * edge && gap > APART * spacing
    })
}

/// The ends of nothing.
const NOWHERE: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// The least and the largest coordinate along an axis; 0 along one that there is none of.
fn ends(table: &ParticleTable, k: usize) -> [f64; 2] {
    let Some(x) = table.column(particle_names::COORDINATES) else { return NOWHERE };
    let place = |i: usize| if k < x.components { x.values.get(i * x.components + k) } else { 0.0 };
    (0..table.count).map(place).fold(NOWHERE, |[lo, hi], x| [lo.min(x), hi.max(x)])
}

/// Whether a column is 0 throughout: initial conditions often come with densities of 0.
pub(crate) fn is_zero(values: &Values) -> bool {
    (0..values.len()).all(|i| values.get(i) == 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sph_formats::{Column, RunHeader, Species};

    fn file(velocity: f64) -> ParticleFile {
        let column = |name, values, dimension| Column::new(name, 1, Values::F64(values), dimension);
        let columns = vec![
            column(particle_names::COORDINATES, (0..9).map(f64::from).collect(), UnitDimension::LENGTH),
            column(
                particle_names::VELOCITIES,
                (0..9).map(|i| if i == 4 { velocity } else { 1.0 }).collect(),
                UnitDimension::VELOCITY,
            ),
            column(particle_names::MASSES, vec![1.0; 9], UnitDimension::MASS),
        ];
        let header = RunHeader {
            dimension: 1,
            box_size: [9.0, 0.0, 0.0],
            box_corner: None,
            periodic: [false; 3],
            units: UnitSystem::CODE,
            time: 0.0,
            kernel: String::new(),
            kernel_neighbors: 0.0,
            provenance: Vec::new(),
            layouts: Vec::new(),
        };
        ParticleFile { header, species: vec![Species { part_type: 0, table: ParticleTable { count: 9, columns } }] }
    }

    /// One velocity that is no number must not put all particles at rest.
    #[test]
    fn velocities_that_are_no_numbers_are_refused_unless_they_are_left_out() {
        let source = |velocity: f64, options: FieldOptions<1>| {
            let snapshot = Snapshot::new(Path::new("made.hdf5"), &file(velocity), None).unwrap();
            snapshot.into_source::<1>(&options).map(|(source, _)| source.carried.len()).map_err(|e| e.to_string())
        };
        assert_eq!(source(2.0, FieldOptions::default()), Ok(1));
        let refusal = source(f64::NAN, FieldOptions::default()).unwrap_err();
        assert!(["Velocities", "NaN", "particle 4", "input.carry"].iter().all(|w| refusal.contains(w)), "{refusal}");
        assert_eq!(source(f64::NAN, FieldOptions { carried: Some(Vec::new()), ..FieldOptions::default() }), Ok(0));
        assert_eq!(source(f64::NAN, FieldOptions { missing: Missing::Zero, ..FieldOptions::default() }), Ok(1));
    }
}
