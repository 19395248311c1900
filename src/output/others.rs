//! Particles other than gas in a snapshot that is re-sampled: dark matter, stars, sinks. They are copied to the new file unchanged, in its units
//! and box, with ids that follow those of the gas.

use super::frame::Frame;
use crate::error::{Error, Result};
use crate::input::internal_units::Prepared;
use crate::target::Positions;
use sph::domain::{Axis, Domain, Region};
use sph_formats::common::particle_names as names;
use sph_formats::{Column, ParticleTable, Species, UnitDimension, UnitSystem, Values};

/// Particles that are no gas, in internal units of length and else in the file's.
pub(crate) struct Others<'a, const D: usize> {
    species: Vec<(&'a Species, Positions<D>)>,
    units: UnitSystem,
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
        let placed = |species: &'a Species| Ok((species, places(species, prepared)?));
        let species = species.iter().map(placed).collect::<Result<Vec<_>>>()?;
        Ok((!species.is_empty()).then_some(Others { species, units }))
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
        let types: Vec<String> =
            self.species.iter().map(|(s, _)| format!("{} of type {}", s.table.count, s.part_type)).collect();
        format!("particles that are no gas go into the file as they are: {}", types.join(", "))
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

/// Where the particles of a species are.
fn places<const D: usize>(species: &Species, prepared: &Prepared<D>) -> Result<Positions<D>> {
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
            place = domain.wrapped(&place);
        }
        (0..D).for_each(|k| places[k].push(place[k]));
    }
    Ok(places)
}
