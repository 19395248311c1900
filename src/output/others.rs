//! Particles other than gas in a snapshot that is re-sampled: dark matter, stars, sinks. They are copied to the new file unchanged, in its units
//! and box, with ids that follow those of the gas.

use super::frame::Frame;
use crate::error::{Error, Result};
use crate::input::internal_units::Prepared;
use crate::target::Positions;
use sph::domain::{Axis, Domain, Region};
use sph_formats::common::particle_names as names;
use sph_formats::{Column, ParticleTable, Species, UnitDimension, UnitSystem, Values};

/// Part of the domain's size that is no distance.
const ROUNDING: f64 = 1e-9;

/// Particles that are no gas, in internal units of length and else in the file's.
pub(crate) struct Others<'a, const D: usize> {
    species: Vec<(&'a Species, Positions<D>)>,
    units: UnitSystem,
    /// How many lay beyond a periodic face, and are where their images are.
    folded: usize,
}

impl<'a, const D: usize> Others<'a, D> {
    /// Those of the input; `None` where there are none.
    ///
    /// # Errors
    /// Coordinates that are missing or not finite.
    pub fn of(prepared: &'a Prepared<D>) -> Result<Option<Others<'a, D>>> {
        let Some((species, units)) = prepared.of_snapshot.as_ref().map(|s| (&s.others, s.units)) else {
            return Ok(None);
        };
        let mut folded = 0;
        let mut placed = |species: &'a Species| Ok((species, places(species, prepared, &mut folded)?));
        let species = species.iter().map(&mut placed).collect::<Result<Vec<_>>>()?;
        Ok((!species.is_empty()).then_some(Others { species, units, folded }))
    }

    /// The box around the gas and these.
    pub fn around(&self, domain: &Domain<D>) -> Result<Domain<D>> {
        let ends = |k: usize| {
            let all = self.species.iter().flat_map(|(_, places)| places[k].iter());
            all.fold((domain.lo[k], domain.hi[k]), |(lo, hi), &x| (lo.min(x), hi.max(x)))
        };
        let ends: [(f64, f64); D] = sph::array(ends);
        let lo = ends.map(|e| e.0);
        // Particles at the upper end are within.
        let hi = sph::array(|k| if ends[k].1 > domain.hi[k] { ends[k].1.next_up() } else { domain.hi[k] });
        if lo == domain.lo && hi == domain.hi {
            Ok(domain.clone())
        } else {
            Ok(Domain::new(lo, hi, domain.axes, Region::Box)?)
        }
    }

    /// The particles in the box and `units` of the output; `velocities` adds the scene's motion to those at some places,
    /// and ids begin with `first`.
    pub fn species(
        &self,
        frame: &Frame<D>,
        (length, units): (f64, &UnitSystem),
        mut first: i64,
        velocities: &dyn Fn(&Positions<D>, Vec<Column>) -> Result<Option<Vec<f64>>>,
    ) -> Result<Vec<Species>> {
        let mut all = Vec::new();
        for (species, places) in &self.species {
            let count = species.table.count;
            let converted = species.table.columns.iter().map(|c| self.converted(c, units));
            let (own, mut columns): (Vec<Column>, Vec<Column>) = converted.partition(|c| c.name == names::VELOCITIES);
            columns.retain(|c| c.name != names::COORDINATES && c.name != names::PARTICLE_IDS);
            columns.insert(
                0,
                Column::new(
                    names::COORDINATES,
                    D,
                    Values::F64(frame.coordinates(places, length)),
                    UnitDimension::LENGTH,
                ),
            );
            let ids = Values::I64((first..first + count as i64).collect());
            columns.push(Column::new(names::PARTICLE_IDS, 1, ids, UnitDimension::NONE));
            let v = velocities(places, own)?;
            columns.extend(v.map(|v| Column::new(names::VELOCITIES, D, Values::F64(v), UnitDimension::VELOCITY)));
            first += count as i64;
            all.push(Species { part_type: species.part_type, table: ParticleTable { count, columns } });
        }
        Ok(all)
    }

    /// In words.
    pub fn describe(&self) -> String {
        format!("particles that are no gas go into the file as they are: {}", self.list())
    }

    /// That some are not where their file has them, if so.
    pub fn doubt(&self) -> Option<String> {
        (self.folded > 0).then(|| {
            format!(
                "{} particles that are no gas lie beyond a face of the periodic box, and come in at the other; make domain.box larger, or its boundary open",
                self.folded
            )
        })
    }

    /// How many there are of each type.
    pub fn list(&self) -> String {
        let types: Vec<String> =
            self.species.iter().map(|(s, _)| format!("{} of type {}", s.table.count, s.part_type)).collect();
        types.join(", ")
    }

    fn converted(&self, column: &Column, units: &UnitSystem) -> Column {
        let factor = self.units.to_cgs(column.dimension) / units.to_cgs(column.dimension);
        let mut column = column.clone();
        match &mut column.values {
            Values::F64(values) => values.iter_mut().for_each(|v| *v *= factor),
            Values::F32(values) if factor != 1.0 => {
                column.values = Values::F64(values.iter().map(|v| f64::from(*v) * factor).collect());
            }
            Values::F32(_) | Values::I64(_) => {}
        }
        column
    }
}

/// Whether a place is between the faces of all periodic axes, but for rounding.
fn is_within_faces<const D: usize>(domain: &Domain<D>, x: &[f64; D]) -> bool {
    let margin = ROUNDING * domain.size();
    let is_within = |k: usize| (domain.lo[k] - margin..=domain.hi[k] + margin).contains(&x[k]);
    (0..D).all(|k| domain.axes[k] != Axis::Periodic || is_within(k))
}

/// Where the particles of a species are; adds how many of them were beyond a periodic face.
fn places<const D: usize>(species: &Species, prepared: &Prepared<D>, folded: &mut usize) -> Result<Positions<D>> {
    let wrong = |problem: String| Error::field(format!("Coordinates of type {}", species.part_type), problem);
    let x = species.table.column(names::COORDINATES).filter(|x| x.components >= D);
    let x = x.ok_or_else(|| wrong("are missing".into()))?;
    let domain = &prepared.source.domain;
    let mut places: Positions<D> = std::array::from_fn(|_| Vec::with_capacity(species.table.count));
    for i in 0..species.table.count {
        let mut place: [f64; D] = sph::array(|k| x.values.get(i * x.components + k) / prepared.length);
        if let Some(value) = place.iter().find(|v| !v.is_finite()) {
            return Err(wrong(format!("are {value} at particle {i}, expected finite ones")));
        }
        if domain.axes.contains(&Axis::Periodic) {
            let within = domain.wrapped(&place);
            *folded += usize::from(!is_within_faces(domain, &place));
            place = within;
        }
        (0..D).for_each(|k| places[k].push(place[k]));
    }
    Ok(places)
}
