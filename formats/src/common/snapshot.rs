//! Writes GADGET-style HDF5 files; a flavor is one table of datasets.
//!
//! | object           | content                                                                                     |
//! |------------------|---------------------------------------------------------------------------------------------|
//! | `/Header`        | BoxSize, NumPart_* and MassTable of length 6, Time, flags; numbers of all flavors have shape (1,) |
//! | `/Units`         | the five `Unit ... in cgs (U_x)` attributes and, for SWIFT, nothing else (more breaks swiftsimio) |
//! | `/Parameters`    | `UnitLength_in_cm`, `UnitMass_in_g`, `UnitVelocity_in_cm_per_s`, `UnitEnergy_in_cgs`, also in `/Units`; not for SWIFT |
//! | `/PartType<n>`   | the flavor's datasets, then every other column under its own name (`/` becomes `_`)         |
//! | dataset attributes | `U_x exponent`, `a-scale exponent`, `h-scale exponent`, and SWIFT's factor to cgs units   |
//! | `/SphPrep`       | provenance as text; flavor, kernel, its neighbor number, periodic axes, edges that BoxSize does not say |
//!
//! This layout is taken by SWIFT, GADGET-4, GIZMO, swiftsimio, yt, pynbody and SPLASH. Quirks that shape it:
//! GADGET-4 crashes on a BoxSize of three elements and on arrays not of length 6; MassTable, if not zero,
//! overrides Masses; GIZMO stops on Flag_DoublePrecision 1 even where the data is double.

use crate::common::flavor::{BoxSize, Flavor, Job, Planned, Storage, TYPES};
use crate::common::hdf5::{Dataset, Group, Writer};
use crate::error::Result;
use crate::model::{ParticleFile, Species};
use crate::registry::WriteOptions;
use crate::stream::{Part, ParticleStream, Piece};
use crate::units::{UnitDimension, UnitSystem};
use std::ops::Range;
use std::path::Path;

/// The attribute of a dataset that says how many cgs units one of its own is, as SWIFT's snapshots have it.
const CGS_FACTOR: &str = "Conversion factor to CGS (not including cosmological corrections)";

/// SWIFT's name of the magnetic field, the one quantity that is measured with the help of a current.
pub(crate) const FLUX_DENSITIES: &str = "MagneticFluxDensities";

/// The group of this program's own facts.
pub(crate) const OWN_GROUP: &str = "SphPrep";
/// Attribute of it with the edges that BoxSize does not say.
pub(crate) const OWN_EDGES: &str = "BoxEdges";

/// Writes `particles` to `path`.
///
/// # Errors
/// [`crate::FormatError::Output`] where the flavor cannot hold them, [`crate::FormatError::Io`].
pub(crate) fn write(flavor: &Flavor, path: &Path, particles: &ParticleFile, options: WriteOptions) -> Result<()> {
    let job = Job { flavor, path, header: &particles.header, options, first_row: 0 };
    let plan = job.plan(particles)?;
    let writer = Writer::create(path)?;
    job.write_facts(&writer, &Part::new(particles.counts(), 0, 1))?;
    let mut first_id = 1;
    for (species, datasets) in particles.species.iter().zip(&plan) {
        if species.table.count > 0 {
            let group = writer.group(&format!("PartType{}", species.part_type))?;
            for dataset in datasets {
                job.write_dataset(&group, species, dataset, first_id)?;
            }
            first_id += species.table.count as u64;
        }
    }
    writer.close()
}

/// Writes one file of particles that are made block by block, of which no more are in memory at once.
///
/// # Errors
/// As [`write`], and those of the stream.
pub(crate) fn write_piece(flavor: &Flavor, piece: &Piece<'_>, options: WriteOptions) -> Result<()> {
    let (part, stream, path) = (&piece.part, piece.stream, piece.path);
    let job = Job { flavor, path, header: stream.header(), options, first_row: 0 };
    let writer = Writer::create(path)?;
    job.write_facts(&writer, part)?;
    for (t, &count) in part.counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let group = writer.group(&format!("PartType{t}"))?;
        let of_stream = OfStream { flavor, piece, options, part_type: t as u8, count };
        let first = of_stream.rows(0..1, &|_| true)?;
        let plan = job.plan_species(&first)?;
        for planned in &plan {
            of_stream.write(&job, &group, planned)?;
        }
    }
    writer.close()
}

/// Particles of one type in a piece of a stream.
struct OfStream<'a> {
    flavor: &'a Flavor,
    piece: &'a Piece<'a>,
    options: WriteOptions,
    part_type: u8,
    count: usize,
}

impl OfStream<'_> {
    fn rows(&self, range: Range<usize>, wanted: &dyn Fn(&str) -> bool) -> Result<Species> {
        let start = self.piece.part.starts[usize::from(self.part_type)];
        let table = self.piece.stream.rows(self.part_type, start + range.start..start + range.end, wanted)?;
        Ok(Species { part_type: self.part_type, table })
    }

    /// Writes one dataset, whose numbers are made from the columns that it needs.
    fn write(&self, job: &Job<'_>, group: &Group, first: &Planned<'_>) -> Result<()> {
        let first_id = self.piece.part.first_id(usize::from(self.part_type));
        let needed = first.columns();
        let (rows, columns, level) = (self.count, first.components, self.options.compression);
        let long = first.storage == Storage::Int && job.has_no_rule(&first.name) && self.flavor.long_columns;
        let each = |range: Range<usize>, fill: &mut dyn FnMut(&Job<'_>, &Planned<'_>, u64) -> Result<()>| {
            let species = self.rows(range.clone(), &|name| needed.contains(&name))?;
            let job = Job {
                flavor: self.flavor,
                path: self.piece.path,
                header: self.piece.stream.header(),
                options: self.options,
                first_row: self.piece.part.starts[usize::from(self.part_type)] + range.start,
            };
            let planned = job.plan_one(&species, &first.name)?;
            fill(&job, &planned, first_id + range.start as u64)
        };
        let double = first.storage == Storage::Double || self.options.double_precision;
        let name = &first.name;
        let dataset = match first.storage {
            Storage::Id => group.dataset(name, rows, columns, level, |range, out| {
                each(range.clone(), &mut |job, p, id| job.ids(p, 0..range.len(), id, out))
            })?,
            Storage::Long => group.dataset(name, rows, columns, level, |range, out| {
                each(range.clone(), &mut |job, p, _| job.longs(p, 0..range.len(), out))
            })?,
            // Whether later rows need 64 bits is not known.
            Storage::Int if long => group.dataset(name, rows, columns, level, |range, out| {
                each(range.clone(), &mut |job, p, _| job.longs(p, 0..range.len(), out))
            })?,
            Storage::Int => group.dataset(name, rows, columns, level, |range, out| {
                each(range.clone(), &mut |job, p, _| job.ints(p, 0..range.len(), out))
            })?,
            _ if double => group.dataset(name, rows, columns, level, |range, out| {
                each(range.clone(), &mut |job, p, _| job.doubles(p, 0..range.len(), out))
            })?,
            _ => group.dataset(name, rows, columns, level, |range, out| {
                each(range.clone(), &mut |job, p, _| job.singles(p, 0..range.len(), out))
            })?,
        };
        job.describe(&dataset, first)
    }
}

impl Job<'_> {
    fn write_facts(&self, writer: &Writer, part: &Part) -> Result<()> {
        self.write_header(writer, part, &self.box_size()?)?;
        self.write_units(writer)?;
        self.write_own(writer)
    }

    fn write_header(&self, writer: &Writer, part: &Part, box_size: &[f64]) -> Result<()> {
        let (counts, totals) = (part.counts.map(|n| n as u64), part.totals.map(|n| n as u64));
        let header = writer.group("Header")?;
        header.numbers("BoxSize", box_size)?;
        header.numbers("Dimension", &[self.header.dimension as i32])?;
        if counts.iter().all(|&n| u32::try_from(n).is_ok()) {
            header.numbers("NumPart_ThisFile", &counts.map(|n| n as u32))?;
        } else {
            header.numbers("NumPart_ThisFile", &counts)?;
        }
        let (low, high) = words(totals);
        if self.flavor.wide_totals && high != [0; TYPES] {
            header.numbers("NumPart_Total", &totals)?;
            header.numbers("NumPart_Total_HighWord", &[0_u32; TYPES])?;
        } else {
            header.numbers("NumPart_Total", &low)?;
            header.numbers("NumPart_Total_HighWord", &high)?;
        }
        header.numbers("MassTable", &[0.0f64; TYPES])?;
        header.numbers("Time", &[self.header.time])?;
        header.numbers("Redshift", &[0.0f64])?;
        header.numbers("NumFilesPerSnapshot", &[i32::try_from(part.files).unwrap_or(i32::MAX)])?;
        if part.files > 1 {
            header.numbers("ThisFile", &[i32::try_from(part.index).unwrap_or(i32::MAX)])?;
        }
        // pynbody does arithmetic with these, and NumPy takes no array of one element for a number there.
        for (name, number) in self.flavor.header {
            header.scalar(name, *number)?;
        }
        for flag in [
            "Flag_Entropy_ICs",
            "Flag_DoublePrecision",
            "Flag_Sfr",
            "Flag_Feedback",
            "Flag_Cooling",
            "Flag_StellarAge",
            "Flag_Metals",
        ] {
            header.numbers(flag, &[0i32])?;
        }
        Ok(())
    }

    fn write_units(&self, writer: &Writer) -> Result<()> {
        let u = &self.header.units;
        let group = writer.group("Units")?;
        group.numbers("Unit mass in cgs (U_M)", &[u.mass])?;
        group.numbers("Unit length in cgs (U_L)", &[u.length])?;
        group.numbers("Unit time in cgs (U_t)", &[u.time])?;
        group.numbers("Unit current in cgs (U_I)", &[1.0f64])?;
        group.numbers("Unit temperature in cgs (U_T)", &[u.temperature])?;
        if !self.flavor.unit_parameters {
            return Ok(());
        }
        // pynbody looks for GADGET's names in /Units where there is such a group, else in /Parameters.
        let parameters = writer.group("Parameters")?;
        for (name, value) in unit_parameters(u) {
            group.scalar(name, value)?;
            parameters.scalar(name, value)?;
        }
        Ok(())
    }

    fn write_own(&self, writer: &Writer) -> Result<()> {
        let own = writer.group(OWN_GROUP)?;
        for (key, value) in &self.header.provenance {
            own.text(key, value)?;
        }
        own.text("Flavor", self.flavor.format)?;
        own.text("Kernel", &self.header.kernel)?;
        own.numbers("KernelNeighbors", &[self.header.kernel_neighbors])?;
        let edges = &self.header.box_size[..self.header.dimension];
        if matches!(self.flavor.box_size, BoxSize::First | BoxSize::Halves)
            && edges.iter().any(|edge| *edge != edges[0])
        {
            own.numbers(OWN_EDGES, edges)?;
        }
        own.numbers("Periodic", &self.header.periodic.map(i32::from))
    }

    fn write_dataset(&self, group: &Group, species: &Species, planned: &Planned, first_id: u64) -> Result<()> {
        let (rows, level) = (species.table.count, self.options.compression);
        let columns = planned.components;
        let double = planned.storage == Storage::Double || self.options.double_precision;
        let name = &planned.name;
        let dataset = match planned.storage {
            Storage::Id => {
                group.dataset(name, rows, columns, level, |range, out| self.ids(planned, range, first_id, out))?
            }
            Storage::Int => group.dataset(name, rows, columns, level, |range, out| self.ints(planned, range, out))?,
            Storage::Long => group.dataset(name, rows, columns, level, |range, out| self.longs(planned, range, out))?,
            _ if double => group.dataset(name, rows, columns, level, |range, out| self.doubles(planned, range, out))?,
            _ => group.dataset(name, rows, columns, level, |range, out| self.singles(planned, range, out))?,
        };
        self.describe(&dataset, planned)
    }

    fn describe(&self, dataset: &Dataset, planned: &Planned) -> Result<()> {
        let current = if planned.name == FLUX_DENSITIES { -1.0 } else { 0.0 };
        write_exponents(dataset, planned.dimension, current)?;
        dataset.numbers(CGS_FACTOR, &[self.header.units.to_cgs(planned.dimension)])
    }
}

/// Units under the names of GADGET's parameter files.
fn unit_parameters(u: &UnitSystem) -> [(&'static str, f64); 4] {
    let speed = u.length / u.time;
    [
        ("UnitLength_in_cm", u.length),
        ("UnitMass_in_g", u.mass),
        ("UnitVelocity_in_cm_per_s", speed),
        // Without it yt takes energies for (km/s)^2.
        ("UnitEnergy_in_cgs", u.mass * speed * speed),
    ]
}

/// Low and high words of particle numbers, as headers have them since GADGET-2.
fn words(counts: [u64; TYPES]) -> ([u32; TYPES], [u32; TYPES]) {
    (counts.map(|n| n as u32), counts.map(|n| (n >> 32) as u32))
}

/// Particle numbers from their low and high words; the high ones may be missing. Low ones that take more than 32 bits, as
/// GADGET-4 writes them, are whole numbers already.
#[cfg_attr(not(feature = "gadget"), allow(dead_code))]
pub(crate) fn joined(low: &[f64], high: &[f64]) -> Vec<f64> {
    let word = f64::from(u32::MAX) + 1.0;
    let high = |i: usize, low: f64| if low < word { high.get(i).copied().unwrap_or(0.0) } else { 0.0 };
    low.iter().enumerate().map(|(i, &n)| n + word * high(i, n)).collect()
}

/// The attributes by which swiftsimio knows a dataset's units.
fn write_exponents(dataset: &Dataset, d: UnitDimension, current: f32) -> Result<()> {
    dataset.numbers("U_M exponent", &[f32::from(d.mass)])?;
    dataset.numbers("U_L exponent", &[f32::from(d.length)])?;
    dataset.numbers("U_t exponent", &[f32::from(d.time)])?;
    dataset.numbers("U_I exponent", &[current])?;
    dataset.numbers("U_T exponent", &[f32::from(d.temperature)])?;
    dataset.numbers("a-scale exponent", &[0.0f32])?;
    dataset.numbers("h-scale exponent", &[0.0f32])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn particle_numbers_beyond_32_bits_take_two_words() {
        let counts = [5 * (1 << 32) + 7, 0, u64::from(u32::MAX), 1 << 32, 1, 0];
        let (low, high) = words(counts);
        assert_eq!((low, high), ([7, 0, u32::MAX, 0, 1, 0], [5, 0, 0, 1, 0, 0]));
        let wide = |v: [u32; TYPES]| v.map(f64::from);
        assert_eq!(joined(&wide(low), &wide(high)), counts.map(|n| n as f64));
        assert_eq!(joined(&[3.0, 4.0], &[]), [3.0, 4.0]);
        let whole = counts.map(|n| n as f64);
        assert_eq!(joined(&whole, &wide(high)), whole);
    }
}
