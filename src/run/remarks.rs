//! What there is to say of a run beside its figures. Every way of making particles says the same: at once, over ranks, block by block, seeded or
//! from copies of a box.

use super::doubts;
use super::variables::{VariableReport, lost, magnetic_units, variables};
use crate::codes::TargetCode;
use crate::input::ingest::RawInput;
use crate::input::internal_units::Prepared;
use crate::input::stated_units::Stated;
use crate::input::units::InputUnits;
use crate::scene::Scene;
use crate::target::Regions;
use sph_formats::{Column, FormatSpec, ParticleFile, Species};

/// Notes, and warnings of what is probably not meant.
#[derive(Debug, Clone, Default)]
pub struct Remarks {
    pub notes: Vec<String>,
    pub warnings: Vec<String>,
}

/// What is said of particles that formed at a time of the snapshot, which is after the file's start.
fn born_later(species: &Species, time: f64) -> Option<String> {
    let is_birth = |column: &&Column| {
        let name = column.name.to_lowercase();
        name.contains("formationtime") || name.contains("birthtime") || name.contains("birth_time")
    };
    let column = species.table.columns.iter().find(is_birth)?;
    let last = (0..column.values.len()).map(|i| column.values.get(i)).fold(f64::NEG_INFINITY, f64::max);
    (last > 0.0).then(|| {
        format!(
            "'{}' of type {} goes into the file as it is, with times up to {last:.6e}, and the file starts at time 0: these particles would form after \
             the start; start the code at the snapshot's time, {time:.6e}, or subtract that from the column",
            column.name, species.part_type
        )
    })
}

impl Remarks {
    /// What an input and its units say; with the units.
    pub(crate) fn of_input(Stated { input, notes, doubts }: Stated, raw: &RawInput) -> (Option<InputUnits>, Self) {
        let mut told = Self { notes, warnings: doubts };
        told.notes.extend(raw.field().into_iter().flat_map(|field| field.notes.iter().cloned()));
        if let RawInput::Snapshot(snapshot) = raw
            && snapshot.time != 0.0
        {
            let time = snapshot.time;
            told.notes
                .push(format!("the file starts at time 0, not at the snapshot's, {time:e} in the snapshot's units"));
            told.warnings.extend(snapshot.others.iter().filter_map(|species| born_later(species, time)));
        }
        (input, told)
    }

    pub(crate) fn add(&mut self, other: Self) {
        self.notes.extend(other.notes);
        self.warnings.extend(other.warnings);
    }

    /// What there is to say of the target of `count` particles before there are any.
    pub(crate) fn of_target<const D: usize>(&mut self, scene: &Scene, prepared: &Prepared<D>, count: usize) {
        // What is said of a snapshot's field is not of particles that stay.
        self.notes.extend(prepared.notes.iter().filter(|_| !scene.input.keeps_particles()).cloned());
        self.notes.extend(doubts::unused(scene).into_iter().chain(doubts::unused_of_input(scene, prepared)));
        self.warnings.extend(prepared.doubts.iter().cloned());
        self.warnings.extend(doubts::before(scene, prepared, count));
    }

    /// What there is to say of regions without particles.
    pub(crate) fn of_regions<const D: usize>(&mut self, regions: Option<&Regions<'_, D>>, count: usize) {
        if let Some(told) = doubts::left_out(regions, count) {
            told.among(&mut self.warnings, &mut self.notes);
        }
    }

    /// The code that particles are for, and what its kernel does.
    pub(crate) fn of_code<const D: usize>(&mut self, scene: &Scene, format: Option<&FormatSpec>) {
        let (kernel, neighbors) = (scene.kernel(), scene.kernel_neighbors(D));
        self.notes.extend(scene.code().and_then(|code| code.pairing(D)));
        self.notes.extend(match scene.code() {
            Some(code) => Some(format!("made for {}", code.describe(D))),
            None => format.and_then(|f| TargetCode::of_format(f.name)?.mismatch(kernel, D, neighbors)),
        });
    }

    /// What becomes of the columns of `file`, or of some of its rows, in a format.
    pub(crate) fn of_file<const D: usize>(
        &mut self,
        prepared: &Prepared<D>,
        file: &ParticleFile,
        format: Option<&FormatSpec>,
    ) -> Vec<VariableReport> {
        self.notes.extend(magnetic_units(file, format, &file.header.units));
        let format = format.map(|f| (f.name, f.capabilities.columns));
        let gas = file.species.first().map(|species| &species.table);
        let (variables, warnings) = gas.map(|gas| variables(&prepared.variables, gas, format)).unwrap_or_default();
        self.warnings.extend(warnings);
        self.warnings.extend(format.into_iter().flat_map(|format| lost(file, &variables, format)));
        variables
    }
}
