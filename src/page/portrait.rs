//! Particles as figures show them: in named units, with the measures of each particle.

use crate::error::{Error, Result};
use crate::metrics::{Detail, InOwnUnits, Wanted};
use crate::target::{Positions, at};
use sph::domain::{Axis, Domain};
use sph::kernel::{KernelName, default_kernel_neighbors};
use sph_formats::common::particle_names as names;
use sph_formats::units::{EARTH_RADIUS_CGS, SOLAR_RADIUS_CGS};
use sph_formats::{ParticleFile, ParticleTable, RunHeader, UnitDimension, UnitSystem, Values};

/// Against what the profile of a body is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Side {
    /// The distance from this place, in the file's coordinates.
    Radius([f64; 3]),
    /// The coordinate along which the density changes most.
    Axis,
}

/// What a run knows of its particles beside the file.
#[derive(Debug, Clone)]
pub struct Seen {
    /// In the file's units.
    pub detail: Detail,
    pub side: Side,
    /// Whether the file's numbers have units: centimeters and pure numbers look the same.
    pub has_units: bool,
}

/// Names of the units of a file, and the factors to them.
#[derive(Debug, Clone, PartialEq)]
pub struct Labels {
    pub length: String,
    pub density: String,
    pub velocity: String,
    /// From the file's numbers.
    pub density_factor: f64,
    pub velocity_factor: f64,
    /// In prose.
    pub system: String,
}

/// Gas of a file, in its own numbers.
#[derive(Debug, Clone)]
pub struct Portrait {
    pub dimension: usize,
    pub periodic: [bool; 3],
    /// The box along periodic axes, elsewhere what the particles span; unused axes are 0.
    pub lo: [f64; 3],
    pub hi: [f64; 3],
    pub side: Side,
    pub positions: Vec<[f64; 3]>,
    pub masses: Vec<f64>,
    pub velocities: Option<Vec<[f64; 3]>>,
    pub materials: Option<Vec<i64>>,
    pub kernel: KernelName,
    pub kernel_neighbors: f64,
    pub detail: Detail,
    pub labels: Labels,
    /// What was assumed, and what is not shown.
    pub notes: Vec<String>,
}

impl Portrait {
    /// Of the gas in `file`, or of its most numerous particles where it has none. `seen` is what a run has measured; without
    /// it the particles are measured here, with the kernel that the file names, and their profile is over the radius about the
    /// center of mass, where all axes are open, else along an axis.
    ///
    /// # Errors
    /// No particles, no coordinates or masses, or values that are none.
    pub fn new(file: &ParticleFile, seen: Option<Seen>) -> Result<Self> {
        let header = &file.header;
        let (table, mut notes) = shown(file)?;
        let coordinates = numbers(table, names::COORDINATES, |v| v.is_finite(), "finite numbers")?;
        let masses = numbers(table, names::MASSES, |v| v.is_finite() && v >= 0.0, "numbers from 0 on")?;
        let total = masses.iter().sum::<f64>();
        if !(total > 0.0 && total.is_finite()) {
            return Err(Error::field(names::MASSES, format!("add up to {total}; expected a finite number above 0")));
        }
        let d = header.dimension;
        if !(1..=3).contains(&d) || coordinates.len() != d * table.count || masses.len() != table.count {
            let problem = format!("are {} numbers for {} particles in {d}-D", coordinates.len(), table.count);
            return Err(Error::field(names::COORDINATES, problem));
        }
        let vector = |v: &[f64], i: usize| sph::array(|k| if k < d { v[i * d + k] } else { 0.0 });
        let mut positions: Vec<[f64; 3]> = (0..table.count).map(|i| vector(&coordinates, i)).collect();
        let corner = header.box_corner.unwrap_or_default();
        let is_periodic = |k: usize| k < d && header.periodic[k] && header.box_size[k] > 0.0;
        for x in &mut positions {
            for k in (0..d).filter(|&k| is_periodic(k)) {
                x[k] = (x[k] - corner[k]).rem_euclid(header.box_size[k]) + corner[k];
            }
        }
        let (mut lo, mut hi) = ([0.0; 3], [0.0; 3]);
        for k in 0..d {
            let spanned = || shown_range(positions.iter().map(|x| x[k]).collect());
            (lo[k], hi[k]) = if is_periodic(k) { (corner[k], corner[k] + header.box_size[k]) } else { spanned() };
        }
        let is_beyond = |x: &&[f64; 3]| (0..d).any(|k| x[k] < lo[k] || x[k] > hi[k]);
        match positions.iter().filter(is_beyond).count() {
            0 => {}
            beyond => notes.push(format!("{beyond} of the particles, far from all others, are beyond the pictures")),
        }
        let velocities =
            table.column(names::VELOCITIES).filter(|c| c.components == d && c.values.len() == d * table.count);
        let velocities = velocities.map(|c| c.values.to_f64()).filter(|v| v.iter().all(|v| v.is_finite()));
        let velocities = velocities.filter(|v| v.iter().any(|c| *c != 0.0));
        let materials = table.column(names::MATERIAL_IDS).and_then(|c| match &c.values {
            Values::I64(ids) => Some(ids.clone()),
            _ => None,
        });
        let (kernel, stated) = kernel_of(header);
        let kernel_neighbors = stated.unwrap_or_else(|| default_kernel_neighbors(d));
        let has_units = seen.as_ref().map_or(header.units != UnitSystem::CODE, |s| s.has_units);
        let side = seen.as_ref().map(|s| s.side);
        let detail = match seen.map(|s| s.detail) {
            Some(detail) => detail,
            None => {
                notes.push(format!(
                    "sums are with the {} kernel and {kernel_neighbors:.1} neighbors{}",
                    kernel.title(),
                    if stated.is_some() { ", as the file says" } else { ": the file names none" }
                ));
                let sums = (kernel, kernel_neighbors);
                measured(table, header, (&coordinates, &masses), sums, &mut notes)?
            }
        };
        let isolated = !(0..d).any(is_periodic);
        let mut portrait = Self {
            dimension: d,
            periodic: sph::array(is_periodic),
            lo,
            hi,
            side: Side::Axis,
            velocities: velocities.map(|v| (0..table.count).map(|i| vector(&v, i)).collect()),
            materials: materials.filter(|m| m.len() == table.count),
            positions,
            masses,
            kernel,
            kernel_neighbors,
            detail,
            labels: Labels::new(&header.units, has_units),
            notes,
        };
        portrait.side = match side {
            Some(Side::Radius(_)) | None if d == 1 => Side::Axis,
            Some(side) => side,
            None if isolated => Side::Radius(portrait.center_of_mass()),
            None => Side::Axis,
        };
        Ok(portrait)
    }

    /// Of a result that is not written: `positions` times `length`, and everything else, in the input's units.
    pub fn of_result<const D: usize>(
        domain: &Domain<D>,
        (positions, length): (&Positions<D>, f64),
        masses: Vec<f64>,
        (kernel, kernel_neighbors): (KernelName, f64),
        detail: Detail,
        side: Side,
    ) -> Self {
        let filled = |v: [f64; D]| sph::array(|k| if k < D { v[k] } else { 0.0 });
        let code = || "input's unit".to_owned();
        Self {
            dimension: D,
            periodic: sph::array(|k| k < D && domain.axes[k] == Axis::Periodic),
            lo: filled(domain.lo),
            hi: filled(domain.hi),
            side,
            positions: (0..masses.len()).map(|i| filled(at(positions, i).map(|x| x * length))).collect(),
            masses,
            velocities: None,
            materials: None,
            kernel,
            kernel_neighbors,
            detail,
            labels: Labels {
                length: code(),
                density: code(),
                velocity: code(),
                density_factor: 1.0,
                velocity_factor: 1.0,
                system: "those of the input".into(),
            },
            notes: Vec::new(),
        }
    }

    pub fn count(&self) -> usize {
        self.masses.len()
    }

    /// Middle of what is shown.
    pub fn middle(&self) -> [f64; 3] {
        match self.side {
            Side::Radius(center) => center,
            Side::Axis => sph::array(|k| {
                let middle = self.lo[k] + 0.5 * (self.hi[k] - self.lo[k]);
                let mut all: Vec<f64> = self.positions.iter().map(|x| x[k]).collect();
                if all.iter().zip(&self.detail.support).any(|(x, reach)| (x - middle).abs() < 0.5 * reach) {
                    return middle;
                }
                // A layer elsewhere in its box.
                let half = all.len() / 2;
                *all.select_nth_unstable_by(half, f64::total_cmp).1
            }),
        }
    }

    fn center_of_mass(&self) -> [f64; 3] {
        // Of offsets and shares, which do not overflow.
        let total: f64 = self.masses.iter().sum();
        let along = |k: usize| {
            self.positions.iter().zip(&self.masses).map(|(x, m)| (m / total) * (x[k] - self.lo[k])).sum::<f64>()
        };
        sph::array(|k| self.lo[k] + along(k))
    }

    /// rho/rho* - 1 of particle `i`, where the target is known.
    pub fn error(&self, i: usize) -> Option<f64> {
        let wanted = *self.detail.wanted.as_ref()?.target.get(i)?;
        let error = self.detail.density[i] / wanted - 1.0;
        (wanted > 0.0 && error.is_finite()).then_some(error)
    }

    /// Whether the kernel can follow the target at particle `i`, where that is known.
    pub fn is_resolved(&self, i: usize) -> Option<bool> {
        self.detail.wanted.as_ref()?.resolved.get(i).copied()
    }

    pub fn length_label(&self, what: &str) -> String {
        format!("{what} [{}]", self.labels.length)
    }

    pub fn density_label(&self) -> String {
        format!("density [{}]", self.labels.density)
    }
}

impl Labels {
    fn new(units: &UnitSystem, has_units: bool) -> Self {
        if !has_units {
            let code = || "code units".to_owned();
            let (length, density, velocity) = (code(), code(), code());
            let system = "numbers without units (code units)".into();
            return Self { length, density, velocity, density_factor: 1.0, velocity_factor: 1.0, system };
        }
        let known = [
            (1.0, "cm"),
            (100.0, "m"),
            (SOLAR_RADIUS_CGS, "Rsun"),
            (EARTH_RADIUS_CGS, "Rearth"),
            (UnitSystem::galactic().length, "kpc"),
        ];
        let near = |to: f64| (units.length - to).abs() <= 1e-9 * to;
        let name = known.iter().find(|(to, _)| near(*to)).map(|(_, name)| (*name).to_owned());
        let length = name.unwrap_or_else(|| units.symbol(UnitDimension::LENGTH));
        let symbol = |d| units.symbol(d);
        Self {
            system: format!(
                "length {}, mass {}, time {}, temperature {}",
                symbol(UnitDimension::LENGTH),
                symbol(UnitDimension::MASS),
                symbol(UnitDimension::TIME),
                symbol(UnitDimension::TEMPERATURE)
            ),
            length,
            density: "g/cm\u{b3}".into(),
            velocity: "km/s".into(),
            density_factor: units.to_cgs(UnitDimension::mass_density(3)),
            velocity_factor: units.to_cgs(UnitDimension::VELOCITY) / 1e5,
        }
    }
}

/// Share of particles at either end that may be far from all others, and how much farther than these.
const FEW: f64 = 1e-3;
const FAR: f64 = 3.0;

/// From the least to the largest coordinate, without the few that are far away from all others.
fn shown_range(mut all: Vec<f64>) -> (f64, f64) {
    all.sort_unstable_by(f64::total_cmp);
    let (Some(&least), Some(&largest)) = (all.first(), all.last()) else { return (0.0, 0.0) };
    let few = ((all.len() as f64 * FEW).ceil() as usize).min(all.len() - 1);
    let (lo, hi) = (all[few], all[all.len() - 1 - few]);
    let margin = 0.05 * (hi - lo);
    if hi > lo && largest - least > FAR * (hi - lo) {
        ((lo - margin).max(least), (hi + margin).min(largest))
    } else {
        (least, largest)
    }
}

/// The largest of values from 0 on, without the few that are far beyond all others.
pub(super) fn shown_end(mut all: Vec<f64>) -> f64 {
    all.sort_unstable_by(f64::total_cmp);
    let Some(&largest) = all.last() else { return 0.0 };
    let usual = all[all.len() - 1 - ((all.len() as f64 * FEW).ceil() as usize).min(all.len() - 1)];
    if usual > 0.0 && largest > FAR * usual { 1.05 * usual } else { largest }
}

/// The particles that figures show, with a note where they are not all.
fn shown(file: &ParticleFile) -> Result<(&ParticleTable, Vec<String>)> {
    let gas = file.species.iter().find(|s| s.part_type == 0 && s.table.count > 0);
    let most = || file.species.iter().filter(|s| s.table.count > 0).max_by_key(|s| s.table.count);
    let species = gas.or_else(most).ok_or_else(|| Error::field("particles", "are none in this file"))?;
    let others: usize = file.species.iter().map(|s| s.table.count).sum::<usize>() - species.table.count;
    let mut notes = Vec::new();
    if species.part_type != 0 {
        notes.push(format!("there is no gas: particles of type {} are shown", species.part_type));
    }
    if others > 0 {
        notes.push(format!("{others} particles of other types are not shown"));
    }
    Ok((&species.table, notes))
}

fn numbers(table: &ParticleTable, name: &str, fits: impl Fn(f64) -> bool, expected: &str) -> Result<Vec<f64>> {
    let column = table.column(name).ok_or_else(|| Error::field(name, format!("are missing; expected {expected}")))?;
    let values = column.values.to_f64();
    match values.iter().position(|v| !fits(*v)) {
        Some(i) => {
            let particle = i / column.components.max(1);
            Err(Error::field(name, format!("has {} at particle {particle}, expected {expected}", values[i])))
        }
        None => Ok(values),
    }
}

/// The kernel that a file names, or the default one.
fn kernel_of(header: &RunHeader) -> (KernelName, Option<f64>) {
    let named = KernelName::titled(&header.kernel);
    let stated = Some(header.kernel_neighbors).filter(|n| n.is_finite() && (2.0..=1000.0).contains(n));
    named.zip(stated).map_or((KernelName::default(), None), |(kernel, n)| (kernel, Some(n)))
}

/// Measures the particles of a file.
fn measured(
    table: &ParticleTable,
    header: &RunHeader,
    particles: (&[f64], &[f64]),
    sums: (KernelName, f64),
    notes: &mut Vec<String>,
) -> Result<Detail> {
    let column = |name: &str| {
        let values = table.column(name)?.values.to_f64();
        (values.len() == table.count && values.iter().all(|v| v.is_finite() && *v > 0.0)).then_some(values)
    };
    let stated = column(names::DENSITY);
    let frame = (&header.box_size, header.periodic);
    let mut detail = match header.dimension {
        1 => in_dimension::<1>(particles, frame, sums, stated.as_deref()),
        2 => in_dimension::<2>(particles, frame, sums, stated.as_deref()),
        _ => in_dimension::<3>(particles, frame, sums, stated.as_deref()),
    }?;
    match stated {
        Some(density) => detail.density = density,
        None => notes.push("the file has no densities: they are summed here".into()),
    }
    if let Some(target) = column(names::TARGET_DENSITY) {
        detail.wanted = Some(Wanted { target, ..Wanted::default() });
    }
    Ok(detail)
}

fn in_dimension<const D: usize>(
    (coordinates, masses): (&[f64], &[f64]),
    frame: (&[f64; 3], [bool; 3]),
    (kernel, neighbors): (KernelName, f64),
    stated: Option<&[f64]>,
) -> Result<Detail> {
    let own = InOwnUnits::<D>::new(coordinates, masses, frame)
        .map_err(|e| Error::field(names::COORDINATES, format!("make no box: {e}")))?;
    let mean = own.domain.mean_spacing(masses.len());
    let spacing = |i: usize| {
        let by_column = stated.map(|rho| (masses[i] / rho[i]).powf(1.0 / D as f64) / own.size);
        by_column.filter(|s| s.is_finite() && *s > 0.0).unwrap_or(mean).min(1.0)
    };
    let detail = Detail::new((kernel, neighbors), &own.domain, (&own.positions, &own.masses), spacing);
    Ok(detail.scaled(own.size, own.total / own.size.powi(D as i32)))
}
